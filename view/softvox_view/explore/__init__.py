"""The landscape as a living map: a web app for one's own machine, without a build step."""
