"""Pictures: the paper's figures, replays, and an interactive landscape."""
