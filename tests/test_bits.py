"""A design's result depends on the design and its parameters alone, to the last bit."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from softvox_gym import Physics, engine, simulate, verify
from softvox_gym.manifest import digest

PUBLISHED = Physics.published()
ALL = np.arange(6561)

ISAS = engine.isa_names()


def assert_same_bits(result, expected, where=slice(None)):
    """Compare all that two results hold, NaN equal to NaN, zeros by their sign."""
    assert list(result.diverged) == list(expected.diverged[where])
    for name in ("displacement", "start", "end", "track", "energy"):
        ours, theirs = getattr(result, name), getattr(expected, name)
        if ours is not None and theirs is not None:
            assert ours.tobytes() == theirs[where].tobytes(), name


@pytest.fixture(scope="module")
def landscape(published_result):
    return published_result


def test_the_landscape_has_its_golden_digest(landscape):
    assert digest(landscape.displacement) == verify.GOLDEN


def test_the_process_goes_on_to_compute_with_subnormal_numbers():
    # What a compiler's start-up code ends where -ffast-math reaches the linker.
    assert float("1e-310") * float("0.5") > 0


@pytest.mark.parametrize("isa", ISAS)
def test_every_instruction_set_gives_the_same_landscape(landscape, isa):
    designs = ALL[1::3]  # the last is the one that made the landscape
    assert_same_bits(simulate(designs, PUBLISHED, track=1, isa=isa), landscape, designs)


@pytest.mark.parametrize("isa", ISAS)
def test_measuring_the_pumps_work_changes_no_bit_and_has_the_same_on_all(landscape, isa):
    designs = ALL[1::60]
    result = simulate(designs, PUBLISHED, track=1, energy=True, isa=isa)
    assert result.energy is not None
    assert_same_bits(result, landscape, designs)
    assert simulate(designs[:1], PUBLISHED, isa=isa).energy is None


@pytest.mark.parametrize("isa", ISAS)
def test_mixed_blocks_give_the_same_bits_as_blocks_of_one_body_plan(landscape, isa):
    rng = np.random.default_rng(0)
    designs = rng.permutation(ALL)[:400]
    assert_same_bits(simulate(designs, PUBLISHED, track=1, isa=isa), landscape, designs)


def test_the_order_of_the_batch_does_not_matter(landscape):
    assert_same_bits(simulate(ALL[::-1], PUBLISHED, track=1), landscape, slice(None, None, -1))


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_the_number_of_threads_does_not_matter(landscape, threads):
    designs = ALL[::13]
    assert_same_bits(simulate(designs, PUBLISHED, track=1, threads=threads), landscape, designs)


@pytest.mark.parametrize("design", [1, 6453, 4295, 6560, 135, 21])
def test_a_design_alone_gives_the_bits_it_gives_in_a_crowd(landscape, design):
    assert_same_bits(simulate(design, PUBLISHED, track=1), landscape, [design])


def test_a_design_gives_the_same_bits_in_every_lane(landscape):
    for before in range(8):
        crowd = [6453 - 81 * i for i in range(before)] + [6453]
        assert_same_bits(simulate(crowd, PUBLISHED, track=1, threads=1), landscape, np.array(crowd))


@pytest.mark.parametrize("isa", ISAS)
def test_parameters_of_ones_own_give_the_bits_they_give_alone(isa):
    rng = np.random.default_rng(1)
    n = 12
    designs = rng.integers(1, 6561, n)
    crowd = replace(
        PUBLISHED,
        youngs_modulus=1e7 * rng.uniform(0.5, 1.5, n),
        poisson_ratio=rng.uniform(0.2, 0.45, n),
        density=1e6 * rng.uniform(0.5, 1.5, n),
        friction_static=rng.uniform(0.8, 1.5, n),
        friction_kinetic=rng.uniform(0.3, 0.8, n),
        shear_strength=rng.uniform(0, 2000, n),
        gravity=rng.normal([0, 0, -9.81], 0.3, (n, 3)),
        damping_link=rng.uniform(0.5, 1.0, n),
        damping_ground=rng.uniform(0.5, 1.0, n),
        damping_global=rng.uniform(0.005, 0.02, n),
        frequency_hz=rng.uniform(3, 5, n),
        strain=rng.uniform(0.1, 0.3, n),
        duration=rng.uniform(1.5, 2.0, n),
        time_step_fraction=rng.uniform(0.5, 0.9, n),
    )
    together = simulate(designs, crowd, track=2, energy=True, isa=isa)
    assert not together.diverged.any()
    for i in range(n):
        mine = {
            name: value[i] if isinstance(value, list) else value
            for name, value in crowd.to_dict().items()
        }
        alone = simulate(designs[i], Physics(**mine), track=2, energy=True, isa=isa)
        assert alone.energy.tobytes() == together.energy[i : i + 1].tobytes()
        assert alone.displacement.tobytes() == together.displacement[i : i + 1].tobytes()
        assert alone.steps[0] == together.steps[i]
        samples = alone.track.shape[1]
        assert alone.track[0].tobytes() == together.track[i, :samples].tobytes()
        assert np.isnan(together.track[i, samples:]).all()


@pytest.mark.parametrize("isa", ISAS)
def test_larger_lattices_give_the_same_bits_on_every_instruction_set(isa):
    rng = np.random.default_rng(2)
    designs = rng.integers(0, 3, (6, 3, 4, 3))
    physics = replace(PUBLISHED, duration=0.6)
    phase = rng.uniform(0, 1, designs.shape)
    strain = rng.uniform(0.1, 0.3, (6, 2, 3, 4, 3))
    run = partial(simulate, designs, physics, phase=phase, strain=strain, track=3, energy=True)
    assert_same_bits(run(isa=isa), run(isa="portable"))


@pytest.mark.parametrize("isa", ISAS)
def test_a_diverging_neighbour_leaves_no_trace(landscape, isa):
    designs = np.full(16, 6560)
    designs[8:] = [6453, 4295, 5757, 6255, 7, 1, 135, 2117]
    strain = np.full((16, 2, 2, 2), PUBLISHED.strain)
    strain[::2] = 1e3
    strain[4] = np.nan
    strain[6, 0, 0, 0] = np.inf
    result = simulate(designs, PUBLISHED, strain=strain, track=1, isa=isa)
    torn = result.diverged
    assert torn[[0, 2, 4, 6]].all()
    assert np.isnan(result.displacement[torn]).all()
    assert np.isnan(result.fitness[torn]).all()
    assert not torn[1::2].any()
    for i in range(1, 16, 2):
        assert result.displacement[i].tobytes() == landscape.displacement[designs[i]].tobytes()


def test_the_instruction_set_is_an_argument_or_else_a_variable_or_else_the_widest(monkeypatch):
    monkeypatch.delenv(engine.ISA_VARIABLE, raising=False)
    assert engine.isa_name() == ISAS[-1]
    monkeypatch.setenv(engine.ISA_VARIABLE, "portable")
    assert engine.isa_name() == "portable"
    assert engine.isa_name(ISAS[-1]) == ISAS[-1]


def test_an_unknown_instruction_set_is_refused_by_name(monkeypatch):
    with pytest.raises(ValueError, match=r"isa='sse' .* portable"):
        simulate(1, isa="sse")
    monkeypatch.setenv(engine.ISA_VARIABLE, "mmx")
    with pytest.raises(ValueError, match=r"SOFTVOX_ISA=mmx .* portable"):
        simulate(1)
    assert len(simulate(1, isa="portable")) == 1
