"""The commands that show things; `softvox` finds them by their entry points."""
