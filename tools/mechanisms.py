"""The effects of single changes on headings: numbers of docs/reality-gap.md that no table has.

Run by `make mechanisms`; takes about three minutes of one core. Prints every number with a label.
"""

from dataclasses import replace

import numpy as np

from softvox_gym import Physics, landscape, reality, simulate
from softvox_gym.design import refined, stack_of
from softvox_gym.landscapes.gap import row, srcc, value
from softvox_gym.landscapes.robustness import TOP, kendall_tau, ranked
from softvox_gym.real_tracks import LITTLE
from softvox_gym.realities import Reality

PUBLISHED = Physics.published()

#: Changes of one parameter, as factors of the published value or as values.
SCAN = {
    "youngs_modulus": [1e6, 3e6, 3e7, 1e8],
    "poisson_ratio": [0.0, 0.2, 0.45],
    "density": [2.5e5, 5e5, 2e6, 4e6],
    "friction_static": [0.5, 0.7, 1.5, 2.0],
    "friction_kinetic": [0.05, 0.1, 0.25, 1.0],
    "shear_strength": [1e4, 3e4, 1e5, 3e5],
    "gravity": [-1.62, -3.7, -20.0],
    "damping_link": [0.3, 0.6, 2.0],
    "damping_ground": [0.2, 0.5, 1.0],
    "damping_global": [0.0, 0.03, 0.1],
    "frequency_hz": [1.0, 2.0, 6.0, 8.0],
    "strain": [0.1, 0.15, 0.3, 0.5],
    "edge": [0.005, 0.02],
    "time_step_fraction": [0.225, 0.45],
    "actuation": ["clamp", "expand_and_contract"],
}


def turned(nominal: np.ndarray, real: np.ndarray) -> tuple[float, float, int]:
    """Return the share turned by more than 90 degrees, the median share of distance, and n."""
    before, after = (np.hypot(*one[:, :2].T) for one in (nominal, real))
    moves = (before > LITTLE) & (after > LITTLE)
    if not moves.any():
        return float("nan"), float(np.nanmedian(after / before)), 0
    along = (nominal[:, :2] * real[:, :2]).sum(axis=1)[moves]
    return float((along < 0).mean()), float(np.median(after / before)), int(moves.sum())


def main() -> None:
    """Print all numbers."""
    top = ranked(value(landscape()))[:TOP]
    nominal = simulate(top, PUBLISHED).displacement
    print(f"one parameter changed, the simulator's best {TOP}: turned, distance, moving")
    for name, values in SCAN.items():
        for changed in values:
            try:
                physics = replace(PUBLISHED, **{name: changed}).lasting(15)
            except ValueError as error:
                print(f"  {name} {changed}: {error}")
                continue
            share, far, n = turned(nominal, np.nan_to_num(simulate(top, physics).displacement))
            print(f"  {name:20} {changed!s:>8}  {share:6.1%}  {far:5.2f}  {n:3}")
    print("Coulomb pairs (static/kinetic), with the nominal pump, and at strain 0.5 and 2 Hz:")
    for base in (PUBLISHED, replace(PUBLISHED, strain=0.5, frequency_hz=2.0).lasting(15)):
        for static in (0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0):
            for share_of in (0.025, 0.25, 0.5, 1.0):
                physics = replace(base, friction_static=static, friction_kinetic=share_of * static)
                share, far, n = turned(nominal, np.nan_to_num(simulate(top, physics).displacement))
                pump = f"{base.strain:.2f} {base.frequency_hz:.0f} Hz"
                kinetic = share_of * static
                print(f"  {pump}  {static:4}/{kinetic:<6.3g}  {share:6.1%}  {far:5.2f}  {n:3}")
    area = reality("area_friction")
    print("area friction over 90 cycles against 23:")
    slow, fast = landscape(area.nominal), area.landscape()
    for design in (6453, 6013, 2117, 6489, 6481, 1385):
        a, b = (np.array([table["dx"][design], table["dy"][design]]) for table in (slow, fast))
        cosine = a @ b / (np.hypot(*a) * np.hypot(*b))
        print(f"  {design}: {np.hypot(*b) / np.hypot(*a):.2f} times as far, cosine {cosine:.2f}")
    for ratio, friction in ((0.3, 0.0), (0.7, 0.0), (0.5, 0.05)):
        physics = replace(PUBLISHED, friction_static=friction, friction_kinetic=friction / 2)
        other = Reality("x", physics.sheared(ratio).lasting(90), nominal=area.nominal)
        share = row(other)["turned_100"]
        print(f"  T* {ratio}, friction {friction}/{friction / 2}: {share:.0%} of {TOP} turned")
    print("the step: designs that change by more than 0.1 and 1 voxel widths, top kept, median")
    steps = [
        replace(PUBLISHED, time_step_fraction=PUBLISHED.time_step_fraction / n) for n in (1, 2, 4)
    ]
    fitness = [value(landscape(step)) for step in steps]
    for coarse, fine in ((0, 1), (1, 2)):
        off = np.abs(fitness[coarse] - fitness[fine])
        kept = len(np.intersect1d(*(ranked(fitness[n])[:TOP] for n in (coarse, fine))))
        print(
            f"  1/{2**coarse} against 1/{2**fine}: {(off > 0.1).sum()}, {(off > 1).sum()}, "
            f"{kept}, {np.median(off):.4f}"
        )
    print(f"resolution, the simulator's best {TOP}: turned, distance, tau over them, SRCC")
    stack = stack_of(top)
    for expansion, strain in (
        ("uniform", float(PUBLISHED.strain)),
        ("spherical", 0.72),
        ("spherical", 1.0),
        ("spherical", 2.0),
        ("spherical", 3.84),
    ):
        physics = replace(PUBLISHED, strain=strain, edge=float(PUBLISHED.edge) / 3)
        fine = simulate(refined(stack, 3, expansion=expansion), physics).displacement / 3
        share, far, n = turned(nominal, np.nan_to_num(fine))
        worth = [np.hypot(*np.nan_to_num(one)[:, :2].T) for one in (nominal, fine)]
        print(
            f"  {expansion:9} {strain:5.3f}  {share:6.1%} of {n}  {far:5.2f}  "
            f"{kendall_tau(*worth):.2f}  {srcc(*worth):.2f}"
        )


if __name__ == "__main__":
    main()
