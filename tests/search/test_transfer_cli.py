"""softvox transfer: one method, one reality, a table and a picture."""

import io
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from cli_process import snapshot, softvox
from PIL import Image

from softvox_gym import Reality
from softvox_gym.cli import main
from softvox_search.transfer import METHODS, transfer
from softvox_search.transfer.registry import REGISTRY

DOC = Path(__file__).parents[2] / "docs" / "transfer.md"


def pixels(content):
    return np.asarray(Image.open(io.BytesIO(content)))


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    return tmp_path


def said(capsys, *command):
    """Run the command in this process; return its output."""
    status = main(["transfer", *command])
    out, err = capsys.readouterr()
    assert (status, err) == (0, "")
    return out


def test_as_a_process_it_shows_a_run_with_a_picture(tmp_path):
    done = softvox("transfer", "--method", "ite", "--tests", "7", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0] == "ite in reversal, directed along 0, 90, 180, 270 degrees; seed 0"
    assert [line.split()[0] for line in lines[3:7]] == ["1", "2", "5", "7"]
    assert lines[-1] == "picture        transfer-ite-reversal-0.png"
    assert list(snapshot(tmp_path)) == ["transfer-ite-reversal-0.png"]
    image = pixels((tmp_path / "transfer-ite-reversal-0.png").read_bytes())
    assert image.shape[1] > image.shape[0] > 300
    assert image.std() > 10


def test_json_tells_every_run_and_the_mean_over_headings(here, capsys):
    command = ("--method", "random", "--reality", "soft", "--tests", "4", "--seed", "5", "--json")
    data = json.loads(said(capsys, *command, "--no-picture"))
    assert snapshot(here) == {}
    runs = [
        transfer("random", reality="soft", heading=heading, tests=4, seed=5)
        for heading in (0, 90, 180, 270)
    ]
    assert [row["heading"] for row in data["runs"]] == [0, 90, 180, 270]
    for row, run in zip(data["runs"], runs, strict=True):
        for name in ("tested", "rewards", "recommended", "regret", "class_regret"):
            assert row[name] == getattr(run, name).tolist()
        for name in ("srcc_before", "kendall_before", "heading_error_before"):
            assert row[name] == getattr(run, name)
        for name in ("srcc_after", "kendall_after", "heading_error", "distance"):
            assert row[name] is None
        assert row["is_specified"] is False
        assert row["simulations"] == 0
    for name in ("regret", "class_regret"):
        mean = np.mean([getattr(run, name) for run in runs], axis=0)
        assert data["mean"][name] == mean.tolist()
    assert data["mean"]["kendall_before"] == np.mean([run.kendall_before for run in runs])
    assert data["mean"]["distance"] is None
    assert (data["reality"], data["task"], data["picture"]) == ("soft", "directed", None)


def test_the_table_says_what_json_says(here, capsys):
    command = ("--method", "simulator_top", "--tests", "6", "--no-picture")
    data = json.loads(said(capsys, *command, "--json"))
    lines = said(capsys, *command).splitlines()
    for line, at in zip(lines[3:7], (1, 2, 5, 6), strict=True):
        tests, regret, in_class, *recommended = line.split()
        assert tests == str(at)
        assert regret == f"{data['mean']['regret'][at - 1]:.2f}"
        assert in_class == f"{data['mean']['class_regret'][at - 1]:.2f}"
        assert [int(one) for one in recommended] == [
            row["recommended"][at - 1] for row in data["runs"]
        ]
    text = "\n".join(lines)
    mean = data["mean"]
    error = f"{mean['heading_error_before']:.0f} deg for the simulator"
    assert error in text
    assert f"off by {mean['distance']:.2f} of the distance that designs travel" in text
    assert "specified      no" in text


def test_a_heading_or_the_other_task_is_one_run(here, capsys):
    command = ("--method", "simulator_top", "--tests", "3", "--no-picture")
    text = said(capsys, *command, "--heading", "-45")
    assert text.startswith("simulator_top in reversal, directed along 315 degrees; seed 0\n")
    (row,) = json.loads(said(capsys, *command, "--heading", "-45", "--json"))["runs"]
    run = transfer("simulator_top", heading=-45.0, tests=3)
    assert (row["heading"], row["regret"]) == (315.0, run.regret.tolist())
    text = said(capsys, *command, "--task", "displacement")
    assert text.startswith("simulator_top in reversal, displacement; seed 0\n")
    (row,) = json.loads(said(capsys, *command, "--task", "displacement", "--json"))["runs"]
    assert row["heading"] is None


@pytest.mark.parametrize(
    "options", [("--heading", "90"), ("--task", "displacement"), ("--tests", "1")], ids=str
)
def test_there_is_a_picture_of_every_kind_of_run(options, here, capsys):
    said(capsys, "--method", "random", "--tests", "3", *options, "--out", "p.png")
    assert pixels((here / "p.png").read_bytes()).std() > 10


def test_noise_options_and_budgets_reach_the_run(here, capsys):
    command = ("--method", "ite", "--tests", "3", "--heading", "0", "--no-picture", "--json")
    plain = json.loads(said(capsys, *command))
    noisy = json.loads(said(capsys, *command, "--noise", "0.3", "--simulations", "6561"))
    assert plain["runs"][0]["rewards"][0] != noisy["runs"][0]["rewards"][0]
    other = json.loads(said(capsys, *command, "--option", "kernel=behaviour"))
    assert other["options"] == {"kernel": "behaviour"}
    run = transfer("ite", heading=0, tests=3, kernel="behaviour")
    assert other["runs"][0]["tested"] == run.tested.tolist()


def test_a_method_that_ends_early_says_so(here, capsys):
    command = ("--method", "ite", "--reality", "clamp", "--option", "stop=0.9", "--heading", "0")
    text = said(capsys, *command, "--no-picture")
    assert "ended          by the method, after 1 of 20 tests" in text


def test_only_a_picture_that_was_named_is_protected(here, capsys):
    command = ("--method", "random", "--tests", "1", "--heading", "0")
    for _ in range(2):
        said(capsys, *command)
    said(capsys, *command, "--out", "mine.png")
    assert main(["transfer", *command, "--out", "mine.png"]) == 2
    assert "--out mine.png exists; choose another, or replace it with --force" in (
        capsys.readouterr().err
    )
    said(capsys, *command, "--out", "mine.png", "--force")
    assert {path.name for path in here.iterdir()} == {"mine.png", "transfer-random-reversal-0.png"}


def test_designs_that_diverge_in_reality_are_told(here, monkeypatch, capsys):
    monkeypatch.setenv("SOFTVOX_CACHE", str(here / "cache"))
    wild = Reality("wild", {"preset": "published", "duration": 0.3, "strain": 150.0})
    monkeypatch.setattr("softvox_search.cli.transfer.reality", lambda _: wild)
    command = ("--method", "random", "--tests", "1", "--heading", "0", "--no-picture")
    lost = int(wild.landscape()["diverged"].sum())
    assert lost > 0
    told = f"diverged       {lost} designs in wild; their reward is 0"
    assert told in said(capsys, *command).splitlines()
    assert json.loads(said(capsys, *command, "--json"))["diverged"] == lost


def test_the_methods_are_listed_with_a_sentence_each_and_their_options(capsys):
    text = said(capsys, "--list")
    assert max(map(len, text.splitlines())) <= 80
    heads = [line.split()[0] for line in text.splitlines() if not line.startswith(" ")]
    assert heads == list(METHODS)
    listed = json.loads(said(capsys, "--list", "--json"))
    assert [entry["name"] for entry in listed] == heads
    for entry in listed:
        if entry["needs"] is None:
            assert entry["about"] in " ".join(text.split())
            assert entry["options"] == json.loads(json.dumps(REGISTRY.options_of(entry["name"])))


MINE = """\
import numpy as np
from softvox_search.transfer import Method

print("imported")

class Odd(Method):
    def __init__(self, simulator, task, rng, *, how=""):
        print("made")
        if how == "not made":
            raise RuntimeError("no luck\\nat all")
        super().__init__(simulator, task, rng)
        self.how = how

    def ask(self):
        print("asked")
        if self.how == "raises":
            raise OSError("no luck\\nat all")
        if self.how == "value":
            raise ValueError("no luck\\nat all")
        if self.how == "exits":
            raise SystemExit(0)
        if self.how == "missing":
            import no_such_library
        if self.how == "spends":
            self.simulator.displacement(range(9))
        if self.how == "same":
            return 5
        if self.how == "end":
            return None
        return 6561 if self.how == "asks" else len(self.tests)

    def recommend(self):
        return "best" if self.how == "recommends" else super().recommend()
"""

OWN = ("transfer", "--method", "mine:Odd", "--tests", "2", "--heading", "0", "--no-picture")


def test_what_a_method_prints_does_not_spoil_the_json(tmp_path):
    (tmp_path / "mine.py").write_text(MINE)
    done = softvox(*OWN, "--json", cwd=tmp_path)
    assert json.loads(done.stdout)["runs"][0]["tested"] == [0, 1]
    assert {"imported", "made", "asked"} == set(done.stderr.split())


@pytest.fixture
def own(here):
    (here / "mine.py").write_text(MINE)
    sys.modules.pop("mine", None)
    yield here
    sys.modules.pop("mine", None)


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ("not made", "RuntimeError: no luck at all"),
        ("raises", "OSError: no luck at all"),
        ("value", "ValueError: no luck at all"),
        ("exits", "SystemExit: 0"),
    ],
)
def test_what_a_method_raises_is_shown_and_summed_up_in_a_line(how, message, own, capsys):
    status = main([*OWN, "--option", f"how={how}", "--quiet"])
    out, err = capsys.readouterr()
    assert (status, out) == (1, "")
    assert "Traceback" in err
    assert 'mine.py", line' in err
    assert err.splitlines()[-1] == f"softvox: error: method mine:Odd raised {message}"


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ("asks", "method mine:Odd asked for an invalid design of 2x2x2"),
        ("recommends", "method mine:Odd recommended an invalid design of 2x2x2"),
        ("same", "method mine:Odd asked for design 5 a second time, which would show the same"),
        ("end", "method mine:Odd tested no design at all"),
        ("missing", "method mine:Odd needs no_such_library: pip install no_such_library"),
        ("spends", "the simulator was asked for 9 designs, with 8 of 8 simulations left"),
    ],
)
def test_a_method_that_breaks_the_rules_is_named_in_one_line(how, message, own, capsys):
    status = main([*OWN, "--option", f"how={how}", "--simulations", "8"])
    out, err = capsys.readouterr()
    assert (status, out) == (2, "")
    told = [line for line in err.splitlines() if line not in ("imported", "made", "asked")]
    assert len(told) == 1
    assert told[0].startswith(f"softvox: error: {message}")


BAD = {
    "--reality revrsal": "--reality: no reality 'revrsal'; did you mean reversal?",
    "--reality public-30": "public-0 to public-29",
    "--task direct": "--task: no task 'direct'; did you mean directed?",
    "--method itee": "--method itee: there is no method 'itee'; did you mean 'ite'?",
    "--method no_such:Thing": "no module 'no_such'",
    "--method os:path": "module os has no class or function 'path'",
    "--method numpy:ndarray": "method numpy:ndarray lacks ask, tell, recommend; see",
    "--heading inf": "--heading: heading must be finite",
    "--heading nan": "--heading: heading must be finite",
    "--heading north": "--heading",
    "--heading 90 --task displacement": "--heading: the task displacement has no heading",
    "--tests 6562": "--tests must be at most 6561, the designs there are, got 6562",
    "--tests 0": "--tests: must be a whole number above 0",
    "--tests -3": "--tests",
    "--seed -1": "--seed",
    "--noise -1": "--noise must be finite and at least 0",
    "--noise inf": "--noise must be finite",
    "--simulations 6560": "with 6560 of 6560 simulations left; give more simulations",
    "--simulations -1": "--simulations",
    "--option kernal=hamming": "has no option 'kernal'; its options are: kernel, prior",
    "--option kernel=edit": "--method ite: kernel must be hamming or behaviour, got 'edit'",
    "--option kernel": "--option must be KEY=VALUE",
    "--option task=3": "has no option 'task'; its options are: kernel",
    "--option tests=3": "has no option 'tests'; its options are: kernel",
    "--method simopt --option kernel=1": "has no option 'kernel'; its options are: draws",
    "--out p.jpg": "--out must end in .png",
    "--out old.png": "--out old.png exists",
    "--out no/p.png": "--out no is not a folder",
    "--realty soft": "did you mean --reality?",
}


@pytest.mark.parametrize("options", BAD)
def test_bad_input_is_one_line_naming_the_mend_and_nothing_is_written(options, here, capsys):
    (here / "old.png").touch()
    status = main(["transfer", *options.split()])
    out, err = capsys.readouterr()
    assert (status, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert err.startswith("softvox: error: ")
    assert BAD[options] in err
    assert [path.name for path in here.iterdir()] == ["old.png"]


@pytest.mark.parametrize(
    ("method", "module", "message"),
    [
        ("gp_ucb", "sklearn", "method gp_ucb needs scikit-learn: pip install scikit-learn"),
        ("transferability", "deap", "method transferability needs deap: pip install deap"),
    ],
)
def test_a_library_that_is_missing_is_named(method, module, message, here, monkeypatch, capsys):
    for name in [name for name in sys.modules if name.partition(".")[0] == module]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)
    for name in ("softvox_search.evolution", "softvox_search.transfer.methods.transferability"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    assert main(["transfer", "--method", method, "--tests", "6", "--no-picture"]) == 2
    assert capsys.readouterr().err == f"softvox: error: {message}\n"


def test_without_matplotlib_the_table_can_be_had(here, monkeypatch, capsys):
    for name in [name for name in sys.modules if name.partition(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    for name in ("style", "crossing"):
        monkeypatch.delitem(sys.modules, f"softvox_search.report.{name}", raising=False)
    command = ("--method", "random", "--tests", "1", "--heading", "0")
    assert main(["transfer", *command]) == 2
    assert "the picture needs matplotlib: pip install matplotlib; or give --no-picture" in (
        capsys.readouterr().err
    )
    said(capsys, *command, "--no-picture")


# The page.


def blocks(language):
    text = DOC.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.M | re.S)


@pytest.fixture
def stranger(tmp_path):
    (mine,) = (block for block in blocks("python") if "class Doubter" in block)
    (tmp_path / "mine.py").write_text(mine, encoding="utf-8")
    return tmp_path


def test_ones_own_methods_take_ten_lines(stranger):
    for kind in ("class", "def both"):
        text = (stranger / "mine.py").read_text(encoding="utf-8")
        own = re.search(rf"^{kind}.*?(?=\n\n\n|\Z)", text, re.M | re.S).group()
        assert len(own.splitlines()) <= 10


@pytest.mark.parametrize("name", ["Doubter", "both_ends"])
def test_ones_own_method_runs_and_can_be_trusted(name, stranger):
    command = f"softvox transfer --method mine:{name} --tests 20"
    assert command.replace("both_ends", "Doubter") in DOC.read_text(encoding="utf-8")
    done = softvox(*command.split()[1:], cwd=stranger)
    assert done.returncode == 0, done.stderr
    assert (stranger / f"transfer-{name}-reversal-0.png").exists()
    (code,) = re.findall(r'python -c "(.*)"', DOC.read_text(encoding="utf-8"))
    done = subprocess.run(
        [sys.executable, "-c", code.replace("Doubter", name)],
        cwd=stranger,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_the_page_drives_a_method_by_hand_to_what_a_run_gives():
    (driven,) = (block for block in blocks("python") if "method.tell" in block)
    done = subprocess.run(
        [sys.executable, "-c", driven], capture_output=True, text=True, check=True
    )
    first, second = done.stdout.splitlines()
    assert first == second.split()[0]


def test_the_page_lists_every_method():
    listed = re.findall(r"^\| `(\w+)` \|", DOC.read_text(encoding="utf-8"), re.M)
    assert sorted(listed) == sorted(METHODS)
