import csv
import json

import numpy as np
import pytest
from cli_process import snapshot, softvox

from softvox_gym import Physics, simulate
from softvox_gym.landscapes.analysis import analyse

#: One cycle, so that all designs take a second.
SHORT = ("--duration", "0.5")

FILES = {
    "landscape.csv",
    "manifest.json",
    "analysis.json",
    "analysis.md",
    "local_optima.csv",
    "neighbours.csv",
    "classes.csv",
}


@pytest.fixture(scope="module")
def analysed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("analysed")
    done = softvox("landscape", "--analyse", "--out", "out", *SHORT, cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder / "out", done


def test_the_analysis_is_of_the_landscape_just_simulated(analysed):
    folder, done = analysed
    published = Physics.of({"preset": "published", "duration": 0.5})
    expected = analyse(simulate(np.arange(6561), published).fitness)
    assert expected.text() in done.stdout
    read = json.loads((folder / "analysis.json").read_text())
    assert read.items() >= json.loads(json.dumps(expected.to_dict())).items()


def test_all_files_are_written_and_named_and_belong_together(analysed):
    folder, done = analysed
    assert set(snapshot(folder)) == FILES
    last = done.stdout.splitlines()[-1]
    assert last.startswith("wrote into out: ")
    assert set(last.removeprefix("wrote into out: ").split(", ")) == FILES
    read = json.loads((folder / "analysis.json").read_text())
    manifest = json.loads((folder / "manifest.json").read_text())
    assert read["digest"] == manifest["digest"]
    assert "--analyse" in manifest["arguments"]


def test_the_tables_are_of_the_same_landscape(analysed):
    folder, _ = analysed
    with (folder / "landscape.csv").open(newline="") as file:
        fitness = [row["fitness"] for row in csv.DictReader(file)]
    with (folder / "neighbours.csv").open(newline="") as file:
        assert [row["fitness"] for row in csv.DictReader(file)] == fitness
    with (folder / "local_optima.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            assert fitness[int(row["design"])] == row["fitness"]


def test_without_the_option_the_same_landscape_is_written_and_nothing_more(analysed, tmp_path):
    folder, done = analysed
    plain = softvox("landscape", "--out", "out", *SHORT, cwd=tmp_path)
    assert set(snapshot(tmp_path / "out")) == {"landscape.csv", "manifest.json"}
    assert (tmp_path / "out" / "landscape.csv").read_bytes() == (
        folder / "landscape.csv"
    ).read_bytes()
    assert "Analysis" not in plain.stdout
    assert plain.stdout.splitlines()[-1] == "wrote into out: landscape.csv, manifest.json"
    assert plain.stdout.splitlines()[:11] == done.stdout.splitlines()[:11]


def test_an_analysed_landscape_survives_unless_forced(analysed):
    folder, _ = analysed
    before = snapshot(folder)
    refused = softvox("landscape", "--analyse", "--out", "out", *SHORT, cwd=folder.parent)
    assert refused.returncode == 2
    assert refused.stderr.startswith("softvox: error: --out out is not empty")
    assert "--force" in refused.stderr
    assert snapshot(folder) == before

    forced = softvox(
        "landscape", "--analyse", "--force", "--out", "out", "--duration", "0.3", cwd=folder.parent
    )
    assert forced.returncode == 0
    after = snapshot(folder)
    assert set(after) == FILES
    assert all(after[name] != before[name] for name in FILES)


def test_a_folder_in_the_place_of_a_file_is_refused_before_the_work(tmp_path):
    (tmp_path / "out" / "analysis.md").mkdir(parents=True)
    done = softvox(
        "landscape", "--analyse", "--force", "--out", "out", "--duration", "9", cwd=tmp_path
    )
    assert done.returncode == 2
    assert "out/analysis.md is a folder" in done.stderr
    assert set(snapshot(tmp_path / "out")) == {"analysis.md"}


def test_designs_that_diverge_count_as_zero_and_are_told(tmp_path):
    wild = ("--strain", "150", "--duration", "0.3")
    done = softvox("landscape", "--analyse", *wild, "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["n_diverged"] > 0
    assert f"{manifest['n_diverged']} diverged count as 0" in done.stdout
    read = json.loads((tmp_path / "out" / "analysis.json").read_text())
    assert read["n_diverged"] == manifest["n_diverged"]
