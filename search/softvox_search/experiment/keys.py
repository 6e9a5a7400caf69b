"""What the file of an experiment says; `softvox compare --help` shows it, and `read` reads it."""

#: The keys of the file.
KEYS = """\
  seeds          runs per cell; a cell is a searcher at a level with a policy
  entropy        a whole number; all random streams derive from it (0)
  [budget]       of each run: unique (different designs; under noise every
                 evaluation counts), evaluations (all; 20 times unique), steps
                 (simulated); the first that is used up ends it
  [env]          physics: a preset's name or a table of parameters
                 ("published"); table: whether the exact table answers where
                 nothing disturbs the simulation (true); id
  levels         of JakobiNoise, which is put around the bare environment, or is
                 where [[wrappers]] names it; left out, there is no such noise
  [[wrappers]]   name (FitnessNoise, JakobiNoise, Resample, or your own as
                 package.module:Class) and the wrapper's arguments; from the
                 environment outward
  [[policies]]   name, and switches against luck under noise: running_mean,
                 reevaluate_parents, final_stage (false), finalists (10),
                 resamples (8)
  [[searchers]]  name (from softvox search --list, or your own as
                 package.module:Class); label (the name); options = {}; seeds
                 and budget where they differ from the others', which needs a
                 reason
"""

#: A small experiment.
EXAMPLE = """\
seeds = 10
[budget]
unique = 500
[[searchers]]
name = "random"
[[searchers]]
name = "ga"
options = { population = 30 }
"""
