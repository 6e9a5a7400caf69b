"""The landscape as a living map: a web app for one's own machine.

`requests` reads what a browser asks for, `app` answers, `landscapes` and `paths` compute, `guard`
refuses other origins and `server` runs them. The page is in `assets`: plain ES modules, no build
step.
"""
