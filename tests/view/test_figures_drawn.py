import io
import re
from functools import cache

import matplotlib
import numpy as np
import pytest
from view.figure_labels import check_labels, texts_of

import softvox_gym
from softvox_gym import Design, Physics, simulate
from softvox_gym.landscapes.analysis import symmetry_classes
from softvox_gym.real_tracks import RealTrack, compare, read_tracks
from softvox_view.figures import FIGURES, OF_RESULTS, Inputs, files_of, make, style
from softvox_view.figures.maps import (
    KINDS,
    NAMED,
    class_ranks,
    colour_of,
    kept,
    kinds,
    mean_displacement,
    ranks,
)
from softvox_view.figures.robots import best_of_bodies, published, relative_volume
from softvox_view.figures.tracks import CYCLES, PER_CYCLE, STEPS, tipping_cycles
from softvox_view.tessellation import cell_of

OWN = [name for name in FIGURES if name not in OF_RESULTS]


@cache
def drawn(name):
    """The figure and its files."""
    made = make(name)
    return made, files_of(made, style.FORMATS)


@pytest.mark.parametrize("name", OWN)
def test_no_label_lies_on_another_or_off_the_page(name):
    made, _ = drawn(name)
    for figure in made.figures.values():
        assert len(texts_of(figure)) >= 8
        with style.style():
            check_labels(figure)
            assert min(text.get_fontsize() for text in texts_of(figure)) >= style.SMALL


@pytest.mark.parametrize("name", OWN)
def test_files_have_neither_dates_nor_versions_and_their_text_is_text(name):
    made, files = drawn(name)
    (first, *_) = made.figures
    png, pdf = files[f"{first}.png"], files[f"{first}.pdf"]
    assert png.startswith(b"\x89PNG")
    assert pdf.startswith(b"%PDF")
    for content in (png, pdf):
        assert not re.search(rb"[Mm]atplotlib|CreationDate|tEXt|tIME|Producer|Creator", content)
    assert b"/CIDFontType2" in pdf  # a TrueType font, not outlines
    assert b"/Type3" not in pdf


@pytest.mark.parametrize("name", ["heatmap", "tracks"])
def test_the_same_figure_has_the_same_bytes(name):
    _, files = drawn(name)
    assert files_of(make(name), style.FORMATS) == files


def test_a_figure_is_laid_out_once_and_as_matplotlib_would():
    made, files = drawn("volume")
    assert made.figures["volume"].get_layout_engine() is None
    alone = io.BytesIO()
    with style.style():
        figure = make("volume").figures["volume"]
        figure.savefig(alone, format="png", dpi=style.DPI, metadata={"Software": None})
    assert alone.getvalue() == files["volume.png"]


def test_the_users_settings_stay_and_do_not_matter():
    _, files = drawn("volume")
    with matplotlib.rc_context({"font.size": 20, "lines.linewidth": 9}):
        again = files_of(make("volume"), style.FORMATS)
        assert matplotlib.rcParams["font.size"] == 20
    assert again == files


def test_the_gallery_shows_the_published_hundred_in_their_order():
    assert len(published()) == 100
    assert published()[0] == (Design(6453), "4.66")
    fitness = softvox_gym.landscape()["fitness"]
    assert [f"{fitness[design.index]:.2f}" for design, _ in published()] == [
        text for _, text in published()
    ]
    made, _ = drawn("gallery")
    shown = [text.get_text() for text in made.figures["gallery"].axes[0].texts]
    assert shown[:4] == ["4.66", "1: 6453", "4.65", "2: 4295"]
    assert len(shown) == 200 + 3


def test_the_gallery_shows_the_first_of_each_class_on_demand():
    texts = make("gallery", Inputs(one_per_class=True)).figures["gallery"].axes[0].texts
    shown = [text.get_text().split(" ", 2) for text in texts[1:-3:2]]
    assert shown[:2] == [
        ["1:", "6453", "\N{MULTIPLICATION SIGN}4"],
        ["5:", "5029", "\N{MULTIPLICATION SIGN}8"],
    ]
    assert sum(int(size[1:]) for _, _, size in shown) == 100
    hundred = [design.index for design, _ in published()]
    class_of = symmetry_classes()
    for rank, number, _ in shown:
        place = int(rank[:-1]) - 1
        assert hundred[place] == int(number)
        assert class_of[hundred[place]] not in class_of[hundred[:place]]


def test_the_heatmap_shows_every_designs_rank_or_fitness_at_its_cell():
    fitness = softvox_gym.landscape()["fitness"]
    rows, columns = cell_of(np.arange(6561))
    for scale, expected in (("fitness", fitness), ("rank", ranks(fitness))):
        axis = make("heatmap", Inputs(scale=scale)).figures["heatmap"].axes[0]
        (image,) = axis.images
        assert np.array_equal(np.asarray(image.get_array())[rows, columns], expected)
        assert image.origin == "lower"
        names = [text.get_text() for text in axis.texts]
        assert names[:2] == ["1: 6453, 4.66", "2: 4295, 4.65"]
        assert len(names) == NAMED


def test_equal_values_share_the_better_rank():
    assert ranks(np.array([0.0, 2.0, 0.0, 3.0])).tolist() == [3, 2, 3, 1]


def test_robustness_shows_every_design_where_its_fitness_and_its_mean_are():
    made, _ = drawn("robustness")
    every, best, robust = made.figures["robustness"].axes[0].lines[1:]
    fitness, mean = softvox_gym.landscape()["fitness"], softvox_gym.noisy_landscape(1)["mean"]
    assert np.array_equal(every.get_xydata(), np.stack([fitness, mean], axis=1))
    assert sorted(best.get_xdata()) == sorted(fitness)[-100:]
    assert sorted(robust.get_ydata()) == sorted(mean)[-100:]


def test_every_design_has_the_kind_that_it_is_of():
    names = np.array(KINDS)[kinds()]
    assert names[0] == "no voxels"
    for design, name in enumerate(names[1:], start=1):
        one = Design(design)
        body = "one piece" if one.is_connected else "in pieces"
        assert name == body + ("" if one.n_active else ", none active")


def test_classes_are_ranked_by_their_fittest_design():
    ranks, fitness = class_ranks(), softvox_gym.landscape()["fitness"]
    assert sorted(set(ranks)) == list(range(1, 1036))
    smallest = symmetry_classes()
    best = [fitness[ranks == rank].max() for rank in range(1, 1036)]
    assert best == sorted(best, reverse=True)
    assert ranks[6453] == 1
    for rank in (1, 2, 500, 1035):
        assert len(set(smallest[ranks == rank])) == 1
    firsts = [smallest[ranks == rank][0] for rank in range(1, 1036)]
    ties = [i for i in range(1034) if best[i] == best[i + 1]]
    assert ties
    assert all(firsts[i] < firsts[i + 1] for i in ties)


def test_headings_have_the_colours_of_the_wheel_and_little_travel_has_none():
    dx, dy = np.array([0.1, 1.0, 9.0, -1.0, 0.0]), np.array([0.2, 0.0, 0.0, 0.0, -1.0])
    colours = colour_of(dx, dy)
    assert np.array_equal(colours[0], [1, 1, 1])
    assert np.array_equal(colours[1], colours[2])
    assert len(np.unique(colours, axis=0)) == 4


def test_an_arrow_is_the_mean_displacement_of_the_designs_of_its_square():
    table = softvox_gym.landscape()
    displacement = np.stack([table["dx"], table["dy"]], axis=1)
    rows, columns = cell_of(np.arange(6561))
    mean = mean_displacement(displacement)
    for row, column in ((0, 0), (2, 7), (8, 3)):
        inside = (rows // 9 == row) & (columns // 9 == column)
        assert inside.sum() == 81
        assert mean[row, column] == pytest.approx(displacement[inside].mean(axis=0), abs=1e-12)


def test_the_share_kept_is_that_of_the_worst_tenth_of_the_draws_of_robots_that_walk():
    share, quantile = kept(), softvox_gym.noisy_landscape(1)["q10"]
    fitness = softvox_gym.landscape()["fitness"]
    assert share[6453] == quantile[6453] / fitness[6453]
    assert np.array_equal(np.isnan(share), fitness < 1)
    # The scale ends at 1; it would mislead if many designs were beyond.
    assert np.nanmean(share > 1) < 0.02


def test_the_robots_shown_are_the_fittest_of_the_nine_fittest_bodies():
    chosen = best_of_bodies()
    fitness = softvox_gym.landscape()["fitness"]

    def body(design):
        return Design(design.digits.replace("2", "1")).canonical()

    bodies = [body(design) for design in chosen]
    assert len(set(bodies)) == len(chosen) == 9
    worst = min(fitness[design.index] for design in chosen)
    for number in np.flatnonzero(fitness > worst):
        best = chosen[bodies.index(body(Design(int(number))))]
        assert fitness[number] <= fitness[best.index]


@pytest.mark.parametrize(
    ("mode", "low"), [("hold", 1.0), ("clamp", 1.0), ("expand_and_contract", (1 - 0.2386) ** 3)]
)
def test_an_active_voxel_grows_by_ninety_per_cent(mode, low):
    time, volume = relative_volume([Design("20000000")], mode)
    # Frames are two steps apart, so that the turning points are missed by a little.
    assert volume.max() == pytest.approx(1.9, abs=1e-4)
    assert time[volume[0].argmax()] == pytest.approx(0.25, abs=2 / 552)
    # Holding keeps the last edge above rest, of the step before half a cycle.
    assert volume.min() == pytest.approx(low, abs=0.01)
    assert time[0] == pytest.approx(0, abs=2 / 552)
    assert time[-1] == pytest.approx(1, abs=2 / 552)


def test_a_robots_volume_follows_its_share_of_active_voxels():
    _, volume = relative_volume([Design("20000000"), Design(6453), Design("11111111")])
    assert volume[1] - 1 == pytest.approx(0.8 * (volume[0] - 1), abs=1e-9)
    assert volume[2] == pytest.approx(1, abs=1e-12)


def test_simulated_tracks_are_a_file_of_tracks_that_has_no_error(tmp_path):
    made, _ = drawn("tracks")
    path = tmp_path / "again.csv"
    path.write_bytes(made.tables["tracks_simulated.csv"])
    tracks = read_tracks([path], most_cycles=CYCLES)
    assert [track.design for track in tracks] == [design.index for design in best_of_bodies()]
    again = make("tracks", Inputs(tracks=tracks))
    rows = again.tables["tracks_compared.csv"].decode().splitlines()
    errors = [row.split(",")[-2:] for row in rows[1:]]
    assert len(errors) == 9
    # The file has six decimals.
    assert np.array(errors, dtype=float).max() < 2e-6


def test_a_robot_falls_on_another_side_where_its_voxels_change_places():
    """6453 walks on two voxels with two at one height, until it lies on one of these as well."""
    result = simulate([6453, 573], Physics.published().lasting(16), frames=STEPS)
    assert tipping_cycles(result) == [16, 0]
    heights = result.frames.position[0, :, *np.nonzero(result.designs[0]), 2] / 0.01
    on_floor = np.sum(heights < 0.51, axis=0)
    assert on_floor[[2, 15, 17]].tolist() == [2, 2, 3]
    axis = drawn("tracks")[0].figures["tracks"].axes[0]
    assert axis.get_title(loc="left") == "a  6453: 4.66"
    assert [text.get_text() for text in axis.texts] == ["falls in cycle 16"]


def test_a_robot_turned_aside_is_found_out(tmp_path):
    made, _ = drawn("tracks")
    path = tmp_path / "real.csv"
    path.write_bytes(made.tables["tracks_simulated.csv"])
    track = read_tracks([path], most_cycles=CYCLES)[0]
    turned = RealTrack(track.design, "turned", track.cycle, track.position @ [[0, 1], [-1, 0]])
    row = compare(turned, track.position, PER_CYCLE)
    assert row.angle == pytest.approx(90)
    assert row.end_point_error == pytest.approx(np.sqrt(2) * row.distance_real)
    shown = make("tracks", Inputs(tracks=(turned,)))
    assert any("turned" in line and " 90.0 " in line for line in shown.lines)
