"""Designs a lane each, or one body across the lanes: the same laws, and the same bits."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from softvox_gym import Physics, engine, simulate, verify
from softvox_gym.manifest import digest
from softvox_gym.simulation import prepared

ISAS = engine.isa_names()
FUZZ = Path(__file__).parents[1] / "tools" / "fuzz.py"


def run(designs, seating, *, isa=None, physics=None, **options):
    batch = prepared(designs, physics, None, options.pop("phase", None), **options)[2]
    return engine.run(replace(batch, energy=True), isa=isa, seating=seating)


@pytest.fixture(scope="module")
def landscape():
    output = run(np.arange(6561), "all_apart")
    moved = (output.end - output.start) / Physics.published().edge
    moved[0] = 0  # the empty design is not simulated
    assert digest(moved) == verify.GOLDEN
    return output


@pytest.mark.parametrize("isa", ISAS)
def test_a_body_across_the_lanes_gives_the_bits_of_the_landscape(landscape, isa):
    sample = np.arange(5, 6561, 9)
    output = run(sample, "all_across", isa=isa)
    assert output.end.tobytes() == landscape.end[sample].tobytes()
    assert output.start.tobytes() == landscape.start[sample].tobytes()
    assert output.energy.tobytes() == landscape.energy[sample].tobytes()


@pytest.mark.parametrize("seed", [0, 300])
def test_random_batches_give_the_same_bits_however_they_are_seated(seed):
    done = subprocess.run(
        [sys.executable, FUZZ, "--count", "100", "--seed", str(seed)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "100 batches" in done.stdout


@pytest.mark.parametrize("isa", ISAS)
def test_ten_voxels_a_side_give_the_same_bits_however_they_are_seated(isa):
    rng = np.random.default_rng(4)
    designs = rng.choice([0, 1, 2], size=(2, 10, 10, 10), p=[0.3, 0.3, 0.4])
    physics = Physics(settle_time=0.0, duration=0.06)
    phase = rng.uniform(0, 1, designs.shape)
    apart, across = (
        run(designs, seating, isa=isa, physics=physics, phase=phase, frames=40)
        for seating in ("all_apart", "all_across")
    )
    assert apart.frames.tobytes() == across.frames.tobytes()
    assert apart.energy.tobytes() == across.energy.tobytes()
    assert (apart.energy > 0).all()
    assert not apart.status.any()


def crowd(frame, sites, edge):
    """Return how many pairs per voxel are near in space and far by links, of one frame."""
    away = np.linalg.norm(frame[:, np.newaxis, :3] - frame[np.newaxis, :, :3], axis=-1)
    links = np.abs(sites[:, np.newaxis] - sites[np.newaxis]).sum(axis=-1)
    return np.count_nonzero((away < 2 * edge) & (links > 3)) / 2 / len(frame)


@pytest.mark.parametrize("isa", ISAS)
def test_a_crushed_body_has_more_pairs_than_there_is_room_for_at_once(isa):
    rng = np.random.default_rng(0)
    designs = np.where(rng.random((1, 4, 4, 12)) < 0.7, rng.integers(1, 3, (1, 4, 4, 12)), 0)
    physics = Physics(gravity=-3000.0, settle_time=0.0, duration=0.3)
    apart, across = (
        run(designs, seating, isa=isa, physics=physics, frames=20)
        for seating in ("all_apart", "all_across")
    )
    assert apart.frames.tobytes() == across.frames.tobytes()
    there = designs[0].T.ravel() > 0
    sites = np.stack(np.unravel_index(np.flatnonzero(there), designs[0].T.shape), axis=1)
    assert max(crowd(frame[there], sites, physics.edge) for frame in across.frames[0]) > 8


def test_three_voxels_on_a_large_lattice_need_little_memory():
    designs = np.zeros((1, 40, 40, 40), dtype=np.uint8)
    designs[0, :3, 0, 0] = 2
    small = simulate(designs[:, :3, :1, :1], Physics(duration=0.5))
    assert simulate(designs, Physics(duration=0.5)).end.tobytes() == small.end.tobytes()


@pytest.mark.parametrize("isa", ISAS)
@pytest.mark.parametrize("phase", [None, np.zeros((1, 40, 40, 40))])
def test_a_robot_of_64000_voxels_takes_less_than_a_kilobyte_of_memory_each(phase, isa):
    batch = prepared(np.ones((1, 40, 40, 40), dtype=np.uint8), None, None, phase)[2]
    assert engine.workspace_bytes(batch, isa=isa) < 1000 * 40**3
