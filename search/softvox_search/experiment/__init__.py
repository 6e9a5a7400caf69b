"""Experiments: a file describes many runs, which are done in parallel and kept in one folder.

`schema` reads a TOML file into an experiment and lists its runs; `environments` makes their
environments; `run` does one run, `pool` does many in processes; `results` writes and reads the
folder; `compare` does the runs missing there, and merges parts.
"""
