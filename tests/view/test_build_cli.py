"""softvox build: what it says, what it writes, and what it refuses."""

import csv
import sys
from types import SimpleNamespace

import pytest

import softvox_gym.cli
from softvox_gym import Design
from softvox_gym.landscapes.analysis import symmetry_classes
from softvox_view.cli import build, options
from softvox_view.figures.robots import published

BURIED = ("1" * 13 + "2" + "1" * 13, "--shape", "3x3x3")


@pytest.fixture
def softvox(monkeypatch, capsys, tmp_path):
    """Return what runs the command in a folder of its own: (status, output, error)."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(softvox_gym.cli, "COMMANDS", (build,))
    monkeypatch.setattr(softvox_gym.cli, "entry_points", lambda **_: ())

    def run(*arguments):
        status = softvox_gym.cli.main(["build", *arguments])
        said = capsys.readouterr()
        return status, said.out, said.err

    return run


@pytest.fixture
def drawn(monkeypatch):
    """Put in place of the drawing what keeps what it is asked for."""
    asked = SimpleNamespace(facts=[], sheets=[], batch=[], form=None)

    def facts_of(designs):
        asked.facts.append(designs)
        return [design.digits for design in designs]

    def draw_sheet(plan, facts):
        asked.sheets.append((plan.design.digits, facts))
        return ("page",)

    def draw_batch(plans, bill):
        asked.batch.append(([plan.design.digits for plan in plans], bill.total_usd))
        return ("bill",)

    def write(pages, form):
        asked.form = form
        return " ".join(pages).encode()

    stand_in = SimpleNamespace(
        facts_of=facts_of, draw_sheet=draw_sheet, draw_batch=draw_batch, write=write
    )
    monkeypatch.setitem(sys.modules, "softvox_view.figures.sheets", stand_in)
    return asked


def test_it_says_groups_inlets_and_what_to_care_for(softvox):
    status, out, err = softvox("6453")
    assert (status, err) == (0, "")
    robot, takes, bill = out.split("\n\n")
    assert robot.splitlines() == [
        "6453  00021222  4 pink (active), 1 blue or yellow (passive); groups 2, holes 2",
        "  group A: (1,1,0)",
        "    inlet in (1,1,0) towards +y: a free side, nothing beside the tube; "
        "2 of 2 tubes can go there",
        "  group B: (1,0,1), (0,1,1), (1,1,1)",
        "    inlet in (0,1,1) towards +y: a free side, nothing beside the tube; "
        "2 of 2 tubes can go there",
        "  take care: nothing is below (0,0,1), (1,0,1), (0,1,1): support the overhang while "
        "the slices are bonded",
    ]
    assert "mould fillings" in takes
    assert len(bill.splitlines()) == 1 + 31 + 1


def test_fifty_copies_of_the_full_robot_cost_622(softvox, tmp_path):
    status, out, _ = softvox("6560", "--copies", "50", "--csv", "bill.csv")
    assert status == 0
    assert "\n622.00 USD to buy" in out
    assert out.endswith("\nwrote bill.csv\n")
    rows = list(csv.DictReader((tmp_path / "bill.csv").read_text("utf-8").splitlines()))
    assert sum(round(100 * float(row["bought_usd"])) for row in rows) == 62200


def test_what_cant_be_built_is_said_and_the_others_are_done(softvox, tmp_path):
    status, out, err = softvox("0", "6560", "--csv", "bill.csv")
    assert (status, err) == (1, "")
    assert "  can't be built: it has no voxels\n" in out
    assert "the bill, of the 1 that can be built:" in out
    assert (tmp_path / "bill.csv").exists()
    status, out, err = softvox(*BURIED, "--csv", "none.csv")
    assert (status, err) == (1, "")
    assert "can't be built: group A is buried: no face of (1,1,1) is on the surface" in out
    assert out.endswith("\n\nno bill\n")
    assert not (tmp_path / "none.csv").exists()


def test_the_top_are_the_fittest_that_can_be_built(softvox):
    status, out, _ = softvox("--top", "100", "--one-per-class")
    assert status == 0
    rows = [line.split() for line in out.split("\n\n")[0].splitlines()[1:]]
    classes = symmetry_classes()
    assert {classes[int(row[1])] for row in rows} == {classes[d.index] for d, _ in published()}
    assert (rows[0][:4], len(rows)) == (["1", "6453", "00021222", "4.66"], 16)
    _, out, _ = softvox("--top", "600")
    table = out.split("\n\n")[0].splitlines()
    assert table[-1] == "left out: 8 in several pieces, which can't be built"
    assert len(table) == 1 + 600 + 1
    assert table[-2].startswith("608 ")


def test_sheets_are_drawn_of_all_and_the_batch_of_what_can_be_built(softvox, drawn, tmp_path):
    Design([2, 1, 1], shape=(3, 1, 1)).save("own.json")
    status, out, _ = softvox("6453", "own.json", "0", "--out", "sheets.pdf")
    assert status == 1
    assert out.endswith("\nwrote sheets.pdf\n")
    assert (tmp_path / "sheets.pdf").read_bytes() == b"page page page bill"
    assert [digits for digits, _ in drawn.sheets] == ["00021222", "211", "00000000"]
    assert all(digits == facts for digits, facts in drawn.sheets)
    assert [len({design.lattice for design in one}) for one in drawn.facts] == [1, 1]
    assert drawn.batch[0][0] == ["00021222", "211"]
    assert softvox("6453", "--out", "one.SVG")[0] == 0
    assert (drawn.form, (tmp_path / "one.SVG").read_bytes()) == ("svg", b"page bill")
    assert softvox(*BURIED, "--out", "refused.html")[0] == 1
    assert (tmp_path / "refused.html").read_bytes() == b"page"


def test_phases_are_told(softvox):
    status, out, _ = softvox("23000000", "--phases", "2")
    assert status == 1
    assert "(0,0,0)-(1,0,0) differ in phase" in out


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        ((), "give either designs or --top N"),
        (("6453", "--top", "3"), "give either designs or --top N"),
        (("6453", "--one-per-class"), "--one-per-class needs --top N"),
        (("9999",), "design '9999' is neither a number from 0 to 6560 nor 8 digits"),
        (("none.json",), "DESIGN none.json: No such file or directory"),
        (("6453", "--copies", "0"), "argument --copies: must be a whole number above 0"),
        (("6453", "--mould-voxels", "x"), "argument --mould-voxels: must be a whole number"),
        (("6453", "--out", "a.png"), "--out must end in .pdf, .svg, .html, got 'a.png'"),
        (("6453", "--csv", "no/a.csv"), "--csv no is not a folder"),
        (("6453", "--csv", "taken.csv"), "--csv taken.csv exists"),
        (("6453", "--out", "a.svg", "--csv", "./a.svg", "--force"), "--csv a.svg is where --out"),
        (("--top", "5473"), "--top must be at most 5472, the designs that can be built, got 5473"),
        (("--top", "3", "--shape", "3", "3", "3"), "--shape and --phases are not for --top"),
    ],
)
def test_bad_input_is_one_line(softvox, drawn, tmp_path, arguments, error):
    (tmp_path / "taken.csv").touch()
    status, out, err = softvox(*arguments)
    assert (status, out) == (2, "")
    assert err.startswith("softvox: error: ")
    assert error in err
    assert err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["taken.csv"]


def test_a_missing_library_is_named(softvox, monkeypatch):
    monkeypatch.setitem(sys.modules, "softvox_view.figures.sheets", None)
    monkeypatch.setattr(options, "missing", lambda what, *_: f"{what} needs matplotlib")
    assert softvox("6453", "--out", "a.pdf")[2] == "softvox: error: --out needs matplotlib\n"
