"""The commands of the search suite; `softvox` finds them by their entry points."""
