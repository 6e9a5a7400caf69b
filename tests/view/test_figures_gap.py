from types import SimpleNamespace

import numpy as np
import pytest
from view.figure_labels import check_labels

from softvox_gym import landscape, realities, reality
from softvox_gym.landscapes import gap
from softvox_gym.real_tracks import LITTLE
from softvox_view.figures import Inputs, files_of, make, style
from softvox_view.figures.gap import walk
from softvox_view.figures.robots import best_of_bodies
from softvox_view.tessellation import cell_of

LAG = Inputs(realities=(reality("lag"),))
BOTH = Inputs(realities=(reality("lag"), reality("high_resolution")))


def panels(name, inputs=None):
    """The panels of a figure, by the name of the reality in their titles."""
    (figure,) = make(name, inputs).figures.values()
    return {axis.get_title(loc="left"): axis for axis in figure.axes}


def dots(axis):
    """Every design's place, and those of the simulator's best hundred."""
    drawn = [line.get_xydata().T for line in axis.lines if line.get_marker() == "o"]
    assert [points.shape for points in drawn] == [(2, 6561), (2, 100)]
    return drawn


def worth(name):
    one = reality(name)
    return np.stack([gap.value(table) for table in (landscape(one.nominal), one.landscape())])


def headings(name):
    one = reality(name)
    return np.stack(
        [
            np.degrees(np.arctan2(table["dy"], table["dx"]))
            for table in (landscape(one.nominal), one.landscape())
        ]
    )


def test_every_named_reality_has_a_panel_of_fitness_with_its_tau():
    shown = panels("gap")
    assert list(shown) == list(realities())
    for name, axis in shown.items():
        every, best = dots(axis)
        assert np.array_equal(every, worth(name))
        assert np.array_equal(best[0], np.sort(worth(name)[0])[::-1][:100])
        assert axis.get_title(loc="right") == f"τ = {gap.row(reality(name))['tau']:.2f}"


def test_headings_are_those_of_the_designs_that_travel_in_both_worlds():
    for name, axis in panels("gap_headings", BOTH).items():
        every, best = dots(axis)
        travels = (worth(name) > LITTLE).all(axis=0)
        assert np.array_equal(np.isfinite(every).all(axis=0), travels)
        assert np.array_equal(every[:, travels], headings(name)[:, travels])
        told = gap.row(reality(name))
        assert axis.get_title(loc="right") == f"{told['turned']:.0%} turned"
        # What is beyond 90 degrees lies on the shaded bands.
        off = np.abs(best[1] - best[0])
        turned = (off > 90) & (off < 270)
        assert turned[np.isfinite(off)].mean() == pytest.approx(told["turned_100"])


@pytest.mark.parametrize("name", ["area_friction", "high_resolution"])
def test_tracks_end_where_the_landscapes_say_and_the_angle_is_between_these(name):
    one = reality(name)
    inputs = Inputs() if name == "area_friction" else Inputs(realities=(one,))
    (figure,) = make("gap_tracks", inputs).figures.values()
    axes = [axis for axis in figure.axes if axis.get_title(loc="left")]
    for axis, design in zip(axes, best_of_bodies(), strict=True):
        assert axis.get_title(loc="left").endswith(f"  {design.index}")
        ends = [line.get_xydata()[-1] for line in axis.lines if len(line.get_xydata()) > 1]
        for end, table in zip(ends, (landscape(one.nominal), one.landscape()), strict=True):
            assert end == pytest.approx([table[axis][design.index] for axis in ("dx", "dy")])
        lengths = np.hypot(*np.transpose(ends))
        if min(lengths) < LITTLE:
            expected = "no heading"
        else:
            expected = f"{np.degrees(np.arccos(np.dot(*ends) / lengths.prod())):.0f}°"
        assert axis.get_title(loc="right") == expected
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    cycles = {"area_friction": (23, 90), "high_resolution": (15, 15)}[name]
    assert names[:2] == [f"simulator, {cycles[0]} cycles", f"{name}, {cycles[1]} cycles"]


def test_a_design_that_diverged_stays_at_its_start():
    track = np.full((2, 5, 3), np.nan)
    track[0] = 1.0
    track[1, 0] = 0.0
    world = SimpleNamespace(track=track)
    assert walk(world, 0).shape == (5, 2)
    assert walk(world, 1).tolist() == [[0.0, 0.0]]


def test_the_map_has_the_cosine_of_every_design_that_travels_in_both_worlds():
    name = "area_friction"
    (figure,) = make("gap_map").figures.values()
    axis = figure.axes[0]
    rows, columns = cell_of(np.arange(6561))
    shown = np.ma.filled(axis.images[0].get_array(), np.nan)[rows, columns]
    travels = (worth(name) > LITTLE).all(axis=0)
    assert np.array_equal(np.isfinite(shown), travels)
    first, second = np.radians(headings(name))
    assert shown[travels] == pytest.approx(np.cos(second - first)[travels])
    turned = gap.row(reality(name))["turned"]
    assert np.mean(shown[travels] < 0) == pytest.approx(turned)
    assert axis.get_title(loc="left") == f"{name}: {turned:.0%} of {travels.sum()} designs turned"
    marked = [line.get_xydata()[0] for line in axis.lines if line.get_marker() in ("o", "s")]
    best = np.transpose(cell_of(worth(name).argmax(axis=1)))
    assert np.array_equal(marked, best[:, ::-1])


@pytest.mark.parametrize(
    ("name", "inputs"),
    [("gap", LAG), ("gap", BOTH), ("gap_headings", LAG), ("gap_headings", BOTH), ("gap_map", BOTH)],
)
def test_labels_can_be_read_whatever_realities_are_chosen(name, inputs):
    figures = make(name, inputs).figures
    expected = ["gap_map_lag", "gap_map_high_resolution"] if name == "gap_map" else [name]
    assert list(figures) == expected
    for figure in figures.values():
        with style.style():
            check_labels(figure)


@pytest.mark.parametrize("name", ["gap_headings", "gap_tracks"])
def test_the_same_bytes(name):
    assert files_of(make(name, LAG), ["png"]) == files_of(make(name, LAG), ["png"])
