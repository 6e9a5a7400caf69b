"""Pictures: the paper's figures, replays, and a landscape one can explore."""
