"""Learners beside evolution and chance, at equal numbers of simulated episodes.

    python baselines/learners.py [PROBLEM ...]

writes baselines/learners: every curve, every run, a figure, a report and a manifest. It needs the
extras search, adapters and learn. Given problems are done anew, the others kept as they are.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
import pandas as pd
from gymnasium.wrappers.vector import FlattenObservation, RescaleAction
from numpy.typing import NDArray

from softvox_gym.manifest import provenance
from softvox_gym.wrappers.vector import DiscreteAction
from softvox_search import registry
from softvox_search.oracle import Budget, Oracle
from softvox_search.report import style, text
from softvox_search.report.statistics import band, iqm
from softvox_search.run import run

FOLDER = Path(__file__).parent / "learners"
SEEDS = range(1, 6)  # with others the settings were looked for
BATCH = 32  # episodes side by side
POINTS = 16  # of every curve
RECENT = 64  # episodes, whose mean is what a method is worth on its way

TABLE = "SoftVoxTable2x2x2-v0"  # the engine's bits, looked up
GROWTH, CONTROL = "SoftVoxGrow2x2x2-v0", "SoftVoxControl-v0"
INTERVAL = 0.5  # cycles: an action for the half in which actuators grow, one for the other

#: Of the learners, where they are not the defaults of the libraries; the same for all seeds.
OF_PPO: dict[str, Any] = {"n_epochs": 5, "learning_rate": 1e-3, "gamma": 0.97, "batch_size": 240}
OF_MASKABLE: dict[str, Any] = {"n_epochs": 5, "learning_rate": 1e-3, "gamma": 1.0}
OF_DQN: dict[str, Any] = {"learning_rate": 1e-3, "gamma": 0.0, "learning_starts": 128}
OF_DQN |= {"train_freq": 1, "gradient_steps": 8, "exploration_fraction": 0.5}

Array = NDArray[np.float64]


class Outcome(NamedTuple):
    """What came of a run: the fitness of every episode in order, and what is recommended."""

    fitness: Array
    final: float


#: Does a run of so many episodes with a seed.
Method = Callable[[int, int], Outcome]


class Problem(NamedTuple):
    """What is to be learnt, and by whom: the learner first, chance last."""

    title: str
    episodes: int
    methods: dict[str, Method]
    settings: dict[str, dict[str, Any]]


def control(design: int) -> Any:
    """Return a batch of robots of a design, with amplitudes between -1 and 1 as actions."""
    options: Any = {"design": design, "interval": INTERVAL, "autoreset_mode": "Disabled"}
    envs = gym.make_vec(CONTROL, num_envs=BATCH, threads=1, **options)
    return RescaleAction(envs, np.float32(-1), np.float32(1))


def played(envs: Any, plans: NDArray[np.float32]) -> Array:
    """Return the fitness of open-loop plans, shape (intervals, BATCH, actuators)."""
    envs.reset(seed=0)
    for actions in plans:
        infos = envs.step(actions)[4]
    return np.nan_to_num(infos["fitness"])


def best(batches: Iterator[Array]) -> Outcome:
    """Return the outcome of a method that recommends the best that it met."""
    fitness = np.concatenate(list(batches))
    return Outcome(fitness, float(fitness.max()))


def random_control(design: int, seed: int, episodes: int) -> Outcome:
    """Play amplitudes at random, an own one for every interval and actuator."""
    envs, rng = control(design), np.random.default_rng(seed)
    shape = envs.unwrapped.episodes.steps, *envs.action_space.shape
    plans = (rng.uniform(-1, 1, shape).astype(np.float32) for _ in range(episodes // BATCH))
    return best(played(envs, plan) for plan in plans)


def evolved(design: int, repeated: bool, seed: int, episodes: int) -> Outcome:
    """Evolve a plan of amplitudes by separable CMA-ES, for all intervals or one cycle of them."""
    from cmaes import SepCMA

    envs = control(design)
    steps, (_, k) = envs.unwrapped.episodes.steps, envs.action_space.shape
    period = round(1 / INTERVAL) if repeated else steps
    bounds = np.tile([-1.0, 1.0], (period * k, 1))
    search = SepCMA(np.zeros(period * k), 0.6, bounds=bounds, seed=seed, population_size=BATCH)

    def generations() -> Iterator[Array]:
        for _ in range(episodes // BATCH):
            genes = np.array([search.ask() for _ in range(BATCH)])
            plans = genes.reshape(BATCH, period, k).swapaxes(0, 1).astype(np.float32)
            yield (fitness := played(envs, plans[np.arange(steps) % period]))
            search.tell(list(zip(genes, -fitness, strict=True)))

    return best(generations())


def searched(name: str, seed: int, episodes: int) -> Outcome:
    """Let one of this package's searchers propose designs; known ones count again."""
    searcher = registry.make(name, np.random.default_rng(seed))
    oracle = Oracle(lambda n: gym.make_vec(TABLE, num_envs=n), Budget(evaluations=episodes))
    run(searcher, oracle)
    return best(iter([oracle.log.columns()["fitness"]]))


def learnt(model: Any, episodes: int, steps: int = 1) -> Outcome:
    """Train a learner of Stable-Baselines3; recommended is its policy, without chance."""
    fitness: list[float] = []

    def note(told: dict[str, Any], _: Any) -> bool:
        ends = zip(told["dones"], told["infos"], strict=True)
        fitness.extend(float(np.nan_to_num(info["fitness"])) for is_over, info in ends if is_over)
        return True

    model.learn(episodes * steps, callback=note)
    env = model.get_env()
    env.training = False  # where it scales observations
    observations = env.reset()
    for _ in range(steps):
        has_masks = env.has_attr("action_masks")
        masks = {"action_masks": np.stack(env.env_method("action_masks"))} if has_masks else {}
        actions, _ = model.predict(observations, deterministic=True, **masks)
        observations, _, _, infos = env.step(actions)
    return Outcome(np.array(fitness[:episodes]), float(np.nan_to_num(infos[0]["fitness"])))


def ppo(design: int, seed: int, episodes: int) -> Outcome:
    """Learn to control a robot by PPO."""
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecNormalize

    from softvox_gym.sb3 import SB3VecEnv

    envs = control(design)
    steps = envs.unwrapped.episodes.steps
    env = VecNormalize(SB3VecEnv(envs), norm_reward=False)
    made = PPO("MlpPolicy", env, n_steps=steps, seed=seed, device="cpu", **OF_PPO)
    return learnt(made, episodes, steps)


def maskable(seed: int, episodes: int) -> Outcome:
    """Learn to grow robots in one piece by MaskablePPO."""
    from sb3_contrib import MaskablePPO

    from softvox_gym.sb3 import SB3VecEnv

    options: Any = {"from_table": True, "connected": True, "autoreset_mode": "Disabled"}
    env = SB3VecEnv(gym.make_vec(GROWTH, num_envs=BATCH, **options))
    made = MaskablePPO("MlpPolicy", env, n_steps=8, seed=seed, device="cpu", **OF_MASKABLE)
    return learnt(made, episodes, 8)


def dqn(seed: int, episodes: int) -> Outcome:
    """Learn what each of 6561 actions is worth by DQN."""
    from stable_baselines3 import DQN

    from softvox_gym.sb3 import SB3VecEnv

    envs = gym.make_vec(TABLE, num_envs=BATCH, autoreset_mode="Disabled")
    env = SB3VecEnv(FlattenObservation(DiscreteAction(envs)))
    return learnt(DQN("MlpPolicy", env, seed=seed, device="cpu", **OF_DQN), episodes)


def _control(title: str, design: int) -> Problem:
    methods: dict[str, Method] = {
        "ppo": lambda *how: ppo(design, *how),
        "evolution, all cycles": lambda *how: evolved(design, False, *how),
        "evolution, one cycle": lambda *how: evolved(design, True, *how),
        "random": lambda *how: random_control(design, *how),
    }
    return Problem(title, 512, methods, {"PPO": OF_PPO})


_SEARCHERS: dict[str, Method] = {
    "evolution": lambda *how: searched("mu_plus_lambda", *how),
    "random": lambda *how: searched("random", *how),
}

PROBLEMS = {
    "control_6453": _control("Control of 6453", 6453),
    "control_6560": _control("Control of the full cube, 6560", 6560),
    "growth": Problem(
        "Growth on 2x2x2",
        1024,
        {"maskable_ppo": maskable, **_SEARCHERS},
        {"MaskablePPO": OF_MASKABLE},
    ),
    "discrete": Problem("Discrete(6561)", 1024, {"dqn": dqn, **_SEARCHERS}, {"DQN": OF_DQN}),
}


def curve(fitness: Array, points: int = POINTS) -> dict[str, Array | NDArray[np.int64]]:
    """Return a curve: the best so far, and the mean of recent episodes, after so many of them."""
    at = np.arange(1, points + 1) * (len(fitness) // points)
    recent = [fitness[max(0, n - RECENT) : n].mean() for n in at]
    return {"episodes": at, "best": np.maximum.accumulate(fitness)[at - 1], "recent": recent}


def done(name: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Do all runs of a problem; return its curves, and what came of the runs."""
    curves, runs = [], []
    problem = PROBLEMS[name]
    for method, play in problem.methods.items():
        for seed in SEEDS:
            begun = time.process_time()
            outcome = play(seed, problem.episodes)
            about = {"problem": name, "method": method, "seed": seed}
            curves.append(pd.DataFrame({**about, **curve(outcome.fitness)}))
            last = curves[-1].iloc[-1].to_dict()
            seconds = round(time.process_time() - begun, 1)
            runs.append({**last, "final": outcome.final, "cpu_seconds": seconds})
            print(runs[-1], flush=True)
    return pd.concat(curves), pd.DataFrame(runs)


def draw(curves: pd.DataFrame) -> bytes:
    """Draw the best so far above the mean of recent episodes, a column per problem, as PNG."""
    with style.style():
        names = [name for name in PROBLEMS if (curves["problem"] == name).any()]
        made = style.figure(3.2 * max(len(names), 2), 5.4)
        rows = made.subplots(2, len(names), sharex="col", sharey="col", squeeze=False)
        for column, name in zip(rows.T, names, strict=True):
            own = curves[curves["problem"] == name]
            for i, method in enumerate(PROBLEMS[name].methods):
                color = style.INK if method == "random" else style.COLOURS[(0, 1, 5)[i]]
                for axis, value in zip(column, ("best", "recent"), strict=True):
                    table = own[own["method"] == method].pivot(
                        index="seed", columns="episodes", values=value
                    )
                    axis.fill_between(table.columns, *band(table), color=color, alpha=0.2, lw=0)
                    axis.plot(table.columns, iqm(table.T), color=color, label=method)
            column[0].set_title(PROBLEMS[name].title)
            column[0].set_ylim(bottom=0)
            column[1].legend(fontsize="small", loc="upper left")
            column[1].set_xlabel("episodes")
        rows[0, 0].set_ylabel("best so far, voxel widths")
        rows[1, 0].set_ylabel(f"mean of the last {RECENT}")
        return style.encoded(made)


def page(runs: pd.DataFrame, manifests: dict[str, Any]) -> str:
    """Return the report."""
    parts = ["# Learners\n\n```sh\npython baselines/learners.py\n```\n"]
    parts.append(
        f"{len(SEEDS)} seeds each: interquartile mean with its 95 % band of the bootstrap over "
        "seeds, voxel widths. *Best* is the best episode; *recent* the mean of the last "
        f"{RECENT}; *recommended* what is handed over in the end: the policy without chance of a "
        "learner, the best that it met of the others.\n\n![learners.png](learners.png)\n"
    )
    for name in runs["problem"].unique():
        problem, own, rows = PROBLEMS[name], runs[runs["problem"] == name], []
        for method in problem.methods:
            table = own[own["method"] == method]
            cells = {
                label: text.with_band(float(iqm(table[column])), *map(float, band(table[column])))
                for label, column in (
                    ("best", "best"),
                    ("recent", "recent"),
                    ("recommended", "final"),
                )
            }
            seconds = text.number(table["cpu_seconds"].mean(), 1)
            rows.append({"method": method, **cells, "CPU seconds a run": seconds})
        parts.append(f"## {problem.title}\n\n{problem.episodes} episodes.\n")
        parts.append(text.markdown(rows))
    parts.append("## Settings\n\nWhere they are not the libraries' defaults:\n")
    settings = {k: v for one in manifests.values() for k, v in one["settings"].items()}
    parts.append(
        text.markdown(
            {"of": of, "settings": f"`{json.dumps(told)}`"} for of, told in settings.items()
        )
    )
    return "\n".join(parts)


def main(names: list[str]) -> None:
    """Do problems, and write all files anew."""
    if unknown := set(names) - set(PROBLEMS):
        sys.exit(f"no such problem: {', '.join(sorted(unknown))}; there are {', '.join(PROBLEMS)}")
    import sb3_contrib  # noqa: F401, before the first clock
    import torch

    torch.set_num_threads(1)  # networks are small; and the same bits on any machine's cores
    names = names or list(PROBLEMS)
    libraries = ("cmaes", "sb3-contrib", "stable-baselines3", "torch")
    versions = {library: metadata.version(library) for library in libraries}
    FOLDER.mkdir(exist_ok=True)
    path = FOLDER / "manifest.json"
    manifests = json.loads(path.read_text()) if path.exists() else {}
    for name in names:
        settings = PROBLEMS[name].settings
        manifests[name] = provenance(threads=1) | {"libraries": versions, "settings": settings}
        manifests = {name: manifests[name] for name in PROBLEMS if name in manifests}
        tables = dict(zip(("curves", "runs"), done(name), strict=True))
        for kind, table in tables.items():
            path = FOLDER / f"{kind}.csv"
            parts = [pd.read_csv(path)] if path.exists() else []
            parts = [part[part["problem"] != name] for part in parts]
            whole = pd.concat([*parts, table])
            order = whole["problem"].map(list(PROBLEMS).index)
            path.write_bytes(text.csv(whole.iloc[np.argsort(order, kind="stable")]))
        written = {kind: pd.read_csv(FOLDER / f"{kind}.csv") for kind in tables}
        (FOLDER / "manifest.json").write_text(json.dumps(manifests, indent=2) + "\n")
        (FOLDER / "report.md").write_text(page(written["runs"], manifests))
        (FOLDER / "learners.png").write_bytes(draw(written["curves"]))


if __name__ == "__main__":
    main(sys.argv[1:])
