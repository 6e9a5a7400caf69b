"""Experiments: many runs as a file describes them, in parallel, into one folder.

`schema` reads a TOML file into an experiment and lists its runs; `environments` makes what they are
put to, `run` does one, `pool` does many in processes; `results` is the folder, written and read;
`compare` does what is missing there, and merges parts.
"""
