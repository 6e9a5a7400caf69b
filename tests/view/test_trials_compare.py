"""softvox trials compare, the way people meet it."""

import csv
import json
import re

import numpy as np
import pytest
from view.figure_labels import check_labels

import softvox_gym.trials
from softvox_gym import Design
from softvox_gym.cli import main
from softvox_gym.real_tracks import RealTrack
from softvox_gym.trials import Trial, database
from softvox_view.figures import style, tracks
from softvox_view.figures import trials as figures
from softvox_view.figures.trials import MOST_MORE, draw_comparison, draw_distances, draw_headings


def trial(design, end, *, cycles=2.0, **about):
    """A run that nobody made: straight to where it ends, voxel widths."""
    about = {"surface": "acrylic", "who": "nobody, as tests make it"} | about
    return Trial(
        design=design,
        cycle=[0, cycles],
        position=[[0, 0], np.multiply(end, 1.5)],
        date="2026-11-27",
        license="CC0-1.0",
        **about,
    )


RUNS = (
    trial(6453, (-0.4, -0.4)),
    trial(6453, (-0.5, -0.4), repetition=2),
    trial(6013, (0.3, 0.1)),
    trial(2117, (0.2, 0.3)),
    trial(573, (0.4, 0.3)),
    trial(573, (0.1, 0), surface="ice $x_1 <b>", cycles=1, powder="starch"),
)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Stand in a folder with a database of the usual name."""
    monkeypatch.chdir(tmp_path)
    database.add(tmp_path / "trials", RUNS)
    return tmp_path / "trials"


def told(capsys, *arguments):
    status = main(["trials", "compare", *map(str, arguments)])
    out, err = capsys.readouterr()
    return status, out, err


def test_conditions_have_a_table_each_and_the_cycles_are_told(folder, capsys):
    status, out, _ = told(capsys)
    assert status == 0
    lines = out.splitlines()
    assert lines[0] == "Simulator: published."
    assert lines[2] == "measured, acrylic: 2 cycles, real and simulated alike"
    assert lines[3].split()[:5] == ["design", "trials", "distance", "real", "+-"]
    trials = [line.split()[:2] for line in lines[4:8]]
    assert trials == [["573", "1"], ["2117", "1"], ["6013", "1"], ["6453", "2"]]
    number = r"-?\d\.\d\d"
    assert re.match(rf"SRCC {number} \({number} to {number}\), tau .* over 4 designs\.", lines[8])
    assert lines[11] == "measured, ice $x_1 <b>, starch: 1 cycles, real and simulated alike"
    assert "No SRCC: it takes 4 designs" in lines[14]


def test_cycles_are_chosen_and_short_trials_left_out(folder, capsys):
    _, out, _ = told(capsys, "--cycles", "2:1")
    assert "2 real cycles laid over 1 simulated ones" in out
    assert "Left out, as too short: 1 trial." in out
    _, out, _ = told(capsys, "--cycles", "1", "--json")
    made = json.loads(out)
    assert made["conditions"][0]["cycles"].startswith("1 cycles, real and simulated alike")
    assert made["left_out"] == []


def test_json_has_all_numbers(folder, capsys):
    _, out, _ = told(capsys, "--json", "--surface", "ACRYL", "--reality", "reversal")
    made = json.loads(out)
    assert (made["simulator"], made["physics"]["strain"]) == ("reversal", 0.5)
    (condition,) = made["conditions"]
    assert (condition["surface"], condition["trials"], condition["tau"] is None) == (
        *("acrylic", 5),
        False,
    )
    own = softvox_gym.trials.compare(RUNS[:5], softvox_gym.reality("reversal"))
    assert condition["rows"] == [row.record() for row in own.rows]


def test_a_folder_gets_a_page_a_table_and_figures_that_can_be_read(
    folder, tmp_path, capsys, monkeypatch
):
    drawn, encoded = {}, style.encoded

    def kept(made):
        drawn.update(draw_comparison(made))
        return drawn

    def without_pdf(made, form):  # dear, and the same for all figures
        return b"" if form == "pdf" else encoded(made, form)

    monkeypatch.setattr(figures, "draw_comparison", kept)
    monkeypatch.setattr(style, "encoded", without_pdf)
    out = tmp_path / "out"
    status, printed, _ = told(capsys, "--out", out, "--friction-static", "0.8")
    assert (status, printed.splitlines()[-1]) == (0, f"wrote {out}")
    names = ("distances", "headings", "tracks")
    pictures = {f"{name}.{form}" for name in names for form in ("pdf", "png")}
    assert {path.name for path in out.iterdir()} == {"compare.html", "comparison.csv", *pictures}
    with (out / "comparison.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["design"] for row in rows] == ["573", "2117", "6013", "6453", "573"]
    assert rows[3]["rms_error_repeatability"]
    assert rows[4]["rms_error_repeatability"] == ""
    page = (out / "compare.html").read_text()
    assert page.count("<svg") == 3
    assert "ice $x_1 &lt;b&gt;" in page
    assert "friction_static=0.8" in page
    assert not re.search(r'(src|href)="(?!data:|#)', page.replace("xlink:", ""))
    with style.style():
        for figure in drawn.values():
            check_labels(figure)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere"], "there is no folder nowhere"),
        (["--cycles", "90:23"], "no trial has 90 cycles: the longest has 2; give fewer"),
        (["--cycles", "many"], "--cycles: must be a number, got 'many'"),
        (["--reality", "revrsal"], "did you mean reversal?"),
        (["--reality", "soft", "--strain", "0.1"], "give either --reality or physics options"),
        (["--duration", "4"], "--duration follows from the cycles of the trials"),
        (["--design", "1"], "none of the 6 trials matches the options"),
        (["--source", "real"], "invalid choice: 'real'"),
        (["--out", "trials"], "--out trials is not empty"),
        (["--outt", "x"], "did you mean --out?"),
        (["--strain", "-2"], "strain must be"),
    ],
)
def test_bad_input_is_named_with_its_mend(folder, capsys, arguments, message):
    status, out, err = told(capsys, *arguments)
    assert (status, out) == (2, "")
    assert message in err
    assert "Traceback" not in err


def test_without_trials_there_is_nothing_to_compare(folder, tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    status, _, err = told(capsys, "empty")
    assert status == 2
    assert "there are no trials to compare; give at least one" in err


@pytest.fixture(scope="module")
def crowded():
    """More designs than are named in a panel, some of large lattices, under long conditions."""
    large = [Design(2 * 3**i, shape=(3, 3, 3)) for i in range(26)]
    every = [*range(6450, 6468), *large]
    runs = [trial(one, (0.5, 0.1 * i), cycles=0.1) for i, one in enumerate(every)]
    runs += [trial(one, (0.9, 0.4), cycles=0.1, surface=70 * "ice") for one in every[:3]]
    runs += [trial(6453, (0.4, 0.4), cycles=0.1, repetition=2)]
    return softvox_gym.trials.compare(runs)


@pytest.fixture(scope="module")
def headings(crowded):
    with style.style():
        return draw_headings(crowded)


def test_no_label_lies_on_another_where_there_are_many(crowded, headings):
    with style.style():
        check_labels(headings)
        check_labels(draw_distances(crowded))


def test_headings_show_errors_beside_repeatability(headings):
    many, few = headings.axes
    assert {label.get_text() for label in many.get_xticklabels()} == {""}
    assert [label.get_text() for label in few.get_xticklabels()] == ["6450", "6451", "6452"]
    assert few.get_title(loc="left").startswith("(2) measured, ice")
    usual = np.concatenate([axis.lines[-1].get_ydata() for axis in headings.axes])
    assert len(usual) == 47
    assert np.isfinite(usual).sum() == 1  # one design has two trials


def test_pages_of_two_rows_have_room_for_their_labels():
    straight = np.outer(np.linspace(0, 1, 51), [1.0, 0.5])
    real = RealTrack(6453, "1", np.array([0.0, 1.0]), straight[[0, -1]])
    held = [tracks.compare(real, straight, 50)]
    panels = [tracks.Panel(name, Design(6453), "", 0, straight, [real], held) for name in "abcd"]
    with style.style():
        check_labels(tracks.draw_page(panels, 1.0))


def test_more_designs_than_have_room_are_refused(crowded):
    many = type(crowded)(rows=crowded.rows * 3, world=crowded.world, left_out=())
    with pytest.raises(ValueError, match=f"has 141 rows, and at most {MOST_MORE} have room"):
        draw_comparison(many)
