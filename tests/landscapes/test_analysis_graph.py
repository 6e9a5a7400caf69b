import numpy as np
import pytest

from softvox_gym import Design
from softvox_gym.landscapes.analysis import neighbours, symmetry_classes
from softvox_gym.landscapes.analysis.graph import components, distance_to, with_digit
from softvox_gym.landscapes.analysis.summary import checked_fitness
from softvox_gym.landscapes.analysis.symmetry import (
    NAMES,
    SPREADS,
    broken,
    image,
    members,
    symmetries,
    symmetry,
)

RNG = np.random.default_rng


def test_the_neighbours_of_a_design_are_the_sixteen_that_differ_at_one_site():
    for number in (0, 6560, 6453, 1234):
        own = Design(number).digits
        found = [Design(int(other)).digits for other in neighbours()[number]]
        changed = [
            own[:site] + digit + own[site + 1 :]
            for site in range(8)
            for digit in "012"
            if digit != own[site]
        ]
        assert found == changed


def test_being_neighbours_is_mutual_and_no_design_is_its_own_neighbour():
    around = neighbours()
    pairs = {(i, int(j)) for i in range(6561) for j in around[i]}
    assert len(pairs) == 6561 * 16
    assert pairs == {(j, i) for i, j in pairs}
    assert all(i != j for i, j in pairs)


def test_what_is_shared_can_not_be_written_to():
    for shared in (neighbours(), symmetry_classes()):
        with pytest.raises(ValueError, match="read-only"):
            shared[0] = 1


def test_a_site_given_a_digit_is_that_design():
    absent = with_digit(0)
    assert absent[Design("21012012").index].tolist() == [
        Design(text).index
        for text in (
            "01012012",
            "20012012",
            "21012012",
            "21002012",
            "21010012",
            "21012012",
            "21012002",
            "21012010",
        )
    ]


def test_the_number_of_designs_at_each_distance_is_binomial():
    counts = np.bincount(distance_to(6453))
    assert counts.tolist() == [1, 16, 112, 448, 1120, 1792, 1792, 1024, 256]
    assert distance_to([6453, 4295])[[6453, 4295]].tolist() == [0, 0]
    assert distance_to([0, 6560]).max() == 8  # all passive
    assert np.array_equal(distance_to([0, 6560]), np.minimum(distance_to(0), distance_to(6560)))
    digits = [Design(number).digits for number in (6453, 77)]
    assert distance_to(6453)[77] == sum(a != b for a, b in zip(*digits, strict=True))


def test_the_pieces_of_the_graph_are_those_that_a_plain_search_finds():
    kept = RNG(1).random(6561) < 0.12
    joined = kept[:, None] & kept[neighbours()]
    label = components(joined)
    seen = np.full(6561, -1)
    for start in range(6561):
        if seen[start] >= 0:
            continue
        seen[start], waiting = start, [start]
        while waiting:
            here = waiting.pop()
            for there, edge in zip(neighbours()[here], joined[here], strict=True):
                if edge and seen[there] < 0:
                    seen[there] = start
                    waiting.append(int(there))
    assert np.array_equal(label, seen)
    assert 1 < len(np.unique(label)) < 6561


@pytest.mark.parametrize("reflections", [False, True])
def test_the_classes_are_those_of_the_designs_canonical_form(reflections):
    found = symmetry_classes(reflections=reflections)
    assert found.tolist() == [
        Design(number).canonical(reflections=reflections).index for number in range(6561)
    ]


def test_there_are_as_many_classes_as_burnsides_lemma_counts():
    for reflections, expected in ((False, 1665), (True, 1035)):
        fixed = 0
        for order in symmetries(reflections=reflections):
            cycles, left = 0, set(range(8))
            while left:
                site = min(left)
                cycles += 1
                while site in left:
                    left.remove(site)
                    site = int(order[site])
            fixed += 3**cycles
        assert fixed / len(symmetries(reflections=reflections)) == expected
        assert len(np.unique(symmetry_classes(reflections=reflections))) == expected


def test_the_symmetries_are_named_for_what_they_do():
    images = dict(zip(NAMES, (image(order) for order in symmetries()), strict=True))
    for number in (6453, 4305, 123):
        design = Design(number)
        swapped = Design(np.swapaxes(design.array, 0, 1))
        expected = {
            "none": design,
            "quarter turn to the left": design.rotated(1),
            "half turn": design.rotated(2),
            "quarter turn to the right": design.rotated(3),
            "mirror across x": design.mirrored(),
            "mirror that swaps x and y": swapped,
            "mirror across y": Design(design.array[:, ::-1]),
            "mirror that swaps x and -y": swapped.rotated(2),
        }
        assert {name: int(image[number]) for name, image in images.items()} == {
            name: other.index for name, other in expected.items()
        }


def test_a_fitness_that_is_the_same_for_all_of_a_class_has_no_spread():
    values = RNG(2).random(6561)[symmetry_classes()]
    found = symmetry(values).records()[1]
    assert found["sizes"] == {1: 9, 2: 36, 4: 360, 8: 630}
    assert [found[f"above_{limit:g}"] for limit in SPREADS] == [0, 0, 0, 0]
    assert found["largest_spread"] == found["within"] == 0
    assert {row["largest"] for row in broken(values).records()} == {0}


def test_one_design_that_travels_otherwise_is_found_in_its_class():
    values = RNG(2).random(6561)[symmetry_classes()]
    turned = Design(6453).rotated().index
    values[turned] += 0.5
    found = symmetry(values).records()[1]
    assert found["largest_in"] == symmetry_classes()[6453]
    assert found["largest_spread"] == pytest.approx(0.5)
    assert [found[f"above_{limit:g}"] for limit in SPREADS] == [1, 1, 1, 0]
    # A half turn takes the design that moved to one that did not, and that one to it.
    half = broken(values).records()[1]
    assert [half[f"above_{limit:g}"] for limit in SPREADS] == [2, 2, 2, 0]
    size = (symmetry_classes() == symmetry_classes()[6453]).sum()
    # One of `size` equal values moved by h has squared deviations h^2 (1 - 1 / size).
    assert found["within"] * values.var() * 6561 == pytest.approx(0.25 * (1 - 1 / size))


def test_the_members_are_the_classes():
    classes = members(symmetry_classes())
    assert [int(group[0]) for group in classes] == np.unique(symmetry_classes()).tolist()
    for group in classes:
        assert len(set(symmetry_classes()[group])) == 1
    assert sorted(np.concatenate(classes).tolist()) == list(range(6561))


def test_the_mean_within_classes_agrees_with_the_analysis_of_variance():
    values = RNG(3).random(6561)
    classes = symmetry_classes(reflections=False)
    sums = np.bincount(classes, weights=values)
    counts = np.bincount(classes)
    means = sums[classes] / counts[classes]
    found = symmetry(values).records()[0]
    assert found["within"] == pytest.approx(((values - means) ** 2).mean() / values.var())


def test_a_design_that_diverged_counts_as_zero():
    values = np.ones(6561)
    values[7] = np.nan
    assert checked_fitness(values)[7] == 0
    assert np.isnan(values[7])  # the caller's array is left as it was


@pytest.mark.parametrize(
    ("fitness", "error", "message"),
    [
        (np.zeros(6560), ValueError, r"shape \(6561,\).*got \(6560,\)"),
        (np.zeros((6561, 1)), ValueError, r"got \(6561, 1\)"),
        (np.full(6561, np.inf), ValueError, "design 0 has inf; mark .* with NaN"),
        (np.full(6561, "1.0"), TypeError, "real numbers"),
        (np.zeros(6561, dtype=complex), TypeError, "real numbers, got complex128"),
        (None, TypeError, "real numbers"),
    ],
)
def test_what_is_no_fitness_is_refused(fitness, error, message):
    with pytest.raises(error, match=message):
        checked_fitness(fitness)
