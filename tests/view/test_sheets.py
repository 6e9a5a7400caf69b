import re
from dataclasses import replace
from functools import cache
from xml.etree import ElementTree

import numpy as np
import pytest
from cli_process import softvox
from matplotlib.colors import to_hex
from matplotlib.patches import Rectangle
from view.figure_labels import check_labels, texts_of

import softvox_gym
from softvox_gym import Design
from softvox_gym.build import bill, plan
from softvox_gym.lattice import Lattice
from softvox_view.figures.pages import SIZE, style, width_of, wrapped
from softvox_view.figures.sheets import MOST, draw_batch, draw_sheet, facts_of, write
from softvox_view.figures.slices import BLUE, PINK

ROBOTS = {
    "the best": Design(6453),
    "the second": Design(4295),
    "four groups": Design("02211220"),
    "passive": Design("11110000"),
    "a full slice": Design("22100000"),
    "empty": Design(0),
    "buried": Design("1" * 13 + "2" + "1" * 13, shape=(3, 3, 3)),
    "up and down": Design("111121111" + "111131111", shape=Lattice.of((3, 3, 2), phases=2)),
    "wide": Design("2020010022", shape=(10, 1, 1)),
    "large": Design("1" * 12 + 6 * "210220", shape=(6, 2, 4)),
}


@cache
def sheet(name):
    design = ROBOTS[name]
    return draw_sheet(plan(design), facts_of([design])[0])


def words_of(figures):
    return " ".join(text.get_text() for figure in figures for text in texts_of(figure))


@pytest.mark.parametrize("name", ["the best", "empty", "buried", "up and down", "wide", "large"])
def test_no_text_lies_on_another_or_off_the_page_and_all_can_be_read(name):
    for figure in sheet(name):
        assert tuple(figure.get_size_inches() * 25.4) == pytest.approx((210, 297))
        with style():
            check_labels(figure)
        assert min(text.get_fontsize() for text in texts_of(figure)) >= SIZE


def test_a_robot_of_the_benchmark_has_one_page_and_a_large_one_has_more():
    assert [len(sheet(name)) for name in ("the best", "four groups", "buried")] == [1, 1, 1]
    first, second = sheet("large")
    assert "Robot on 6x2x4, page 2" in words_of([second])
    assert "page" not in words_of([first])
    numbers = [text.get_text() for page in sheet("large") for text in texts_of(page)]
    steps = len(plan(ROBOTS["large"]).steps)
    assert steps >= 10
    assert str(steps) in numbers  # two digits, on one line


def test_the_batch_has_the_bill_and_every_robot():
    plans = [plan(ROBOTS[name]) for name in ("the best", "four groups", "large")]
    (figure,) = draw_batch(plans, bill(plans, 40))
    with style():
        check_labels(figure)
    words = words_of([figure])
    takes = bill(plans, 40)
    assert f"{takes.total_usd:,.2f} USD to buy" in words
    for word in (
        "Batch of 120 robots",
        "40 of each",
        "6453",
        "02211220",
        "Arduino Uno",
        "hours without an incubator",
    ):
        assert word in words


def test_a_slice_is_as_it_is_seen_from_below():
    """x goes to the left, y up: sites, colours, letters, holes and inlets."""
    design = Design("210020" + "000000", shape=(3, 2, 2))  # active, passive, -; -, active, -
    one = plan(design)
    (figure,) = draw_sheet(one, facts_of([design])[0])
    axis = figure.axes[0]
    at = {}
    for text in axis.texts:
        if re.fullmatch(r"\d,\d", text.get_text()):
            at[text.get_text()] = np.array(text.get_position())
    assert set(at) == {"0,0", "1,0", "1,1"}
    assert at["1,0"][0] < at["0,0"][0]  # x to the left
    assert at["1,0"][1] == at["0,0"][1]
    assert at["1,1"][1] < at["1,0"][1]  # y up, as lengths go down the page
    assert at["1,1"][0] == at["1,0"][0]
    side = at["0,0"][0] - at["1,0"][0]
    assert at["1,0"][1] - at["1,1"][1] == pytest.approx(side)
    for name, colour in (("0,0", PINK), ("1,0", BLUE), ("1,1", PINK)):
        around = [
            to_hex(patch.get_facecolor()).upper()
            for patch in axis.patches
            if isinstance(patch, Rectangle)
            and patch.get_width() == pytest.approx(side)
            and np.all(np.abs(np.array(patch.get_center()) - at[name]) < side / 2)
            and patch.get_facecolor()[3]
        ]
        assert around == [colour]
    letters = {
        text.get_text(): np.array(text.get_position())
        for text in axis.texts
        if text.get_text() in ("A", "B") and text.get_fontsize() > SIZE
    }
    for letter, name in (("A", "0,0"), ("B", "1,1")):
        assert np.all(np.abs(letters[letter] - at[name]) < side / 2)
    # An inlet's arrow goes against the outward normal, as seen from below, onto the face's middle.
    ends = [(np.array(t.xyann), np.array(t.xy)) for t in axis.texts if getattr(t, "arrow_patch", 0)]
    for group, name in zip(one.groups, ("0,0", "1,1"), strict=True):
        x, y, _ = group.inlet.face
        outward = np.array([-x, -y])
        middle = at[name] - (0, 0.19 * side) + outward * side / 2
        (start,) = [start for start, end in ends if np.allclose(end, middle)]
        assert np.allclose((start - middle) / np.linalg.norm(start - middle), outward)


def test_a_hole_is_on_the_face_that_two_active_neighbours_share():
    (figure,) = sheet("a full slice")
    axis = figure.axes[0]
    at = {t.get_text(): np.array(t.get_position()) for t in axis.texts}
    white = [line for line in axis.lines if line.get_color() == "white" and len(line.get_xydata())]
    middles = [line.get_xydata().mean(axis=0) for line in white]
    shared = (at["0,0"] + at["1,0"]) / 2
    assert sum(abs(m[0] - shared[0]) < 1e-9 and abs(m[1] - shared[1]) < 0.2 for m in middles) == 1
    assert len(middles) == 2  # that, and the one of the key


def test_the_name_of_a_group_stands_beside_its_arrow_however_long_it_is():
    design = Design("2" * 27, shape=(1, 1, 27))
    last = draw_sheet(plan(design), facts_of([design])[0])[1]
    named = [text for text in texts_of(last) if text.get_text() == "AA"]
    (name,) = (text for text in named if (text.get_size(), text.get_weight()) == (SIZE, "bold"))
    left = name.get_window_extent(last.canvas.get_renderer()).x0 / last.dpi
    tails = [text.xyann for text in name.axes.texts if hasattr(text, "xyann")]
    assert left > max(x for x, y in tails if y == pytest.approx(name.get_position()[1]))


def test_a_sheet_says_what_the_simulator_expects():
    (facts, still) = facts_of([Design(6453), Design("11110000")])
    table = softvox_gym.landscape()
    assert facts.fitness == table["fitness"][6453]
    assert facts.heading == pytest.approx(
        np.degrees(np.arctan2(table["dy"][6453], table["dx"][6453]))
    )
    assert facts.volume_at(0.25) == pytest.approx(1 + 0.8 * 0.9, abs=1e-3)
    assert still.heading is None
    words = words_of(sheet("the best"))
    assert f"{facts.fitness:.2f} voxel widths, \N{MINUS SIGN}135\N{DEGREE SIGN}" in words
    assert "1.01 1.72 1.01 1.01" in words
    assert "no heading" in words_of(sheet("passive"))


def test_a_heading_just_below_0_has_no_sign():
    facts = facts_of([ROBOTS["the best"]])[0]
    assert replace(facts, heading=-0.3).way == "0\N{DEGREE SIGN}"
    assert replace(facts, heading=-0.6).way == "\N{MINUS SIGN}1\N{DEGREE SIGN}"


def test_the_map_shows_the_heading_from_above():
    """6453 goes to the lower left there, and 4295 to the upper right."""
    for name, sign in (("the best", -1), ("the second", 1)):
        (figure,) = sheet(name)
        ends = [
            np.subtract(t.xy, t.xyann)
            for t in figure.axes[1].texts
            if getattr(t, "arrow_patch", None) and t.arrow_patch.get_linewidth() == 1.4
        ]
        ((x, y),) = ends
        assert x * sign > 0
        assert y * sign > 0


def test_a_robot_that_cant_be_built_says_why_and_has_no_steps():
    one = plan(ROBOTS["buried"])
    words = words_of(sheet("buried"))
    assert "can't be built" in words
    assert "buried" in one.problems[0]
    assert "".join(one.problems[0].split()) in "".join(words.split())
    assert "z = 1" in words
    assert "Order of assembly" not in words
    assert "Order of assembly" in words_of(sheet("the best"))


def test_a_robot_that_diverges_has_a_sheet():
    (facts,) = facts_of([Design(6453)])
    lost = replace(facts, fitness=np.nan, heading=None, volume=facts.volume * np.nan)
    (figure,) = draw_sheet(plan(Design(6453)), lost)
    assert "the simulation diverges" in words_of([figure])


def test_too_wide_a_lattice_is_refused():
    shape = (MOST + 1, 1, 1)
    design = Design("2" * (MOST + 1), shape=shape)
    with pytest.raises(ValueError, match=f"up to {MOST} sites along x and y, got 11x1x1"):
        draw_sheet(plan(design), facts_of([design])[0])


def test_files_are_the_same_on_every_run_and_have_no_date_whatever_mplbackend_names(tmp_path):
    done = softvox("build", "0", "--out", "own.pdf", cwd=tmp_path, MPLBACKEND="no_such")
    assert done.returncode == 1
    content = write(sheet("empty"), "pdf")
    assert (tmp_path / "own.pdf").read_bytes() == content
    assert len(re.findall(rb"/Type /Page\b", content)) == 1
    # Regular and bold: their letters, and perhaps their other characters apart.
    assert content.count(b"/FontFile2") <= 4
    assert b"/Type3" not in content
    for made in (content, write(sheet("empty"), "svg")):
        assert not re.search(rb"CreationDate|Producer|Creator|dc:|matplotlib.org", made)


def test_a_web_page_is_complete_and_prints_a_page_per_sheet():
    pages = 2 * sheet("empty")
    content = write(pages, "html").decode()
    assert write(pages, "html").decode() == content
    links = set(re.findall(r"\w+://[^\s\"')]+", content))
    assert links == {
        "http://www.w3.org/1999/xlink",
        "http://www.w3.org/2000/svg",
    }  # names, not links
    assert content.count("<svg") == content.count("</svg>") == 2
    assert "break-after: page" in content
    assert "<title>Robot 0 and more</title>" in content


def test_in_an_svg_the_pages_are_below_one_another():
    root = ElementTree.fromstring(write(2 * sheet("empty"), "svg"))
    wide, high = (float(root.get(name).removesuffix("pt")) for name in ("width", "height"))
    assert (wide, high) == pytest.approx((210 / 25.4 * 72, 2 * 297 / 25.4 * 72))
    assert root.get("viewBox") == f"0 0 {wide} {high}"
    inner = [[float(page.get(name, 0)) for name in ("y", "width", "height")] for page in root]
    assert inner == [
        pytest.approx([0, wide, high / 2]),
        pytest.approx([high / 2, wide, high / 2]),
    ]


def test_text_is_wrapped_at_spaces_only():
    text = "punch 2 holes: (1,0,1)-(1,1,1), (0,1,1)-(1,1,1). " + 9 * "0123 "
    for width in (1.5, 3.0):
        lines = wrapped(text, width)
        assert max(map(width_of, lines)) <= width
        assert " ".join(lines).split() == text.split()
    assert wrapped("60\N{NO-BREAK SPACE}C", 0.1) == ["60\N{NO-BREAK SPACE}C"]
    assert wrapped("", 1) == [""]
