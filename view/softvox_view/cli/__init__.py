"""The commands for views; `softvox` finds them by their entry points."""
