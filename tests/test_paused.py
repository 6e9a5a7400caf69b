"""A simulation that pauses gives the bits of one that does not."""

import copy
import pickle
import signal
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from softvox_gym import Physics, Simulation, engine, simulate
from softvox_gym.paused import MAGIC

DESIGNS = [6453, 4295, 0, 1, 6560, 135, 21]
SHORT = Physics.published().lasting(3.5)


def whole(designs=DESIGNS, physics=SHORT, **options):
    return simulate(designs, physics, **options).displacement.tobytes()


def to_the_end(sim):
    sim.advance(until=np.inf)
    return sim.displacement.tobytes()


def test_run_to_the_end_it_is_simulate():
    sim = Simulation(DESIGNS, SHORT)
    assert to_the_end(sim) == whole()
    assert sim.ended.all()
    assert not sim.diverged.any()
    assert list(sim.fitness) == list(simulate(DESIGNS, SHORT).fitness)


@pytest.mark.parametrize("isa", engine.isa_names())
def test_steps_of_any_number_give_the_bits_of_one_run(isa):
    rng = np.random.default_rng(0)
    sim = Simulation(DESIGNS, SHORT, isa=isa)
    while not sim.ended.all():
        sim.advance(steps=int(rng.integers(0, 300)))
    assert sim.displacement.tobytes() == whole()


def test_cycles_and_times_give_the_bits_of_one_run_and_do_not_drift():
    sim = Simulation(DESIGNS, SHORT)
    step = SHORT.time_step
    for cycle in range(1, 4):
        sim.advance(cycles=1)
        late = sim.state.time[0] - (SHORT.settle_time + cycle / SHORT.frequency_hz)
        assert 0 < late <= step * (1 + 1e-9)
    sim.advance(until=1.03)
    assert 1.03 < sim.state.time[0] <= 1.03 + step
    before = sim.state.time[0]
    sim.advance(cycles=0.25)  # from here: elsewhere than the cycles before
    assert 0 < sim.state.time[0] - (before + 0.25 / SHORT.frequency_hz) <= step * (1 + 1e-9)
    assert to_the_end(sim) == whole()


def test_each_design_keeps_its_own_pace():
    physics = replace(
        SHORT,
        frequency_hz=np.linspace(3, 6, 7),
        youngs_modulus=np.linspace(0.5e7, 1.5e7, 7),
        duration=np.linspace(1.0, 1.3, 7),
    )
    sim = Simulation(DESIGNS, physics)
    sim.advance(cycles=2)
    there = np.array(DESIGNS) > 0
    late = sim.state.time - (physics.settle_time + 2 / physics.frequency_hz)
    assert (late[there] > 0).all()
    assert (late[there] <= physics.time_step[there]).all()
    assert to_the_end(sim) == whole(physics=physics)


def test_phases_strain_by_cycle_and_large_lattices_pause_too():
    rng = np.random.default_rng(1)
    designs = rng.integers(0, 3, (3, 4, 3, 4))
    options = {
        "strain": rng.uniform(0.1, 0.4, (3, 3, 4, 3, 4)),
        "phase": rng.uniform(0, 1, designs.shape),
    }
    sim = Simulation(designs, SHORT, **options)
    for _ in range(3):
        sim.advance(cycles=1)
        sim = copy.deepcopy(sim)
    assert to_the_end(sim) == whole(designs, **options)


def test_strain_given_piece_by_piece_is_strain_by_cycle():
    rng = np.random.default_rng(2)
    strain = rng.uniform(0, 0.4, (7, 3, 2, 2, 2))
    physics = Physics.exact().lasting(3)
    sim = Simulation(DESIGNS, physics)
    sim.advance(until=physics.settle_time)
    for cycle in range(3):
        sim.advance(cycles=1, strain=strain[:, cycle])
    sim.advance(until=np.inf)
    # A cycle's strain counts from the first step in it, as a piece ends with the first past it.
    assert sim.displacement.tobytes() == whole(physics=physics, strain=strain)


def test_strain_stays_until_it_is_changed_and_phase_is_from_now_on():
    rest = np.zeros((7, 2, 2, 2))
    sim = Simulation(DESIGNS, SHORT, strain=rest)
    assert to_the_end(sim) == whole(strain=rest)
    phase = np.full((7, 2, 2, 2), 0.25)
    sim = Simulation(DESIGNS, SHORT)
    sim.advance(steps=0, phase=phase)
    assert to_the_end(sim) == whole(phase=phase)
    sim = Simulation(DESIGNS, SHORT)
    sim.advance(cycles=1)
    sim.advance(until=np.inf, strain=rest)
    assert sim.displacement.tobytes() not in (whole(), whole(strain=rest))


def test_the_state_is_what_frames_show():
    sim = Simulation(DESIGNS, SHORT)
    sim.advance(steps=700)
    state, frames = sim.state, simulate(DESIGNS, SHORT, frames=700).frames
    there = np.array(DESIGNS) > 0
    assert state.position[there].tobytes() == frames.position[there, 1].tobytes()
    assert state.orientation[there].tobytes() == frames.quaternion[there, 1].tobytes()
    assert state.edge[there].tobytes() == frames.edge[there, 1].tobytes()
    assert list(state.step[there]) == [700] * 6
    voxels = frames.position[0, 1].reshape(-1, 3)
    np.testing.assert_allclose(state.centre[0], np.nanmean(voxels, axis=0), rtol=1e-14)


def test_what_control_asks_for():
    sim = Simulation([6560, 1], SHORT)
    sim.advance(cycles=1)
    state = sim.state
    assert state.on_floor[0, :, :, 0].any()
    assert not state.on_floor[0, :, :, 1].any()
    assert not state.on_floor[1, 1].any()
    np.testing.assert_allclose(state.relative_position[0].sum(axis=(0, 1, 2)), 0, atol=1e-15)
    np.testing.assert_allclose(state.relative_velocity[0].sum(axis=(0, 1, 2)), 0, atol=1e-14)
    earlier = state.position[0]
    sim.advance(steps=1)
    after = sim.state
    moved = earlier + after.velocity[0] * SHORT.time_step
    np.testing.assert_allclose(after.position[0], moved, rtol=0, atol=1e-16)
    assert np.isfinite(after.spin[0]).all()


def test_displacement_is_unknown_while_settling_and_zero_for_the_empty_design():
    sim = Simulation([6453, 0], SHORT)
    assert np.isnan(sim.displacement[0]).all()
    assert not sim.displacement[1].any()
    sim.advance(cycles=1)
    assert np.isfinite(sim.displacement).all()
    assert list(sim.ended) == [False, True]


def test_saved_and_restored_it_goes_on_on_any_instruction_set():
    expected = whole()
    for source in engine.isa_names():
        for target in engine.isa_names():
            sim = Simulation(DESIGNS, SHORT, isa=source)
            sim.advance(steps=900)
            again = Simulation.restore(sim.save(), isa=target)
            assert again.save() == sim.save()
            assert to_the_end(again) == expected


def test_a_pickle_goes_on_and_one_that_ended_stays():
    sim = Simulation(DESIGNS, SHORT, threads=1)
    sim.advance(cycles=1)
    twin = pickle.loads(pickle.dumps(sim))
    assert to_the_end(twin) == whole()
    assert to_the_end(pickle.loads(pickle.dumps(twin))) == whole()
    sim.advance(cycles=1)  # the twin's running did not move it
    assert not sim.ended[0]


def test_a_diverged_design_is_told_from_the_others_and_leaves_no_trace():
    strain = np.full((7, 2, 2, 2), SHORT.strain)
    strain[0] = 1e3
    strain[4] = np.nan
    expected = simulate(DESIGNS, SHORT, strain=strain)
    assert list(np.flatnonzero(expected.diverged)) == [0, 4]
    sim = Simulation(DESIGNS, SHORT, strain=strain)
    sim.advance(until=0.99 * SHORT.duration)
    assert list(sim.diverged) == list(expected.diverged)
    assert np.isnan(sim.displacement[[0, 4]]).all()
    twin = Simulation.restore(sim.save())
    assert list(twin.diverged) == list(expected.diverged)
    assert to_the_end(twin) == expected.displacement.tobytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "exactly one of cycles, steps and until"),
        ({"cycles": 1, "steps": 2}, "exactly one of cycles, steps and until"),
        ({"steps": -1}, "steps must be at least 0"),
        ({"steps": 1.5}, "steps must be a whole number"),
        ({"cycles": -1}, "cycles must not be negative"),
        ({"cycles": "two"}, "cycles must be a number"),
        ({"until": float("nan")}, "until must not be negative"),
        ({"steps": 1, "strain": np.zeros(3)}, "strain must have shape"),
        ({"steps": 1, "strain": np.zeros((1, 4, 2, 2, 2))}, r"shape \(1, 2, 2, 2\) for these"),
        ({"steps": 1, "phase": np.full((1, 2, 2, 2), 1e16)}, "phase must be finite and below"),
        ({"steps": 1, "phase": np.full((1, 2, 2, 2), np.nan)}, "phase must be finite and below"),
        ({"until": 10**400}, "until must be a number within the range of a float"),
        ({"steps": 1, "phase": np.zeros((2, 2, 2))}, "phase must have shape"),
    ],
)
def test_what_does_not_fit_is_refused_and_nothing_has_moved(options, message):
    sim = Simulation(6453, SHORT)
    with pytest.raises((TypeError, ValueError), match=message):
        sim.advance(**options)
    assert sim.state.step[0] == 0


def test_what_is_no_saved_simulation_is_refused():
    sim = Simulation(6453, SHORT)
    saved = sim.save()
    for bad, message in (
        (b"PK something else", "not a saved simulation"),
        (MAGIC.replace(b"1", b"9") + saved[len(MAGIC) :], "another format"),
        (saved[:-1], "damaged"),
        (saved[:100] + bytes([saved[100] ^ 1]) + saved[101:], "damaged"),
    ):
        with pytest.raises(ValueError, match=message):
            Simulation.restore(bad)
    with pytest.raises(TypeError, match="must be bytes"):
        Simulation.restore("text")


def test_a_simulation_of_another_engine_is_refused(monkeypatch):
    saved = Simulation(6453, SHORT).save()
    monkeypatch.setattr("softvox_gym.paused.engine_probe", lambda: "another")
    with pytest.raises(ValueError, match="saved by another engine"):
        Simulation.restore(saved)


LARGE = np.ones((1, 12, 12, 12), dtype=np.uint8)


def interrupted(sim):
    """Interrupt a piece on the way, as Ctrl-C does, which a background job ignores."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.1, signal.raise_signal, [signal.SIGINT])
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            sim.advance(until=np.inf)
        timer.join()
    finally:
        signal.signal(signal.SIGINT, before)


def test_interrupted_it_stands_still_and_goes_on_to_the_same_bits():
    physics = Physics.published().lasting(8)
    sim = Simulation(LARGE, physics, threads=1)
    interrupted(sim)
    step = sim.state.step[0]
    assert 0 < step < 4000
    time.sleep(0.1)
    assert sim.state.step[0] == step
    assert to_the_end(sim) == whole(LARGE, physics)


@pytest.mark.parametrize("isa", engine.isa_names())
def test_designs_that_stand_at_different_steps_are_restored_on_any_instruction_set(isa):
    """As an interrupt leaves them: some blocks have run their piece, others have not."""
    sim = Simulation(DESIGNS, SHORT, isa=engine.isa_names()[-1])
    sim.advance(steps=500)
    behind = Simulation(DESIGNS, SHORT)
    behind.advance(steps=300)
    mixed = {
        name: np.concatenate([sim._run.state(name)[name][:3], behind._run.state(name)[name][3:]])
        for name in engine.STATE
    }
    batch = sim._batch
    resumed = np.nan_to_num(mixed["clock"][:, 1], nan=-1).astype(np.int32)
    again = engine.PausedRun(engine.Batch(**{**vars(batch), "resumed": resumed}), isa=isa)
    again.output.start[:] = sim._run.output.start
    again.resume(mixed)
    again.advance(None, 10_000)
    end = simulate(DESIGNS, SHORT).end
    there = np.array(DESIGNS) > 0
    assert (again.output.end[there] / SHORT.edge).tobytes() == end[there].tobytes()


def test_who_runs_was_decided_at_the_start():
    strain = np.full((7, 2, 2, 2), SHORT.strain)
    first = strain.copy()
    first[[0, 4]] = np.nan
    sim = Simulation(DESIGNS, SHORT, strain=first)
    sim.advance(steps=100, strain=strain)
    twin = Simulation.restore(sim.save())
    twin.advance(cycles=0.1)
    sim.advance(cycles=0.1)
    assert np.array_equal(twin.state.time, sim.state.time, equal_nan=True)
    assert to_the_end(twin) == to_the_end(sim)
    assert list(np.flatnonzero(twin.diverged)) == [0, 4]
    later = Simulation(DESIGNS, SHORT)
    later.advance(steps=100)
    later.advance(steps=0, strain=first)
    twin = Simulation.restore(later.save())
    assert to_the_end(twin) == to_the_end(later)
    assert list(np.flatnonzero(twin.diverged)) == [0, 4]


def test_two_threads_may_ask_for_pieces():
    sim = Simulation(DESIGNS * 30, SHORT, threads=2)
    askers = [threading.Thread(target=sim.advance, kwargs={"steps": 200}) for _ in range(4)]
    for asker in askers:
        asker.start()
    for asker in askers:
        asker.join()
    assert set(sim.state.step[np.array(DESIGNS * 30) > 0]) == {800}


def test_a_state_of_another_shape_is_refused():
    run = Simulation(6453, SHORT)._run
    state = run.state(*engine.STATE)
    state["voxel"] = state["voxel"][:, :3].copy()
    with pytest.raises(ValueError, match="the engine expects"):
        run.resume(state)


def test_some_taken_go_on_to_the_bit_and_leave_the_others_alone():
    sim = Simulation(DESIGNS, SHORT)
    sim.advance(cycles=1)
    some = sim.take([4, 0, 0])
    assert some.designs.tolist() == sim.designs[[4, 0, 0]].tolist()
    assert to_the_end(some) == whole([6560, 6453, 6453])
    assert to_the_end(sim) == whole()
    again = sim.take(range(7))
    assert again.ended.all()
    assert again.displacement.tobytes() == whole()


def test_what_is_taken_keeps_its_own_physics_and_actuation():
    n = len(DESIGNS)
    physics = replace(SHORT, gravity=-np.linspace(5, 10, n), frequency_hz=np.linspace(4, 5, n))
    strain = np.full((n, 2, 2, 2), 0.1)
    sim = Simulation(DESIGNS, physics)
    sim.advance(cycles=0.5, strain=strain)
    some = sim.take([5, 0, 4])  # three numbers of gravity, and no vector
    for each in (sim, some):
        each.advance(cycles=0.7)
        each.advance(until=np.inf)
    assert some.displacement.tobytes() == sim.displacement[[5, 0, 4]].tobytes()
    assert (some.fitness[1:] > 0).all()


def test_what_is_not_there_cannot_be_taken():
    sim = Simulation(DESIGNS, SHORT)
    with pytest.raises(IndexError):
        sim.take([7])


@pytest.mark.parametrize("which", [[True] * len(DESIGNS), [0.7], 0, [[0, 1]], "0", slice(1)])
def test_only_a_row_of_indices_takes(which):
    with pytest.raises(TypeError, match="which"):
        Simulation(DESIGNS, SHORT).take(which)


def test_the_designs_cannot_be_written_to():
    with pytest.raises(ValueError, match="read-only"):
        Simulation([6453]).designs[0] = 1
