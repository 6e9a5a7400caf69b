"""The landscape as a living map: a web app for one's own machine.

`requests` reads what a browser asks for, `landscapes` and `paths` compute it, and `app` answers.
The page is in `assets`: plain ES modules, no build step.
"""
