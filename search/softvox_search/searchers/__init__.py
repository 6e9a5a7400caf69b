"""The searchers that are compared, one to a module; each is loaded when it is asked for."""
