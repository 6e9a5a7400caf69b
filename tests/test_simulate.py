"""simulate() takes what it says, refuses the rest by name, and can be interrupted."""

import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from softvox_gym import Design, Physics, engine, simulate

PUBLISHED = Physics.published()
SHORT = replace(PUBLISHED, duration=1.0)


def test_all_ways_of_naming_a_design_give_one_result():
    ways = [
        6453,
        "00021222",
        Design(6453),
        [6453],
        ["00021222"],
        [Design(6453)],
        [[0, 0, 0, 2, 1, 2, 2, 2]],
        np.array([6453]),
        np.array([[0, 0, 0, 2, 1, 2, 2, 2]], dtype=np.int8),
        Design(6453).array[np.newaxis],
    ]
    bits = {simulate(way, SHORT).displacement.tobytes() for way in ways}
    assert len(bits) == 1


def test_a_batch_may_mix_ways_of_naming():
    result = simulate([7, "00021222", Design(21), [1] * 8], SHORT)
    assert [result.design(i).index for i in range(4)] == [7, 6453, 21, 3280]


class Tensor:
    """An array of another library: NumPy can make one of it, and its items are no numbers."""

    def __init__(self, values):
        self.values = np.array(values)

    def __array__(self, dtype=None, copy=None):
        return self.values if dtype is None else self.values.astype(dtype)

    def __iter__(self):
        return (Tensor(value) for value in self.values)


def test_anything_that_numpy_makes_an_array_of_is_a_batch():
    expected = simulate([6453, 1], SHORT).displacement.tobytes()
    assert simulate(Tensor([6453, 1]), SHORT).displacement.tobytes() == expected
    rows = Tensor([[0, 0, 0, 2, 1, 2, 2, 2], [1, 0, 0, 0, 0, 0, 0, 0]])
    assert simulate(rows, SHORT).displacement.tobytes() == expected
    assert Design(Tensor(6453)) == Design(6453)
    with pytest.raises(ValueError, match="may be the digits"):
        simulate(Tensor([0, 0, 0, 2, 1, 2, 2, 2]), SHORT)


def test_eight_design_numbers_that_cant_be_digits_are_a_batch():
    assert len(simulate([0, 1, 2, 3, 0, 1, 2, 0], SHORT)) == 8
    assert len(simulate([Design(i) for i in (0, 1, 2, 0, 1, 2, 0, 1)], SHORT)) == 8


def test_a_generator_of_designs_is_a_batch():
    assert len(simulate((i for i in (1, 2, 3)), SHORT)) == 3


@pytest.mark.parametrize(
    "none", [[], np.zeros((0, 8), int), np.zeros((0, 3, 3, 3), int), np.array([])]
)
def test_no_designs_give_an_empty_result(none):
    result = simulate(none, SHORT, track=1, frames=10)
    assert len(result) == 0
    assert result.fitness.shape == (0,)
    assert result.displacement.shape == (0, 3)
    assert result.track.shape == (0, 4, 3)
    assert result.frames.position.shape[0] == 0


def test_the_empty_design_goes_nowhere():
    result = simulate([0, 1], SHORT, track=1)
    assert result.fitness[0] == 0.0
    assert not result.diverged[0]
    assert not result.displacement[0].any()
    assert not result.track[0].any()


@pytest.mark.parametrize(
    ("designs", "error", "message"),
    [
        (6561, ValueError, "outside 0 ... 6560"),
        (-1, ValueError, "outside 0 ... 6560"),
        ([1, 6561], ValueError, "outside 0 ... 6560"),
        (np.array([-1]), ValueError, "outside 0 ... 6560"),
        (10**30, ValueError, "outside 0 ... 6560"),
        ("00031222", ValueError, "digits 0, 1 and 2 only"),
        ("0002122", ValueError, "7 digits, but a 2x2x2 lattice has 8"),
        ("", ValueError, "0 digits"),
        (np.full((1, 8), 3), ValueError, "digits 0, 1 and 2 only, got 3"),
        (np.full((1, 8), -1), ValueError, "digits 0, 1 and 2 only, got -1"),
        (np.full((1, 8), 258), ValueError, "digits 0, 1 and 2 only, got 258"),
        (np.zeros((1, 7), int), ValueError, r"\(n, 8\)"),
        (np.zeros((1, 2, 2), int), ValueError, r"got shape \(1, 2, 2\)"),
        (np.zeros((1, 0, 2, 2), int), ValueError, "positive sides"),
        (6453.0, TypeError, "a design or a batch of designs"),
        (6453.5, TypeError, "a design or a batch of designs"),
        (np.array([1.5]), TypeError, "whole numbers"),
        (np.zeros((1, 8)), TypeError, "whole numbers"),
        ([True, False], TypeError, "whole numbers"),
        ([None], TypeError, "whole numbers"),
        ([[0, 1], [0, 1, 2]], ValueError, "8 sites"),
        ([Design(1), Design("1", shape=(1, 1, 1))], ValueError, "one lattice"),
        (None, TypeError, "a design or a batch of designs"),
        (b"00021222", TypeError, "whole numbers, got bytes"),
        (bytearray(b"00021222"), TypeError, "whole numbers, got bytearray"),
        ([0, 0, 0, 2, 1, 2, 2, 2], ValueError, r"give Design\(row\) or \[row\] for one design"),
        (np.array([0, 0, 0, 2, 1, 2, 2, 2]), ValueError, "may be the digits of one design or 8"),
        ((2,) * 8, ValueError, "or 8 design numbers"),
    ],
)
def test_what_is_no_design_is_refused(designs, error, message):
    with pytest.raises(error, match=message):
        simulate(designs, SHORT)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"strain": np.zeros((2, 2, 2))}, ValueError, "strain must have shape"),
        ({"strain": np.zeros((3, 2, 2, 2))}, ValueError, "strain must have shape"),
        ({"strain": np.zeros((2, 0, 2, 2, 2))}, ValueError, "strain must have shape"),
        ({"strain": np.zeros((2, 3, 2, 2, 3))}, ValueError, "strain must have shape"),
        ({"strain": 0.2}, ValueError, "strain must have shape"),
        ({"strain": np.full((2, 2, 2, 2), "a")}, TypeError, "strain must be an array of numbers"),
        ({"strain": np.full((2, 2, 2, 2), -2.0)}, ValueError, "shrink to nothing"),
        ({"phase": np.zeros((2, 1, 2, 2, 2))}, ValueError, "phase must have shape"),
        ({"phase": np.zeros((2, 2, 2, 2), complex)}, TypeError, "phase must be an array"),
        ({"phase": [[1], [1, 2]]}, ValueError, "phase must be an array of numbers"),
        ({"track": -1}, ValueError, "track must be at least 0"),
        ({"track": 1.0}, TypeError, "track must be a whole number"),
        ({"frames": -1}, ValueError, "frames must be at least 0"),
        ({"frames": True}, TypeError, "frames must be a whole number"),
        ({"track": 2**40}, ValueError, "track must be at least 0 and at most 2147483647"),
        ({"track": 2**31 - 1}, ValueError, "track=2147483647 needs .* samples"),
        ({"frames": 10**12}, ValueError, "frames must be at least 0 and at most 2147483647"),
        ({"energy": "no"}, TypeError, "energy must be True or False"),
        ({"check_step": 1}, TypeError, "check_step must be True or False"),
        ({"progress": 5}, TypeError, "progress must be a callable"),
        ({"threads": 0}, ValueError, "threads must be at least 1"),
        ({"threads": 1.5}, TypeError, "threads must be a whole number"),
        ({"physics": "published"}, TypeError, "physics must be a Physics"),
        ({"physics": Physics(density=[1e6] * 3)}, ValueError, "arrays for 3 designs"),
    ],
)
def test_a_bad_option_is_refused_by_name(options, error, message):
    with pytest.raises(error, match=message):
        simulate([2186, 6560], **options)


def test_strides_and_byte_order_of_the_callers_arrays_do_not_matter():
    designs = np.array([[2, 1, 2, 0, 1, 2, 0, 1], [1, 2, 2, 2, 0, 1, 1, 2]])
    strain = np.random.default_rng(0).uniform(0.1, 0.3, (2, 2, 2, 2))
    phase = np.random.default_rng(1).uniform(0, 1, (2, 2, 2, 2))
    expected = simulate(designs, SHORT, strain=strain, phase=phase)
    wide = np.repeat(designs, 2, axis=1)[:, ::2].astype(">i4")
    other = simulate(
        wide,
        SHORT,
        strain=np.asfortranarray(strain).astype(">f8"),
        phase=np.repeat(phase, 3, axis=0)[::3],
    )
    assert other.displacement.tobytes() == expected.displacement.tobytes()


def test_the_callers_arrays_are_left_alone():
    designs, strain = np.array([6453, 7]), np.full((2, 2, 2, 2), 0.2)
    before = designs.copy(), strain.copy()
    simulate(designs, SHORT, strain=strain)
    np.testing.assert_array_equal(designs, before[0])
    np.testing.assert_array_equal(strain, before[1])


def test_a_strain_per_voxel_that_is_everywhere_the_default_changes_nothing():
    designs = [6453, 2117, 5]
    expected = simulate(designs, PUBLISHED).displacement.tobytes()
    for shape in ((3, 2, 2, 2), (3, 1, 2, 2, 2), (3, 15, 2, 2, 2), (3, 40, 2, 2, 2)):
        strain = np.full(shape, PUBLISHED.strain)
        assert simulate(designs, PUBLISHED, strain=strain).displacement.tobytes() == expected


def test_strain_of_passive_and_absent_voxels_is_ignored():
    design = Design(6453)
    strain = np.where(design.array == 2, PUBLISHED.strain, np.nan)[np.newaxis]
    phase = np.where(design.array == 2, 0.0, np.inf)[np.newaxis]
    result = simulate(design, PUBLISHED, strain=strain, phase=phase)
    assert result.displacement.tobytes() == simulate(design, PUBLISHED).displacement.tobytes()


def test_strain_by_cycle_acts_in_its_own_cycle():
    design, cycles = Design("22212202"), 15
    strain = np.full((1, cycles, 2, 2, 2), PUBLISHED.strain)
    changed = strain.copy()
    changed[:, 5] *= 0.5
    track, other = (
        simulate(design, PUBLISHED, strain=s, track=8).track[0] for s in (strain, changed)
    )
    before, after = np.arange(len(track)) <= 5 * 8, np.arange(len(track)) > 5 * 8
    np.testing.assert_array_equal(track[before], other[before])
    assert (track[after] != other[after]).any(axis=1).all()


def test_edges_follow_the_amplitude_of_their_cycle():
    strain = np.zeros((1, 15, 2, 2, 2))
    strain[0, :, 0, 0, 0] = np.linspace(0.1, 0.24, 15)
    frames = simulate(Design("20000000"), PUBLISHED, strain=strain, frames=1).frames
    edge = frames.edge[0, :, 0, 0, 0] / PUBLISHED.edge - 1
    turns = PUBLISHED.frequency_hz * frames.time[0] - 1
    for cycle in range(15):
        # The step nearest the peak is within a turn / 500 of it: 1 - cos(2 pi / 500) < 1e-4.
        peak = np.nanmax(edge[(turns > cycle + 0.1) & (turns < cycle + 0.4)])
        assert peak == pytest.approx(strain[0, cycle, 0, 0, 0], rel=1e-4)


def test_a_phase_of_a_whole_cycle_is_no_phase():
    designs = [6453, 2117]
    whole = np.ones((2, 2, 2, 2))
    expected = simulate(designs, SHORT).displacement
    # 2 pi (f t + 1) rounds differently from 2 pi f t.
    np.testing.assert_allclose(
        simulate(designs, SHORT, phase=whole).displacement, expected, rtol=0, atol=1e-6
    )


def test_phases_that_no_voxel_shares_differ_from_none():
    phase = np.zeros((1, 2, 2, 2))
    phase[0, 1] = 0.5
    assert simulate(6560, SHORT, phase=phase).fitness[0] != simulate(6560, SHORT).fitness[0]


@pytest.mark.parametrize(
    ("actuation", "lowest"), [("hold", 1.0), ("clamp", 1.0), ("expand_and_contract", 0.8)]
)
def test_the_actuation_decides_what_edges_do_in_the_negative_half_cycle(actuation, lowest):
    physics = Physics(strain=0.2, actuation=actuation)
    edge = simulate("20000000", physics, frames=1).frames.edge[0, :, 0, 0, 0] / physics.edge
    assert np.nanmin(edge) == pytest.approx(lowest, rel=1e-4)
    assert np.nanmax(edge) == pytest.approx(1.2, rel=1e-4)
    negative = edge[(np.arange(len(edge)) > 1400) & (np.arange(len(edge)) < 1600)]
    assert (np.unique(negative).size == 1) == (actuation != "expand_and_contract")


def test_the_track_runs_from_zero_to_the_displacement():
    result = simulate([6453, 2117, 21], PUBLISHED, track=4)
    assert result.track.shape == (3, 61, 3)
    assert not result.track[:, 0].any()
    np.testing.assert_array_equal(result.track[:, -1], result.displacement)
    np.testing.assert_allclose(result.end - result.start, result.displacement, atol=1e-12)


def test_a_slower_design_has_fewer_samples():
    physics = replace(PUBLISHED, frequency_hz=[4.0, 2.0])
    track = simulate([6453, 6453], physics, track=1).track
    assert track.shape == (2, 16, 3)
    assert np.isfinite(track[0]).all()
    assert np.isfinite(track[1, :8]).all()
    assert np.isnan(track[1, 8:]).all()


def test_frames_show_every_voxel_as_a_step_begins():
    frames = simulate(["00021222", "10000000"], PUBLISHED, frames=100).frames
    assert list(frames.step[:3]) == [0, 100, 200]
    assert frames.position.shape == (2, 89, 2, 2, 2, 3)
    assert frames.quaternion.shape == (2, 89, 2, 2, 2, 4)
    assert frames.edge.shape == (2, 89, 2, 2, 2)
    present = Design(6453).array > 0
    assert np.isnan(frames.position[0][:, ~present]).all()
    assert np.isfinite(frames.position[0][:, present]).all()
    np.testing.assert_allclose(frames.position[0, 0, 1, 1, 0], [0.015, 0.015, 0.005])
    norms = np.linalg.norm(frames.quaternion[0][:, present], axis=-1)
    np.testing.assert_allclose(norms, 1, rtol=1e-14)


def test_frames_do_not_disturb_the_run():
    plain = simulate([6453, 135], PUBLISHED)
    watched = simulate([6453, 135], PUBLISHED, frames=7, track=3)
    assert plain.displacement.tobytes() == watched.displacement.tobytes()


def test_a_phase_too_far_to_have_parts_of_a_turn_is_marked():
    phase = np.zeros((2, 2, 2, 2))
    phase[0] = 2.0**60
    assert list(simulate([6453, 6453], SHORT, phase=phase).diverged) == [True, False]


def test_a_travel_too_far_for_a_fitness_has_diverged():
    everyone = np.arange(6561)
    result = simulate(everyone, replace(SHORT, strain=1e300))
    assert {True, False} == set(result.diverged.tolist())
    assert np.array_equal(np.isfinite(result.fitness), ~result.diverged)
    assert np.array_equal(np.isfinite(result.displacement).all(axis=1), ~result.diverged)


def test_half_the_step_tells_how_far_a_fitness_can_be_trusted():
    phase = np.full((2, 2, 2, 2), 0.1)
    whole = simulate([6453, 135], SHORT, phase=phase, check_step=True)
    half = simulate(
        [6453, 135],
        replace(SHORT, time_step_fraction=SHORT.time_step_fraction / 2),
        phase=phase,
    )
    assert whole.step_error.tolist() == np.abs(half.fitness - whole.fitness).tolist()
    plain = simulate([6453, 135], SHORT, phase=phase)
    assert plain.step_error is None
    assert plain.displacement.tobytes() == whole.displacement.tobytes()
    lost = simulate([6560, 6560], replace(PUBLISHED, strain=[150.0, 0.2]), check_step=True)
    assert np.isnan(lost.step_error).tolist() == [True, False]


def test_results_of_diverged_designs_are_nan():
    result = simulate([6560, 6560], replace(PUBLISHED, strain=[150.0, 0.2]), track=1)
    assert list(result.diverged) == [True, False]
    for values in (result.fitness, result.displacement, result.start, result.end, result.track):
        assert np.isnan(values[0]).all()
        assert np.isfinite(values[1]).all()


@pytest.mark.parametrize(
    ("designs", "text"),
    [
        ([6453, 1], "Result(2 designs on 2x2x2, 0 diverged, best 4.66)"),
        ([], "Result(0 designs on 2x2x2, 0 diverged, best nan)"),
    ],
)
def test_a_result_says_in_a_line_what_it_is(designs, text):
    assert repr(simulate(designs, PUBLISHED)) == text


def test_progress_is_told_up_to_the_end():
    calls = []
    simulate(range(1, 400), SHORT, progress=lambda done, total: calls.append((done, total)))
    assert calls[-1] == (399, 399)
    assert [done for done, _ in calls] == sorted(done for done, _ in calls)


def test_an_interrupt_stops_the_workers_at_once():
    def interrupt(done, total):
        raise KeyboardInterrupt

    before = threading.active_count()
    with pytest.raises(KeyboardInterrupt):
        simulate(range(1, 6561), replace(PUBLISHED, duration=4000.0), progress=interrupt)
    assert threading.active_count() == before


@pytest.mark.parametrize("designs", [[], [0, 0]])
def test_progress_is_told_even_where_nothing_is_simulated(designs):
    calls = []
    simulate(designs, SHORT, progress=lambda *call: calls.append(call))
    assert calls[-1] == (len(designs), len(designs))


def test_threads_that_call_at_once_do_not_meet():
    expected = simulate(range(0, 6561, 50), SHORT).displacement.tobytes()
    with ThreadPoolExecutor(4) as pool:
        runs = [pool.submit(simulate, range(0, 6561, 50), SHORT) for _ in range(8)]
    assert {run.result().displacement.tobytes() for run in runs} == {expected}


def test_a_system_that_refuses_more_threads_gets_the_work_done_by_fewer(monkeypatch):
    expected = simulate(range(1, 100), SHORT).displacement.tobytes()
    start, started = threading.Thread.start, []

    def refuse_the_third(thread):
        if len(started) == 2:
            raise RuntimeError("can't start new thread")
        started.append(thread)
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", refuse_the_third)
    result = simulate(range(1, 100), SHORT, threads=9)
    assert len(started) == 2
    assert result.displacement.tobytes() == expected


def test_a_system_that_refuses_every_thread_is_an_error(monkeypatch):
    def refuse(thread):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", refuse)
    with pytest.raises(RuntimeError, match="refuses to start a single thread"):
        simulate(np.full(100, 6560), SHORT)
    assert len(simulate(1, SHORT)) == 1  # which needs no thread


def test_a_worker_without_memory_is_an_error(monkeypatch):
    memory = engine._memory

    def refuse_workers(size):
        if sys._getframe(1).f_code.co_name == "work":
            raise MemoryError
        return memory(size)

    monkeypatch.setattr(engine, "_memory", refuse_workers)
    for designs in (1, np.full(100, 6560)):
        with pytest.raises(MemoryError, match=r"a worker could not get its [1-9]\d* bytes"):
            simulate(designs, SHORT)


def test_results_are_compared_by_identity():
    result = simulate(1, SHORT)
    assert result == result
    assert result != simulate(1, SHORT)
    assert len({result}) == 1


def raw_batch(n):
    """Return a batch of n full passive bodies, as the binding wants it."""
    return engine.Batch(
        shape=(2, 2, 2),
        digits=np.ones((n, 8), np.uint8),
        parameters=np.zeros(n, engine.PARAMETERS),
        strain=np.zeros((n, 1, 8)),
        phase=None,
        edge=0.01,
        pumped_rest=0.01,
        settle_time=0.25,
        actuation="hold",
        track_per_cycle=0,
        track_samples=0,
        frame_every=0,
        frame_count=0,
    )


def test_the_binding_refuses_arrays_that_are_not_what_c_expects():
    batch = raw_batch(1)
    for bad in (
        {"strain": np.zeros((1, 1, 8), np.float32)},
        {"strain": np.zeros((1, 1, 7))},
        {"digits": np.ones((1, 16), np.uint8)[:, ::2]},
        {"phase": np.zeros((2, 8))},
        {"parameters": np.zeros(2, engine.PARAMETERS)},
    ):
        with pytest.raises(ValueError, match="the engine expects a C-contiguous"):
            engine.run(replace(batch, **bad))
    for bad in (
        {"edge": np.nan},
        {"pumped_rest": 0.0},
        {"settle_time": -1.0},
        {"track_samples": -1},
        {"shape": (0, 2, 4)},
    ):
        with pytest.raises(ValueError, match=r"edge|pumped_rest|settle_time|track|lattice"):
            engine.run(replace(batch, **bad))


def test_parameters_that_no_run_can_end_with_are_marked():
    batch = raw_batch(3)
    batch.parameters["density"] = [np.nan, 1e6, 1e6]
    batch.parameters["time_step"] = [1e-4, 0.0, 1e-300]
    batch.parameters["duration"] = 1.0
    assert list(engine.run(batch).status) == [1, 1, 1]
