"""Every design of the 2x2x2 lattice: tables, the exhaustive search, and what they tell."""
