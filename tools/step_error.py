"""Changes of fitness at half the time step under random physics: docs/physics.md, section 11.

Run by `make step-error`; takes about ten minutes of one core. Draws physics from wide ranges, with
a design for each, simulates them at the time step and at half of it, and prints the differences.
"""

import warnings

import numpy as np

from softvox_gym import Physics, simulate
from softvox_gym.physics import ACTUATIONS, STEPS_PER_CYCLE, ParameterError

N, CHUNK, SEED = 20_000, 400, 11

#: Ends of the ranges; draws are uniform in the logarithm.
LOGARITHMIC = {
    "youngs_modulus": (3e6, 3e7),
    "friction_static": (0.01, 3.0),
    "gravity": (0.1, 100.0),
    "damping_link": (0.01, 10.0),
    "damping_ground": (0.01, 10.0),
    "damping_global": (1e-4, 0.3),
    "frequency_hz": (0.3, 100.0),
    "strain": (0.01, 4.0),
    "time_step_fraction": (0.5, 1.0),
}

#: A pump that moves edges at less than this share of the speed of sound is slow.
SLOW = 0.1


def drawn(rng: np.random.Generator, actuation: str) -> tuple[Physics, int]:
    """Return a random valid physics, and how many draws were refused before it."""
    refused = 0
    while True:
        one = {name: np.exp(rng.uniform(*np.log(ends))) for name, ends in LOGARITHMIC.items()}
        one["friction_kinetic"] = one["friction_static"] * rng.uniform(0.1, 1.0)
        one["poisson_ratio"] = rng.uniform(-0.5, 0.5)
        one["gravity"] = -one["gravity"]
        # T*: half have no shear strength.
        shear = np.exp(rng.uniform(np.log(0.01), np.log(2.0))) * (rng.random() < 0.5)
        try:
            made = Physics.of({**one, "shear_ratio": shear, "actuation": actuation})
            return made, refused
        except ParameterError:
            refused += 1


def pump_speed(physics: Physics) -> float:
    """Return the speed of pumped edges, including a jump at the start, over that of sound."""
    rate = float(np.sqrt(physics.youngs_modulus / physics.density)) / physics.edge
    turn = 2 * np.pi * float(physics.frequency_hz)
    start = float(np.sin(turn * physics.settle_time))
    if physics.actuation != "expand_and_contract":
        start = max(start, 0.0)
    return float(physics.strain) * max(turn / rate, abs(start))


def row(name: str, error: np.ndarray) -> str:
    """Return a row of the table in docs/physics.md."""
    shares = [f"{(error > least).mean():.2%}" for least in (0.01, 0.1, 1.0)]
    most = [f"{value:.3g}" for value in np.quantile(error, [0.5, 0.9, 0.99])]
    cells = [name, len(error), *most, *shares, int((error > 10).sum())]
    return f"| {' | '.join(map(str, cells))} |"


def main() -> None:
    """Draw, simulate and print."""
    warnings.simplefilter("ignore", UserWarning)  # few steps per cycle: listed separately below
    rng = np.random.default_rng(SEED)
    made, refused = [], 0
    for i in range(N):
        physics, more = drawn(rng, ACTUATIONS[i % len(ACTUATIONS)])
        made.append(physics)
        refused += more
    designs = rng.integers(1, 6561, N)
    # Sorted so that designs that run together take equally long.
    order = sorted(range(N), key=lambda i: (made[i].actuation, float(made[i].time_step)))
    diverged, error = np.zeros(N, dtype=bool), np.full(N, np.nan)
    names = (*LOGARITHMIC, "friction_kinetic", "poisson_ratio", "shear_strength")
    for actuation in ACTUATIONS:
        own = [i for i in order if made[i].actuation == actuation]
        for at in range(0, len(own), CHUNK):
            chunk = own[at : at + CHUNK]
            values = {name: np.array([getattr(made[i], name) for i in chunk]) for name in names}
            values["gravity"] = np.multiply.outer(values["gravity"], [0.0, 0.0, 1.0])
            joined = Physics(**values, actuation=actuation)
            result = simulate(designs[chunk], joined, check_step=True)
            diverged[chunk], error[chunk] = result.diverged, result.step_error
    ok = ~np.isnan(error)
    steps = np.array([1 / (float(p.frequency_hz) * float(p.time_step)) for p in made])
    followed = ok & (steps >= STEPS_PER_CYCLE)
    slow = followed & (np.array([pump_speed(p) for p in made]) < SLOW)
    print(f"{refused} refused before {N} accepted; {diverged.sum()} diverge at the step, ", end="")
    print(f"{(~ok & ~diverged).sum()} at half of it alone")
    print("| runs that are ok | | median | 90 % | 99 % | > 0.01 | > 0.1 | > 1 | > 10, runs |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    print(row("all", error[ok]))
    print(row(f"at least {STEPS_PER_CYCLE} steps a cycle", error[followed]))
    print(row("and a slow pump", error[slow]))
    for i in np.flatnonzero(slow & (error > 10)):
        print(designs[i], f"{error[i]:.1f}", made[i])


if __name__ == "__main__":
    main()
