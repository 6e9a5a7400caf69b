"""The engine for browsers: built from these sources, and to the native bits."""

from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
import wasm
from chromium import MISSING
from node import answer, needs_node

from softvox_gym import Physics, engine, simulation
from softvox_gym.physics import ACTUATIONS
from softvox_gym.realities import realities

PUBLISHED = Physics.published()
SHORT = replace(PUBLISHED, duration=1.0)

SCRIPT = """const as = (type, values) => values && type.from(values);
return given.map(({ shared, digits, strain, phase, ...more }) =>
  engine.simulateOn(wasm, {
    ...more,
    shared: as(Float64Array, shared),
    digits: as(Uint8Array, digits),
    strain: as(Float64Array, strain),
    phase: as(Float64Array, phase),
  }));"""


def test_what_ships_was_built_from_these_sources():
    assert wasm.DIGESTS.read_text("utf-8") == wasm.digests(), "build it anew: make wasm"


@pytest.mark.skipif(find_spec("ziglang") is None, reason="needs softvox-gym[wasm]")
def test_a_build_gives_the_same_file(tmp_path):
    wasm.compiled(tmp_path / "engine.wasm")
    assert (tmp_path / "engine.wasm").read_bytes() == wasm.ENGINE.read_bytes()


def given(batch):
    """Return a batch of one physics as the page gives it."""
    row = batch.parameters[0]
    assert (batch.parameters == row).all()
    parameters = np.concatenate([np.ravel(row[name]) for name in engine.PARAMETERS.names])
    return {
        "shared": [batch.edge, batch.pumped_rest, batch.settle_time, *parameters.tolist()],
        "actuation": ACTUATIONS.index(batch.actuation),
        "shape": list(batch.shape),
        "digits": batch.digits.ravel().tolist(),
        "strain": batch.strain.ravel().tolist(),
        "phase": None if batch.phase is None else batch.phase.ravel().tolist(),
        "track": batch.track_per_cycle,
        "frames": batch.frame_every,
    }


def bits(numbers):
    """Return all bits, but for those of a NaN, which differ between processors."""
    return np.where(np.isnan(numbers), np.nan, numbers).tobytes()


def assert_native_bits(folder, runs):
    """Compare runs, each the arguments of `simulate`, with what the engine for browsers gives."""
    batches = [simulation.prepared(*arguments, **options)[2] for arguments, options in runs]
    told = answer(folder, SCRIPT, [given(batch) for batch in batches])
    assert len(told) == len(runs)
    for batch, ours in zip(batches, told, strict=True):
        native = engine.run(batch)
        facts = np.column_stack([native.status, native.steps, native.start, native.end])
        assert bits(ours["facts"]) == bits(facts)
        assert (ours["samples"], ours["count"]) == (batch.track_samples, batch.frame_count)
        assert bits(ours["track"]) == bits(native.track)
        assert bits(ours["frames"]) == bits(native.frames)
        assert np.isfinite(native.end).any()


@needs_node
def test_the_module_asks_its_host_for_nothing_and_has_memory_that_grows(tmp_path):
    script = """const module = await WebAssembly.compile(readFileSync("engine.wasm"));
    const before = wasm.memory.buffer.byteLength;
    wasm.take(10_000_000);
    return [WebAssembly.Module.imports(module), wasm.memory.buffer.byteLength - before];"""
    imports, grown = answer(tmp_path, script, None)
    assert imports == []
    assert grown >= 10_000_000


@needs_node
def test_the_published_landscape_has_the_native_bits(tmp_path):
    # Where there is a browser, test_explore_browser.py computes all of it.
    designs = np.arange(0, 6561, 1 if MISSING else 60)
    assert_native_bits(tmp_path, [((designs, None, None, None), {})])


@needs_node
def test_every_parameter_and_plain_reality_gives_the_native_bits(tmp_path):
    designs = np.random.default_rng(0).choice(6561, 100, replace=False)
    changes = [
        {"edge": 0.013},
        {"youngs_modulus": 3e6},
        {"poisson_ratio": 0.2},
        {"density": 4e5},
        {"friction_static": 0.6},
        {"friction_kinetic": 0.0},
        {"shear_strength": 20e3},
        {"gravity": -1.62},
        {"gravity": [1.0, -0.5, -9.0]},
        {"damping_link": 0.7},
        {"damping_ground": 0.3},
        {"damping_global": 0.02},
        {"frequency_hz": 7.0},
        {"strain": 0.45},
        *({"actuation": mode} for mode in ACTUATIONS),
        {"settle_time": 0.1},
        {"time_step_fraction": 0.5},
        {"single_precision_rest": False},
    ]
    assert {name for change in changes for name in change} | {"duration"} == set(vars(PUBLISHED))
    physics = [replace(SHORT, **change) for change in changes]
    physics += [replace(SHORT, strain=1e300, frequency_hz=12.0)]  # actuated, they diverge
    physics += [replace(one.physics, duration=1.0) for one in realities().values() if one.is_plain]
    assert_native_bits(tmp_path, [((designs, one, None, None), {}) for one in physics])


@needs_node
def test_strain_and_phase_of_every_voxel_tracks_and_frames_have_the_native_bits(tmp_path):
    rng = np.random.default_rng(1)
    small, large = rng.integers(0, 3, (40, 2, 2, 2)), rng.integers(0, 3, (3, 3, 4, 3))
    runs = []
    for stack in (small, large):
        strain, phase = rng.uniform(0, 0.4, stack.shape), rng.uniform(0, 1, stack.shape)
        runs.append(((stack, SHORT, strain, phase), {"track": 3, "frames": 40}))
    runs.append((([6453, 4295], None, None, None), {"track": 1, "frames": 11}))
    assert_native_bits(tmp_path, runs)


@needs_node
def test_what_would_not_fit_is_refused_and_leaves_the_engine_as_it_was(tmp_path):
    script = """const run = (frames) => engine.simulateOn(wasm, { ...given, frames,
      shared: Float64Array.from(given.shared), digits: Uint8Array.from(given.digits),
      strain: Float64Array.from(given.strain) });
    const before = run(0).facts;
    let said;
    try { run(1); } catch (error) { said = error.message; }
    return [before, said, run(0).facts];"""
    batch = simulation.prepared(np.arange(6000), replace(SHORT, duration=0.3), None, None)[2]
    before, said, after = answer(tmp_path, script, given(batch))
    assert "too large a result" in said
    assert bits(before) == bits(after)
