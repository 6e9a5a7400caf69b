import errno
import fcntl
import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from small_experiments import COMMAND, NOISY, SMALL, experiment_of, results, run_here

from softvox_gym.cli.terminal import BadInputError
from softvox_search.cli.results import needs, writing
from softvox_search.experiment import results as folders
from softvox_search.experiment.results import ResultsError, decode, encode, locked, read
from softvox_search.experiment.schema import UsageError


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    folder = tmp_path_factory.mktemp("small")
    experiment = experiment_of(folder, SMALL)
    run_here(experiment, folder / "out")
    return experiment, folder / "out"


@pytest.fixture
def out(small, tmp_path):
    return shutil.copytree(small[1], tmp_path / "out")


def test_what_cannot_be_read_meanwhile_is_named():
    error = PermissionError(errno.EACCES, "Permission denied", "theirs/manifest.json")
    told = r"^theirs/manifest\.json: Permission denied; finished work is kept"
    with pytest.raises(BadInputError, match=told), writing(Path("mine")):
        raise error


def test_all_libraries_that_are_missing_are_named_at_once(monkeypatch):
    for name in ("msgspec", "pyarrow"):
        monkeypatch.setitem(sys.modules, name, None)
    told = "compare needs msgspec and pyarrow: pip install msgspec pyarrow"
    with pytest.raises(BadInputError, match=told), needs("compare"):
        raise ModuleNotFoundError(name="msgspec")


def test_a_run_is_read_back_to_the_bit():
    columns = {
        "sequence": np.arange(1, 4, dtype="<i4"),
        "unique_sequence": np.array([1, 1, 2], dtype="<i4"),
        "design": np.array(["0" * 40, "1" * 40, "2" * 40]),
        "fitness": np.array([0.1, np.nan, -0.0]),
        "noise_seed": np.array([-1, 2**62, 0]),
        "cached": np.array([False, True, False]),
    }
    summary, table = decode(encode("id", {"level": None, "believed": 0.1 + 0.2}, columns), "id")
    assert summary == {"level": None, "believed": 0.1 + 0.2}
    for name, column in columns.items():
        np.testing.assert_array_equal(table[name].to_numpy(), column)
    assert np.signbit(table["fitness"].to_numpy()[2])


def test_a_flipped_bit_anywhere_in_a_runs_file_is_found():
    columns = {"sequence": np.arange(5), "unique_sequence": np.arange(5), "dx": np.ones(5)}
    content = encode("id", {"seed": 0}, columns)
    for place in range(len(content)):
        flipped = bytearray(content)
        flipped[place] ^= 1 << place % 8
        with pytest.raises(ValueError, match="is damaged"):
            decode(bytes(flipped), "id")
    for size in range(0, len(content), 7):
        with pytest.raises(ValueError, match="is damaged"):
            decode(content[:size], "id")
    with pytest.raises(ValueError, match="is another run's"):
        decode(content, "di")


@pytest.mark.parametrize("damage", ["flipped", "cut", "empty", "another's", "gone"])
def test_a_damaged_run_is_set_aside_named_and_done_again_and_no_other(damage, small, out):
    victim, other = sorted((out / "runs").iterdir())[2:4]
    content, times = bytearray(victim.read_bytes()), {}
    content[len(content) // 2] ^= 1
    made = {"flipped": bytes(content), "cut": bytes(content[:100]), "empty": b""}
    if damage == "gone":
        victim.unlink()
    else:
        victim.write_bytes(made.get(damage, other.read_bytes()))
    for path in (out / "runs").iterdir():
        times[path] = path.stat().st_mtime_ns
    run = next(run for run in read(out).runs["run"] if run.startswith(victim.stem))
    with pytest.raises(ResultsError) as caught:
        read(out).evaluations(run)
    assert str(caught.value).startswith(f"{victim}: ")
    assert str(caught.value).endswith(f"; {COMMAND} --out {out} makes it again")

    outcome, said, here = run_here(small[0], out)
    assert (outcome.before, len(here.runs) - outcome.repeated) == (6, 1)
    if damage != "gone":
        (message,) = said
        assert f"{victim} is " in message
        assert f"set aside as {victim.stem}.damaged" in message
        (out / "runs" / f"{victim.stem}.damaged").unlink()
    assert results(out) == results(small[1])
    assert all(path.stat().st_mtime_ns == t for path, t in times.items() if path != victim)


def test_the_reader_gives_numbers_texts_budgets_and_problems(small, tmp_path):
    found = read(small[1])
    assert (found.title, found.command) == ("exp", COMMAND)
    assert found.runs["searcher"].tolist() == ["exhaustive"] + ["random"] * 3 + ["with"] * 3
    assert set(found.runs["physics"]) == {"published"}
    assert set(found.runs["shape"]) == {"2x2x2"}
    assert found.runs["level"].isna().all()
    for name in ("seed", "unique", "evaluations", "steps", "recommended"):
        assert found.runs[name].dtype == np.int64
    assert all((found.folder / path).is_file() for path in found.runs["file"])
    assert found.budgets["with"]["unique"] == 20
    assert found.budgets["with"]["evaluations"] == 30
    assert found.budgets["random"]["evaluations"] == 20 * 60
    (problem,) = found.problems
    assert (problem.physics, problem.shape, problem.level) == ("published", (2, 2, 2), None)
    run_here(experiment_of(tmp_path, NOISY), tmp_path / "noisy")
    noisy = read(tmp_path / "noisy").runs
    assert noisy["level"].tolist() == [0.0] * 4 + [1.0] * 4
    assert noisy["policy"].tolist() == ["naive", "naive", "mean", "mean"] * 2


def test_labels_are_text_and_large_designs_are_digits(small, out):
    table = (out / "runs.csv").read_text(encoding="utf-8")
    digits = "012" * 14
    lines = table.splitlines()
    cells = lines[1].split(",")
    cells[1], cells[11] = "nan", digits
    text = "\n".join([lines[0], ",".join(cells), *lines[2:]]) + "\n"
    (out / "runs.csv").write_text(text, encoding="utf-8")
    manifest = json.loads((out / "manifest.json").read_text())
    manifest["files"]["runs.csv"] = folders.file_digest(out / "runs.csv")
    (out / "manifest.json").write_text(json.dumps(manifest))
    runs = read(out).runs
    assert runs["searcher"][0] == "nan"
    assert runs["recommended"][0] == digits
    assert isinstance(runs["recommended"][1], int)


MANIFESTS = {
    "lacks": "manifest.json is damaged: Object missing required field `failed`",
    "list": "manifest.json is damaged: Expected `object`, got `array`",
    "text": "manifest.json is damaged: ",
    "type": "manifest.json is damaged: Expected `array`, got `int` - at `$.failed`",
}


@pytest.mark.parametrize("damage", MANIFESTS)
def test_a_damaged_manifest_is_said_to_be_and_written_again(damage, small, out):
    path = out / "manifest.json"
    manifest = json.loads(path.read_text())
    if damage == "lacks":
        del manifest["failed"]
    if damage == "type":
        manifest["failed"] = 3
    path.write_text({"list": "[3]", "text": "{"}.get(damage) or json.dumps(manifest))
    for use in (read, lambda folder: run_here(small[0], folder)):
        with pytest.raises(ResultsError) as caught:
            use(out)
        assert MANIFESTS[damage] in str(caught.value)
        assert "remove it, and softvox compare" in str(caught.value)
    path.unlink()
    with pytest.raises(ResultsError, match="results are not finished; softvox compare FILE"):
        read(out)
    _, _, here = run_here(small[0], out)
    assert here.runs == []
    assert read(out).title == "exp"


@pytest.mark.parametrize("damage", ["gone", "cut"])
def test_a_changed_summary_is_not_read_and_is_written_again_from_the_runs(damage, small, out):
    content = (out / "runs.csv").read_bytes()
    (out / "runs.csv").unlink()
    if damage == "cut":
        (out / "runs.csv").write_bytes(content[:-5])
    with pytest.raises(ResultsError, match=r"runs\.csv is not as it was written; softvox compare"):
        read(out)
    run_here(small[0], out)
    assert results(out) == results(small[1])


def test_two_at_once_in_one_folder_are_refused_and_parts_are_not(small, tmp_path):
    with locked(tmp_path, print, shared=False):
        with pytest.raises(UsageError, match="being written by another process"):
            run_here(small[0], tmp_path)
        with (
            pytest.raises(UsageError, match="another process"),
            locked(tmp_path, print, shared=True),
        ):
            pass
    with locked(tmp_path, print, shared=True), locked(tmp_path, print, shared=True):
        pass


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_a_file_system_without_locks_is_a_warning(number, small, tmp_path, monkeypatch):
    def flock(*_):
        raise OSError(number, "not here")

    monkeypatch.setattr(fcntl, "flock", flock)
    _, said, _ = run_here(small[0], tmp_path / "out")
    assert len(said) == 1
    assert "without locks (not here)" in said[0]
    assert results(tmp_path / "out") == results(small[1])


def test_what_a_killed_process_left_half_written_is_cleared_away(small, out):
    (out / "runs" / ".0123.parquet.partial-45").write_bytes(b"half")
    run_here(small[0], out)
    assert results(out) == results(small[1])
