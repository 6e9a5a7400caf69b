import numpy as np
import pytest
from matplotlib.text import Text
from view.figure_labels import check_labels

from softvox_gym import Design
from softvox_gym.real_tracks import RealTrack, compare
from softvox_view.figures import Inputs, labels, make, style
from softvox_view.figures.robots import best_of_bodies
from softvox_view.figures.tracks import PER_CYCLE, PER_PAGE, designs_of, errors, simulated_tracks

BEST = best_of_bodies()
SIMULATED = dict(zip([one.index for one in BEST], simulated_tracks(BEST)[0], strict=True))


def turned(design, trial, degrees, *, scale=1.0, cycles=23):
    """A real track that is the simulated one, turned aside and longer."""
    a = np.radians(degrees)
    turn = scale * np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]])
    track = SIMULATED[design][: cycles * PER_CYCLE + 1 : PER_CYCLE]
    return RealTrack(design, trial, np.arange(cycles + 1.0), track @ turn)


def short(design):
    return RealTrack(design, "1", np.array([0.0, 1.0]), np.array([[0.0, 0.0], [0.3, 0.2]]))


def axes_of(figure, design):
    (found,) = (one for one in figure.axes if f" {design}:" in one.get_title(loc="left"))
    return found


def words(axis):
    return [text.get_text() for text in axis.texts]


@pytest.fixture(scope="module")
def crowded():
    """Ten trials of one robot, others short, wild, far from the simulated or with odd names."""
    names = [f"ten trials, number {i}" for i in range(10)]
    tracks = [turned(6453, name, 3 * i, scale=0.7) for i, name in enumerate(names)]
    tracks += [turned(6013, "$x^", 20, cycles=7), turned(6330, "wild", 0, scale=12)]
    tracks += [turned(573, "back", 180), turned(4690, "same", 0), turned(6092, "same", 1)]
    return make("tracks", Inputs(tracks=tuple(tracks))).figures["tracks"]


def test_no_label_lies_on_another_or_off_the_page(crowded):
    with style.style():
        check_labels(crowded)


def test_every_trial_has_its_name_at_its_end(crowded):
    axis = axes_of(crowded, 6453)
    ends = {line.get_xydata()[0].tobytes() for line in axis.lines if line.get_marker() == "s"}
    assert len(ends) == 10
    assert sorted(words(axis))[0] == "falls in cycle 16"
    assert sorted(words(axis))[1:] == [f"ten t\N{HORIZONTAL ELLIPSIS}mber {i}" for i in range(10)]
    assert words(axes_of(crowded, 6013)) == ["$x^"]


def test_time_is_marked_on_both_tracks_every_five_cycles(crowded):
    axis = axes_of(crowded, 6013)
    marks = np.array([line.get_xydata()[0] for line in axis.lines if line.get_markersize() == 2.6])
    expected = [*SIMULATED[6013][[5 * PER_CYCLE * i for i in range(1, 5)]]]
    expected.append(turned(6013, "", 20).position[5])  # the real one ends after seven
    assert marks == pytest.approx(np.array(expected), abs=1e-12)


def test_a_wild_track_changes_the_scale_of_its_own_panel_alone(crowded):
    widths = {d.index: np.ptp(axes_of(crowded, d.index).get_xlim()) for d in BEST}
    others = [widths[d.index] for d in BEST if d.index not in (6330, 573)]
    assert np.ptp(others) == pytest.approx(0, abs=1e-9)
    assert widths[6330] > 5 * max(others)
    assert words(axes_of(crowded, 6330))[0] == "own scale"
    assert "own scale" not in words(axes_of(crowded, 4690))
    plain = make("tracks").figures["tracks"]
    assert np.ptp(axes_of(plain, 6453).get_xlim()) == pytest.approx(others[0], abs=1e-9)


def test_angle_and_error_above_a_panel_are_means_over_its_trials(crowded):
    simulated = SIMULATED[6453]
    rows = [compare(turned(6453, "", degrees), simulated, PER_CYCLE) for degrees in (10, 20)]
    mean = np.mean([row.rms_error for row in rows])
    assert errors(rows) == f"15\N{DEGREE SIGN}, RMS {mean:.2f}"
    still = RealTrack(6453, "", np.array([0.0, 23.0]), np.zeros((2, 2)))
    rows.append(compare(still, simulated, PER_CYCLE))
    assert errors(rows).startswith("15\N{DEGREE SIGN}, RMS")
    assert errors(rows[2:]).startswith("RMS")
    assert axes_of(crowded, 573).get_title(loc="right").startswith("180\N{DEGREE SIGN}, RMS")


def test_real_tracks_of_other_designs_have_panels_of_their_own_up_to_a_limit():
    shown = designs_of([short(405), short(6453), short(405)])
    assert shown == [*BEST, Design(405)]
    with pytest.raises(ValueError, match=r"100 designs besides the 9 .* leave some out"):
        designs_of([short(design) for design in range(1, 101)])


def test_many_designs_go_on_to_further_pages():
    made = make("tracks", Inputs(tracks=tuple(short(design) for design in range(1000, 1018))))
    assert list(made.figures) == ["tracks", "tracks_2", "tracks_3"]
    panels = [
        [axis.get_title(loc="left") for axis in figure.axes if axis.get_title(loc="left")]
        for figure in made.figures.values()
    ]
    assert [len(page) for page in panels] == [PER_PAGE, PER_PAGE, 3]
    assert [title.split(":")[0] for title in panels[2]] == ["y  1015", "z  1016", "aa  1017"]
    for figure in made.figures.values():
        assert figure.get_figheight() < 10
        with style.style():
            check_labels(figure)


def test_a_word_keeps_clear_of_what_is_there_and_one_without_room_is_left_out():
    with style.style():
        figure = style.figure(2, 2)
        axis = figure.subplots()
        axis.set_axis_off()
        style.lay_out(figure)
        place, all_but_the_top = np.array([0.5, 0.5]), np.array([[0.0, 0.0, 1.0, 0.8]])
        labels.put(axis, [("word", place)], clear=all_but_the_top, lines=np.zeros((0, 2)))
        (word,) = axis.texts
        assert word.get_position()[1] > 0.8
        assert len(axis.lines) == 1  # that leads to it
        everything = np.array([[0.0, 0.0, 1.0, 1.0]])
        labels.put(axis, [("another", place)], clear=everything, lines=np.zeros((0, 2)))
        assert [text.get_text() for text in axis.findobj(Text) if text.get_text()] == ["word"]
