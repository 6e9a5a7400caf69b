"""The engine agrees with a second, plain writing of the physics where no data was measured."""

import numpy as np
import oracle
import pytest

from softvox_gym import Physics, simulate, verify
from softvox_gym.physics import ACTUATIONS

SHAPES = [(2, 2, 2), (1, 2, 3), (3, 1, 2), (2, 3, 2)]


def random_case(seed):
    """A design with a tilted, sticky floor, odd materials, phases, and strain by cycle."""
    rng = np.random.default_rng(seed)
    digits = rng.choice([0, 1, 2, 2], SHAPES[seed % len(SHAPES)])
    digits.flat[0] = 2
    actuation = ACTUATIONS[seed % len(ACTUATIONS)]
    physics = Physics(
        edge=rng.choice([0.01, 0.004]),
        youngs_modulus=1e7 * rng.uniform(0.5, 2),
        poisson_ratio=rng.uniform(0, 0.45),
        density=1e6 * rng.uniform(0.5, 2),
        friction_static=rng.uniform(0.6, 1.2),
        friction_kinetic=rng.uniform(0.2, 0.6),
        shear_strength=rng.uniform(0, 3000),
        gravity=(*rng.uniform(-1, 1, 2), rng.uniform(-12, -6)),
        damping_link=rng.uniform(0.6, 1),
        damping_ground=rng.uniform(0.5, 1),
        damping_global=rng.uniform(0.005, 0.03),
        frequency_hz=rng.uniform(8, 20),
        actuation=actuation,
        settle_time=rng.uniform(0.02, 0.05),
        duration=0.2,
        single_precision_rest=bool(seed % 2),
    )
    strain = rng.uniform(0.1, 0.35, (rng.integers(1, 4), *digits.shape))
    phase = rng.uniform(-1, 2, digits.shape) * (seed % 5 > 0)
    return digits, physics, strain, phase


@pytest.mark.parametrize("seed", range(16))
def test_a_run_ends_where_the_plain_writing_ends(seed):
    digits, physics, strain, phase = random_case(seed)
    run = oracle.Run(digits, physics, strain, phase)
    expected = run.displacement()
    one = np.newaxis
    result = simulate(digits[one], physics, strain=strain[one], phase=phase[one], energy=True)
    assert np.linalg.norm(expected) > 1e-3
    # Two writings round differently, as two compilations do. Measured: 1.1e-9 at most.
    np.testing.assert_allclose(result.displacement[0], expected, rtol=0, atol=verify.TOLERANCE)
    assert run.energy > 1e-3
    # Measured: 4.1e-11 at most.
    assert result.energy[0] == pytest.approx(run.energy, rel=1e-9)
