"""What to build and test next, by what was measured."""

import numpy as np
import pytest
from cheap_models import cheap_models  # noqa: F401, a fixture

from softvox_gym import Design, Physics, Reality, Task, landscape, reality
from softvox_gym.build import plan
from softvox_gym.landscapes.table import displacements
from softvox_gym.trials import Trial
from softvox_search.transfer import Simulator, Test, make
from softvox_search.transfer.next import proposals

NINE = [6453, 6013, 2117, 6489, 6481, 1385, 6330, 4690, 573]
EEA = {"size": 6, "ensemble": 4}

pytestmark = pytest.mark.usefixtures("cheap_models")


def measured(designs, where="reversal"):
    """Return what would be known if these designs had been measured in a pseudo-reality."""
    ends = displacements(landscape(reality(where)))[designs, :2]
    trials = [
        Trial(
            design=design,
            cycle=[0, 15],
            position=[[0, 0], end],
            surface="acrylic",
            source="simulated",
            reality=where,
            who="softvox-gym",
            license="CC0-1.0",
            voxel_cm=1.0,
        )
        for design, end in zip(designs, ends.tolist(), strict=True)
    ]
    return Reality.from_trials(trials)


def robot(number):
    """Return what is built, whichever way round it stands."""
    design = Design(number)
    empty = not design.array[..., 0].any()
    lowered = Design(np.roll(design.array, -1, axis=2)) if empty else design
    return lowered.canonical()


@pytest.mark.parametrize(("method", "options"), [("ite", {}), ("eea", EEA)], ids=["ite", "eea"])
def test_what_is_proposed_is_new_can_be_built_and_is_each_time_another_robot(method, options):
    # A turned and a mirrored one, and one that stands a slice higher.
    known = [6453, Design(6489).rotated().index, Design(2117).mirrored().index, 81 * 5]
    made = proposals(measured(known), method=method, budget=40, **options)
    robots = {robot(one.design) for one in made}
    assert len(made) == len(robots) == 40
    assert not robots & {robot(number) for number in known}
    designs = [Design(one.design) for one in made]
    assert all(design.n_active for design in designs)
    assert [plan(design).problems for design in designs] == [()] * 40
    again = proposals(measured(known[::-1]), method=method, budget=40, **options)
    for name in ("design", "reward", "spread", "simulated", "why"):
        assert [getattr(one, name) for one in again] == [getattr(one, name) for one in made]


def test_what_the_kit_cannot_build_is_proposed_on_request():
    made = proposals(method="ite", budget=5, buildable_only=False)
    table = landscape()
    best = np.argsort(-table["fitness"], kind="stable")
    assert made[0].design == best[0] == 6453
    alone = proposals(method="eea", budget=100, buildable_only=False, choice="random", **EEA)
    assert not all(Design(one.design).is_connected for one in alone)
    assert all(Design(one.design).n_active for one in alone)


def test_by_expected_gain_the_largest_bound_is_first_and_the_next_as_if_it_were_known():
    task, world = Task("directed", 90.0), measured(NINE)
    made = proposals(world, method="ite", budget=4, task="directed", heading=90)
    by_hand = make("ite", Simulator(Physics.published()), task, np.random.default_rng(0)).method
    for number in sorted(NINE):
        moved = world.displacement[number]
        by_hand.tell(Test(number, float(task.reward(moved)), moved))
    before, deviation = by_hand.predict().copy(), by_hand.deviation()
    taken = {robot(number) for number in NINE}
    for one in made:
        bound = by_hand.predict() + 0.05 * by_hand.deviation()
        for number in np.argsort(-bound.round(9), kind="stable").tolist():
            design = Design(number)
            if design.is_connected and design.n_active and robot(number) not in taken:
                break
        assert one.design == number
        assert one.reward == pytest.approx(before[number], abs=1e-12)
        assert one.spread == pytest.approx(deviation[number], abs=1e-12)
        assert one.simulated == pytest.approx(landscape()["dy"][number], abs=1e-12)
        taken.add(robot(number))
        by_hand.tell(Test(number, before[number], np.zeros(3)))
    # All nine turned round, so that what is expected up the y axis is simulated down it.
    assert all(one.simulated < 0 < one.reward for one in made)


def test_by_disagreement_the_models_that_fit_differ_most():
    world = measured(NINE)
    made = proposals(world, method="eea", choice="disagreement", budget=1, **EEA)[0]
    by_hand = make("eea", Simulator(Physics.published()), Task(), np.random.default_rng(0), **EEA)
    models = by_hand.models()
    misfit = np.square((models - world.displacement)[:, NINE, :2]).sum(axis=(1, 2))
    kept = models[np.argsort(misfit)[:4], made.design]
    assert made.spread == pytest.approx(np.sqrt(kept[:, :2].var(axis=0).sum()))
    least, most = np.hypot(*kept[:, :2].T).min(), np.hypot(*kept[:, :2].T).max()
    assert made.why == f"models that fit what was measured expect {least:.1f} to {most:.1f}"
    assert least <= made.reward <= most
    assert made.displacement.shape == (3,)
    spread = np.sqrt(models[np.argsort(misfit)[:4], :, :2].var(axis=0).sum(axis=-1))
    larger = np.flatnonzero(spread > made.spread)
    can_be_built = [Design(n) for n in larger.tolist() if Design(n).is_connected]
    assert {robot(one.index) for one in can_be_built if one.n_active} <= set(map(robot, NINE))


def test_where_nothing_was_measured_the_prior_chooses_and_says_so():
    first = proposals(method="ite")[0]
    assert (first.design, first.why) == (6453, "the simulator's choice")
    assert first.reward == first.simulated == pytest.approx(landscape()["fitness"][6453])
    seen = []
    options = {"progress": lambda *told: seen.append(told), **EEA}
    made = proposals(method="eea", budget=1, **options)
    assert made[0].why.startswith("models of the prior expect")
    assert seen == [(i, 6) for i in range(6)]


def test_gain_is_told_over_the_best_measured():
    world = measured(NINE)
    best = np.hypot(*world.displacement[NINE, :2].T).max()
    for one in proposals(world, method="ite"):
        gain = one.reward - best
        told = f"{abs(gain):.1f} {'more' if gain >= 0 else 'less'} than the best measured"
        assert one.why == told


def test_a_method_that_ends_proposes_no_more():
    assert proposals(measured(NINE), method="ite", stop=0.5) == ()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "gp_ucb"}, "method must be one of eea, ite, got 'gp_ucb'"),
        ({"method": "ite", "budget": 0}, "budget must be at least 1 and at most 100, got 0"),
        ({"method": "ite", "heading": 90}, "the task displacement has no heading"),
        ({"method": "ite", "size": 8}, "size"),
        ({"reality": "soft"}, "reality must be one that Reality.from_trials makes, got 'soft'"),
        ({"method": "ite", "kernel": "ham"}, "kernel must be hamming or behaviour"),
    ],
)
def test_what_can_not_be_asked_for_is_refused_by_name(options, message):
    with pytest.raises((TypeError, ValueError), match=message):
        proposals(**options)
