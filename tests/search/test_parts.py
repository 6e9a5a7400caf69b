"""Parts of an experiment, side by side, and put together again."""

import shutil
import subprocess

import pytest
from cli_process import COMMAND, softvox
from small_experiments import SMALL, experiment_of, results, run_here

from softvox_search.experiment.compare import merge, part_of
from softvox_search.experiment.results import read, read_manifest
from softvox_search.experiment.schema import UsageError

OTHER = SMALL.replace("entropy = 1", "entropy = 2")


def parts(folder, text=SMALL, n=2):
    folder.mkdir(exist_ok=True)
    experiment = experiment_of(folder, text)
    for k in range(1, n + 1):
        run_here(experiment, folder / f"part{k}", part=(k, n))
    return [folder / f"part{k}" for k in range(1, n + 1)]


def merged(folders, out):
    said = []
    out.mkdir(exist_ok=True)
    outcome = merge(folders, out, say=said.append)
    return outcome, said


@pytest.mark.parametrize("shared", [False, True])
def test_two_parts_side_by_side_and_merged_are_the_bytes_of_one_run(shared, tmp_path):
    (tmp_path / "exp.toml").write_text(SMALL)
    outs = ["both", "both"] if shared else ["one", "two"]
    processes = [
        subprocess.Popen(
            [*COMMAND, "compare", "exp.toml", "--part", f"{k}/2", "--out", out, "--workers", "1"],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for k, out in enumerate(outs, start=1)
    ]
    done = 0
    for process in processes:
        out, err = process.communicate(timeout=100)
        assert (process.returncode, err) == (0, "")
        assert "no report on a part; softvox merge" in out
        done += int(out.split(": ")[1].split(" of ")[0])
    assert done == 7
    joined = softvox("merge", *dict.fromkeys(outs), "--out", "all", "--no-report", cwd=tmp_path)
    assert (joined.returncode, joined.stderr) == (0, "")
    assert "7 of 7 runs are in all" in joined.stdout
    run_here(experiment_of(tmp_path, SMALL), tmp_path / "whole")
    assert results(tmp_path / "all") == results(tmp_path / "whole")
    all_, whole = read_manifest(tmp_path / "all"), read_manifest(tmp_path / "whole")
    assert all_ == whole


def test_parts_are_disjoint_and_together_all():
    names = [f"{i:03}" for i in range(50)]
    for n in (1, 3, 16, 60):
        found = [part_of(names, (k, n)) for k in range(1, n + 1)]
        assert sum(map(len, found)) == 50
        assert set().union(*found) == set(names)
        assert max(map(len, found)) - min(map(len, found)) <= 1


def test_a_missing_part_is_named_with_the_command_that_makes_it(tmp_path):
    one, two = parts(tmp_path)
    outcome, _ = merged([one], tmp_path / "all")
    assert (outcome.total, outcome.missing) == (7, 3)
    assert not (tmp_path / "all" / "runs.csv").exists()
    done = softvox("merge", str(one), "--out", "again", cwd=tmp_path)
    assert done.returncode == 1
    assert "3 runs are missing; softvox compare exp.toml --out again does them" in done.stderr
    for folder in (one, tmp_path / "all"):
        with pytest.raises(UsageError, match="only a part of the results; softvox merge"):
            read(folder)
    outcome, _ = merged([one, two], tmp_path / "all")
    assert (outcome.before, outcome.missing) == (4, 0)
    assert len(read(tmp_path / "all").runs) == 7


def test_a_damaged_run_is_taken_from_another_folder(tmp_path):
    (one,) = parts(tmp_path, n=1)
    two = shutil.copytree(one, tmp_path / "two")
    victim = next((one / "runs").iterdir())
    victim.write_bytes(b"")
    outcome, said = merged([one, two], tmp_path / "all")
    assert (outcome.missing, len(said)) == (0, 1)
    assert victim.name in said[0]


def test_different_experiments_and_different_results_are_not_merged(tmp_path):
    (one,) = parts(tmp_path / "1", n=1)
    (two,) = parts(tmp_path / "2", OTHER, n=1)
    with pytest.raises(UsageError, match="hold different experiments: entropy was 1, and is 2"):
        merged([one, two], tmp_path / "all")
    with pytest.raises(UsageError, match="none of which is of use here: entropy was 2, and is 1"):
        merged([one], two)


def test_forced_a_merge_into_one_of_its_parts_is_refused_and_loses_nothing(tmp_path):
    one, two = parts(tmp_path)
    before = results(one)
    with pytest.raises(UsageError, match="one of the parts, whose runs --force would throw away"):
        merge([one, two], tmp_path / "." / "part1", force=True, say=print)
    assert results(one) == before
