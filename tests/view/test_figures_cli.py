import subprocess
import sys
from types import SimpleNamespace

import pytest
from cli_process import softvox

from softvox_gym.cli.parser import Parser
from softvox_gym.cli.terminal import BadInputError
from softvox_view.cli import figures as command
from softvox_view.figures import FIGURES, OF_RESULTS, Drawing, style

OWN = [name for name in FIGURES if name not in OF_RESULTS]


def softvox_figures(*arguments):
    parser = Parser(prog="softvox")
    command.add_parser(parser.add_subparsers())
    args = parser.parse_args(["figures", *map(str, arguments)])
    return args.run(args)


def test_one_command_draws_what_is_named_in_every_format(tmp_path, capsys):
    out = tmp_path / "out"
    assert softvox_figures("heatmap", "volume", "heatmap", "--out", out) == 0
    assert sorted(path.name for path in out.iterdir()) == [
        "heatmap.pdf",
        "heatmap.png",
        "volume.pdf",
        "volume.png",
    ]
    assert capsys.readouterr().out == f"wrote 4 files into {out}: heatmap, volume\n"


def test_all_figures_are_drawn_where_none_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(command, "make", lambda name, _: Drawing({}, tables={name: b"drawn"}))
    assert softvox_figures("--out", tmp_path / "out") == 0
    drawn = {path.name for path in (tmp_path / "out").iterdir()}
    assert drawn == set(OWN)


def test_real_tracks_are_compared_on_the_terminal_and_in_a_table(tmp_path, capsys):
    real = tmp_path / "real.csv"
    real.write_text("design,trial,cycle,x_cm,y_cm\n6453,one,0,0,0\n6453,one,23,3,4\n")
    out = tmp_path / "out"
    assert softvox_figures("tracks", "--tracks", real, "--out", out, "--format", "png") == 0
    assert sorted(path.name for path in out.iterdir()) == [
        "tracks.png",
        "tracks_compared.csv",
        "tracks_simulated.csv",
    ]
    row = (out / "tracks_compared.csv").read_text().splitlines()[1].split(",")
    assert row[:3] == ["6453", "one", "23"]
    assert float(row[4]) == pytest.approx(53.1301)  # atan2(4, 3)
    assert float(row[7]) == 5
    assert "6453  one" in capsys.readouterr().out


def test_no_page_of_an_earlier_figure_is_left_beside_a_new_one(tmp_path, monkeypatch):
    for name in ("tracks_2.png", "tracks_3.png", "tracks_simulated.csv", "mine_2.png"):
        (tmp_path / name).write_text("earlier")
    made = Drawing({}, tables={"tracks.png": b"drawn", "tracks_2.png": b"drawn"})
    monkeypatch.setattr(command, "make", lambda name, _: made)
    assert softvox_figures("tracks", "--out", tmp_path, "--force") == 0
    left = {path.name: path.read_text() for path in tmp_path.iterdir()}
    assert left == {
        "tracks.png": "drawn",
        "tracks_2.png": "drawn",
        "tracks_simulated.csv": "earlier",
        "mine_2.png": "earlier",
    }


def test_earlier_figures_stay_unless_forced(tmp_path):
    (tmp_path / "volume.png").write_text("mine")
    arguments = ("volume", "--format", "png", "--out", tmp_path)
    with pytest.raises(BadInputError, match=r"--out .* is not empty; .* --force"):
        softvox_figures(*arguments)
    assert (tmp_path / "volume.png").read_text() == "mine"
    assert softvox_figures(*arguments, "--force") == 0
    assert (tmp_path / "volume.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["heatmaps"], "no figure 'heatmaps'; there are gallery, tessellation, .*, transfer"),
        (["search"], "results of searchers; give --results DIR"),
        (["transfer"], "results of transfer methods; give --results DIR"),
        (["gallery", "--scale", "rank"], "--scale is for the figure heatmap; name that as well"),
        (["heatmap", "--one-per-class"], "--one-per-class is for the figure gallery; name that"),
        (["heatmap", "--tracks", "real.csv"], "--tracks is for the figure tracks; name that"),
        (
            ["heatmap", "--results", "results"],
            "--results is for one of search, transfer; name that",
        ),
        (["heatmap", "--reality", "soft"], "--reality is for one of gap, .*; name that as well"),
        (["gap", "--reality", "sofft"], "--reality no reality 'sofft'; did you mean soft"),
        (["--tracks", "nothing.csv"], r"--tracks nothing\.csv can't be read"),
        (["--results", "nothing"], "--results nothing: results are not there; softvox compare"),
    ],
)
def test_bad_input_is_refused_before_anything_is_drawn(tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadInputError, match=message):
        softvox_figures(*arguments)
    assert list(tmp_path.iterdir()) == []


def test_realities_are_chosen_once_each_and_other_options_reach_their_figures(
    tmp_path, monkeypatch
):
    given = []
    monkeypatch.setattr(command, "make", lambda _, inputs: given.append(inputs) or Drawing({}))
    chosen = ["--reality", "lag", "--reality", "public-0", "--reality", "lag"]
    assert softvox_figures("gap", *chosen, "--out", tmp_path / "out") == 0
    assert [one.name for one in given[0].realities] == ["lag", "public-0"]
    assert (given[0].scale, given[0].one_per_class) == ("rank", False)
    options = ("--scale", "fitness", "--one-per-class", "--force")
    assert softvox_figures(*options, "--out", tmp_path / "out") == 0
    assert (given[-1].scale, given[-1].one_per_class) == ("fitness", True)


@pytest.mark.parametrize(
    ("names", "kinds", "drawn"),
    [
        ([], {"a": False}, [*OWN, "search"]),
        ([], {"b": True}, [*OWN, "transfer"]),
        ([], {"a": False, "b": True}, list(FIGURES)),
        (["transfer"], {"b": True}, ["transfer"]),
        (["transfer"], {"a": False}, "--results a is for the figure search; name that as well"),
        (["search"], {"b": True}, "--results b is for the figure transfer; name that as well"),
        (["search", "transfer"], {"a": False}, "the figure transfer is made from results of tra"),
    ],
)
def test_results_are_for_the_figure_of_their_kind(tmp_path, monkeypatch, names, kinds, drawn):
    found = {name: SimpleNamespace(folder=name, is_of_transfer=of) for name, of in kinds.items()}
    monkeypatch.setattr(command, "read_results", lambda folders, of_transfer: found)
    monkeypatch.setattr(command, "make", lambda name, _: Drawing({}, tables={name: b"drawn"}))
    arguments = (*names, "--results", "any", "--out", tmp_path / "out")
    if isinstance(drawn, str):
        with pytest.raises(BadInputError, match=drawn):
            softvox_figures(*arguments)
        return
    assert softvox_figures(*arguments) == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == set(drawn)


def test_an_unknown_format_is_refused_with_those_there_are(capsys):
    with pytest.raises(SystemExit, match="2"):
        softvox_figures("--format", "svg")
    assert "invalid choice: 'svg' (choose from" in capsys.readouterr().err


def test_a_malformed_file_of_tracks_is_named_with_its_line(tmp_path):
    real = tmp_path / "real.csv"
    real.write_text("design,trial,cycle,x_cm,y_cm\n9999,one,0,0,0\n")
    with pytest.raises(BadInputError, match=r"--tracks .*real\.csv, line 2: design '9999'"):
        softvox_figures("--tracks", real, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_formats_are_those_that_can_be_written():
    assert tuple(style.FORMATS) == command.FORMATS


def test_no_interactive_backend_is_needed_whatever_mplbackend_names(tmp_path):
    """Jupyter's kernels set it for all that they start."""
    backend = "module://matplotlib_inline.backend_inline"
    arguments = ("figures", "heatmap", "--format", "png", "--out", str(tmp_path / "out"))
    done = softvox(*arguments, MPLBACKEND=backend)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out" / "heatmap.png").read_bytes().startswith(b"\x89PNG")


def test_without_matplotlib_it_says_what_to_install(tmp_path, monkeypatch):
    for name in [
        name
        for name in sys.modules
        if name.startswith(("softvox_view.figures.", "softvox_search.report."))
    ]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(BadInputError, match=r"^figures needs matplotlib: pip install matplotlib$"):
        softvox_figures("heatmap", "--out", tmp_path / "out")


def test_the_command_is_light_to_import():
    code = "import sys, softvox_view.cli.figures; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert not loaded & {"matplotlib", "pandas", "scipy", "PIL"}
