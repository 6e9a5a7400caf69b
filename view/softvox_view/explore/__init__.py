"""The landscape as a living map: a web app for one's own machine.

`parameters` reads what a browser asks for, `landscapes` computes it, `jobs` lets the newest request
of a browser tab win, `paths` follows a searcher, `guard` refuses other origins, `app` puts them
together and `server` runs them. The page is in `assets`: plain ES modules, no build step.
"""
