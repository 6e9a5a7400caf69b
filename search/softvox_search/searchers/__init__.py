"""The searchers that come with the package, one per module, loaded on first use."""
