"""Experiments: many runs as a file describes them, in parallel, into one folder.

An experiment is read from a TOML file (`config`), each of its runs is a pure function of it
(`job`), processes do them (`pool`), a journal keeps what is done (`journal`), and at the end one
folder holds it all (`folder`). `compare` puts these together.
"""
