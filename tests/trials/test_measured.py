"""What trials show is a reality: of the designs measured; of all others nobody knows anything."""

import doctest
import pickle
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from pseudo_trials import NINE, trials_in

from softvox_gym import Design, Physics, Reality, evaluate, landscape, reality
from softvox_gym.calibration import calibrate, known_of, tracks_of
from softvox_gym.cli.trials import FILTERS, cycles
from softvox_gym.landscapes.gap import row
from softvox_gym.noise import Jakobi
from softvox_gym.trials import Trial, measured
from softvox_gym.trials.trial import Condition

TRIALS = trials_in("reversal", NINE)


def line(design, *, end=30.0, x=1.5, **facts):
    """Return a trial that goes straight along x, cm: made up, nobody measured or simulated it."""
    told = {"surface": "acrylic", "who": "A. Person", "license": "CC0-1.0", "date": "2026-11-27"}
    return Trial(design=design, cycle=[0, end], position=[[0, 0], [x, 0]], **told | facts)


@pytest.fixture(scope="module")
def real():
    return Reality.from_trials(TRIALS)


def test_it_has_what_the_trials_show_in_voxel_widths(real):
    truth = reality("reversal").simulate(NINE).displacement
    assert np.abs(real.displacement[list(NINE), :2] - truth[:, :2]).max() < 1e-3
    assert real.displacement.shape == (6561, 3)
    assert not real.displacement[list(NINE), 2].any()
    assert real.designs.tolist() == sorted(NINE)
    assert np.flatnonzero(real.testable).tolist() == sorted(NINE)
    assert np.isnan(real.displacement).any(axis=1).tolist() == (~real.testable).tolist()
    assert (real.spread[573], np.isnan(real.spread).sum()) == (0, 6561 - len(NINE))
    assert real.about == "9 runs of 9 designs, after 15 cycles on acrylic, simulated in reversal"
    assert real.source == "softvox-gym"


def test_repetitions_are_averaged_over_the_cycles_of_the_shortest_run():
    runs = [line(17, x=3.0), line(17, x=4.5, end=45.0, repetition=2), line(40, x=1.0, voxel_cm=1.0)]
    made = Reality.from_trials(runs)
    assert made.cycles == 30
    assert made.displacement[17] == pytest.approx([2, 0, 0])  # 4.5 cm in 45 cycles are 3 in 30
    assert made.displacement[40] == pytest.approx([1, 0, 0])
    made = Reality.from_trials([runs[0], line(17, x=6.0, repetition=2)], cycles=15)
    assert made.displacement[17] == pytest.approx([1.5, 0, 0])
    assert made.spread[17] == pytest.approx(0.5)
    assert made.about == "2 runs of 1 design, after 15 cycles on acrylic, measured"
    powdered = Reality.from_trials([line(17, powder="talc")])
    assert powdered.about == "1 run of 1 design, after 30 cycles on acrylic with talc, measured"
    assert [track.cycle.tolist() for track in made.tracks] == [[0, 15], [0, 15]]
    assert made.mean_track(17, 4).shape == (61, 3)
    assert made.mean_track(17, 4)[[0, 20, -1], 0] == pytest.approx([0, 0.5, 1.5])
    assert Reality.from_trials(runs[:1], cycles=1.1).mean_track(17, 4)[:, 0] * 15 == pytest.approx(
        [0, 0.25, 0.5, 0.75, 1, 1.1]
    )


def test_tracks_are_those_of_a_robot_of_the_simulators_size(real):
    wide = Reality.from_trials(TRIALS, nominal={"edge": 0.02})
    ours, theirs = real.tracks[0], wide.tracks[0]
    assert (ours.design, ours.trial) == (573, real.measured[0].digest[:12])
    assert ours.position == pytest.approx(real.measured[0].position)
    assert theirs.position == pytest.approx(2 * ours.position)
    (of_the_kit,) = Reality.from_trials([line(17, x=3.0)], cycles=15).tracks
    assert of_the_kit.position.tolist() == [[0, 0], [1, 0]]
    assert [len(one.cycle) for one in real.tracks] == [len(one.cycle) for one in real.measured]


def test_it_is_a_value_that_says_what_results_depend_on(real):
    again = Reality.from_trials(TRIALS[::-1])
    assert (again, hash(again)) == (real, hash(real))
    assert pickle.loads(pickle.dumps(real)) == real
    assert real != Reality.from_trials(TRIALS, cycles=14)
    with pytest.raises(ValueError, match="9 of 9 runs end before 16 cycles"):
        replace(real, cycles=16)
    assert replace(real, cycles=9).about.startswith(
        "9 runs of 9 designs, after 9 cycles laid over 15 "
    )


def test_the_simulator_lasts_as_many_cycles_as_the_robots_unless_it_is_said(real):
    assert real.nominal == Physics.published()
    assert float(Reality.from_trials([line(17)]).nominal.cycles) == pytest.approx(30)
    slow = Reality.from_trials(TRIALS, cycles=(15, 23))
    assert (float(slow.nominal.cycles), slow.cycles) == (pytest.approx(23), 15)
    assert slow != real
    assert "after 15 cycles laid over 23 simulated ones on acrylic" in slow.about
    assert (slow.displacement[17:] == real.displacement[17:])[slow.testable[17:]].all()
    assert slow.tracks[0].cycle == pytest.approx(real.tracks[0].cycle * 23 / 15)
    assert slow.mean_track(6453, 4).shape == (93, 3)
    assert slow.against(Physics.of("exact")).simulated_cycles == pytest.approx(23)


def test_what_results_depend_on_is_the_trials_and_the_cycles(real):
    told = real.to_dict()
    assert (len(told["trials"]), told["cycles"]) == (9, 15)
    assert set(told["trials"]) == {trial.digest for trial in TRIALS}


@pytest.mark.parametrize(
    "use",
    [
        lambda real: real.simulate([17, 6453]),
        lambda real: evaluate([17], real),
        lambda real: evaluate([17], real, perturbations=[Jakobi(1.0)], trials=2, seed=0),
        lambda real: tracks_of(real, [17]),
        lambda real: real.mean_track(17, 4),
        lambda real: real.check_measured(17),
    ],
)
def test_what_nobody_measured_is_refused_by_name(real, use):
    with pytest.raises(ValueError, match=r"design 17 was not measured .* are 573, 1385"):
        use(real)


@pytest.mark.parametrize(
    "use",
    [
        lambda real: real.simulate([6453]),
        lambda real: evaluate([6453], real),
        lambda real: evaluate(["2" * 27], real, shape=(3, 3, 3)),
        lambda real: evaluate([6453], real, perturbations=[Jakobi(1.0)], trials=2, seed=0),
        lambda real: gym.make("SoftVox-v0", reality=real),
        lambda real: gym.make_vec("SoftVoxGrow2x2x2-v0", num_envs=2, reality=real),
        lambda real: gym.make("SoftVoxControl-v0", design=6453, reality=real),
        lambda real: real.run(np.ones((1, 2, 2, 2), np.uint8), None),
        lambda real: real.simulate([]),
        lambda real: landscape(real),
        lambda real: landscape(real, phases=2),
        lambda real: real.landscape(),
        row,
    ],
)
def test_what_was_measured_is_not_simulated_either(real, use):
    with pytest.raises(ValueError, match="reality trials was measured and can't be simulated"):
        use(real)


def test_trials_that_are_no_reality_are_refused_by_name():
    def refused(trials, words, kind=ValueError, **options):
        with pytest.raises(kind, match=words):
            Reality.from_trials(trials, **options)

    one = line(17)
    refused([], "there are no trials")
    for wrong in ([17], one, "trials"):
        refused(wrong, "trials must be a list of softvox_gym.trials.Trial", TypeError)
    refused([one, line(40, surface="carpet")], "differ in surface: 1 with acrylic, 1 with carpet")
    refused(
        [one, line(40, pressure_kpa=6.0)], "differ in pressure_kpa: 1 with none given, 1 with 6"
    )
    refused([one, line(40, frequency_hz=2.0)], "differ in frequency_hz: .*, as --hz does")
    refused([one, line(40, powder="talc")], "differ in powder: .*, as --powder does")
    refused([one, *trials_in("reversal", [40])], "in source: 1 with measured, 1 with simulated")
    refused([*trials_in("soft", [17]), *trials_in("reversal", [40])], "differ in reality: 1 with s")
    options = {measured.OPTIONS.get(name, name).replace("-", "_") for name in Condition._fields}
    assert options <= {*FILTERS}
    early = rf"1 of 1 runs end before 31 cycles: design 17 \({one.digest[:12]}\) after 30"
    refused([one], early, cycles=31)
    refused([one], "cycles must be a number above 0", cycles=0)
    refused([line(17, end=1001.0)], "cycles must be above 0 and at most 1000, got 1001")
    refused([one], "cycles must be a number", cycles="all")
    large = line(Design("2" * 27, shape=(3, 3, 3)))
    refused([one, large], rf"the lattice 2x2x2, but 1 of 2 runs have others: .*{large.digest[:12]}")


def test_calibration_knows_the_frequency_and_looks_after_the_realitys_cycles(real):
    assert known_of(real) == {}
    pumped = Reality.from_trials(trials_in("reversal", [6453], frequency_hz=2.0), cycles=10)
    assert known_of(pumped) == {"frequency_hz": 2.0}
    for edge in (0.01, 0.015):
        made = calibrate(pumped, {"shear": [0.5]}, {"edge": edge, "preset": "published"})
        assert made.cycles.tolist() == [10]
        assert made.real == pytest.approx(pumped.displacement[[6453], :2])


def test_the_examples_do_what_they_show():
    tests = [test for test in doctest.DocTestFinder().find(measured) if test.examples]
    assert [doctest.DocTestRunner().run(test).failed for test in tests] == [0]


def test_cycles_are_read_as_one_number_or_two():
    assert (cycles("23"), cycles("90:23")) == ((23, 23), (90, 23))
