"""The landscape as an interactive map: a web app for your own machine, without a build step."""
