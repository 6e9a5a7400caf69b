"""The landscape of any physics, simulated once and kept."""

import os
import pickle
from pathlib import Path

import numpy as np
import pytest

import softvox_gym
from softvox_gym import Physics, landscape, simulate
from softvox_gym.landscapes import table as tables
from softvox_gym.landscapes.cache import cache_path
from softvox_gym.landscapes.table import Table

#: A cycle at a tenth of the gravity, so that all designs take a second; some diverge.
BRIEF = {"preset": "published", "duration": 0.5, "gravity": -0.981}


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """A cache folder that is not there yet, and nothing remembered."""
    monkeypatch.setenv("SOFTVOX_CACHE", str(tmp_path / "cache"))
    tables._landscape.cache_clear()
    yield tmp_path / "cache"
    tables._landscape.cache_clear()


@pytest.fixture
def counted(monkeypatch):
    """The physics that were simulated; by a stand-in that takes no time."""
    seen = []

    def compute(reality):
        seen.append(reality.physics)
        made = landscape().copy()
        made["dx"], made["dy"] = float(reality.physics.friction_static), 0.0
        made["fitness"], made["step_error"] = made["dx"], np.nan
        return Table.of(np.asarray(made), reality.physics)

    monkeypatch.setattr(tables, "compute", compute)
    return seen


def forget():
    tables._landscape.cache_clear()


def test_another_physics_has_the_same_columns_and_what_the_engine_makes_of_it(cache):
    table = landscape(BRIEF)
    result = simulate(np.arange(6561), Physics.of(BRIEF))
    assert table.dtype == landscape().dtype
    assert table["fitness"].tobytes() == result.fitness.tobytes()
    assert np.array_equal(table["diverged"], result.diverged)
    assert np.array_equal(table["steps"], result.steps)
    assert table.physics == Physics.of(BRIEF)
    forget()
    again = landscape(BRIEF)
    assert (again.tobytes(), again.physics) == (table.tobytes(), table.physics)
    (kept,) = cache.iterdir()
    columns = [table[name] for name in ("dx", "dy", "dz", "steps")]
    assert np.load(kept).tobytes() == np.stack(columns, axis=-1).tobytes()  # numpy reads it


def test_it_is_simulated_once_and_then_read(counted, cache):
    first = landscape({"friction_static": 3})
    forget()
    assert landscape({"friction_static": 3.0}).tobytes() == first.tobytes()
    assert len(counted) == 1
    landscape({"friction_static": 4})
    assert len(counted) == len(list(cache.iterdir())) == 2


def test_the_shipped_table_needs_no_cache(counted, cache):
    assert landscape(Physics.published()).tobytes() == landscape("published").tobytes()
    assert counted == []
    assert not cache.exists()


@pytest.mark.parametrize("damage", ["flip", "cut", "empty", "swap"])
def test_a_damaged_file_is_simulated_anew_and_replaced(counted, damage):
    whole = landscape({"friction_static": 3}).tobytes()
    path = cache_path(Physics.of({"friction_static": 3}))
    content = bytearray(path.read_bytes())
    if damage == "flip":
        content[len(content) // 2] ^= 1
    elif damage == "cut":
        del content[-100:]
    elif damage == "empty":
        content.clear()
    else:  # what was kept for another physics
        landscape({"friction_static": 4})
        content = cache_path(Physics.of({"friction_static": 4})).read_bytes()
    path.write_bytes(content)
    forget()
    counted.clear()
    assert landscape({"friction_static": 3}).tobytes() == whole
    assert len(counted) == 1
    forget()
    landscape({"friction_static": 3})
    assert len(counted) == 1


@pytest.mark.parametrize("obstacle", ["file", "folder in its place", "nobody's home"])
def test_a_cache_that_can_not_be_written_is_done_without(counted, tmp_path, monkeypatch, obstacle):
    if obstacle == "file":
        (tmp_path / "cache").write_text("mine")
    elif obstacle == "folder in its place":
        cache_path(Physics.exact()).mkdir(parents=True)
    else:
        monkeypatch.delenv("SOFTVOX_CACHE")
        monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
        monkeypatch.setattr(Path, "home", lambda: (_ for _ in ()).throw(RuntimeError("no home")))
    assert len(landscape("exact")) == 6561
    assert len(counted) == 1


def test_the_name_depends_on_the_values_and_on_the_engines_bits(monkeypatch):
    names = {cache_path(Physics.of(physics)) for physics in ("exact", "published", BRIEF)}
    assert len(names) == 3
    monkeypatch.setattr("softvox_gym.landscapes.cache.engine_probe", lambda: "another engine")
    assert cache_path(Physics.exact()) not in names


@pytest.mark.parametrize(
    ("variables", "platform", "folder"),
    [
        ({"SOFTVOX_CACHE": "/mine"}, "linux", "/mine"),
        ({"XDG_CACHE_HOME": "/xdg"}, "linux", "/xdg/softvox-gym"),
        ({"XDG_CACHE_HOME": "relative"}, "linux", "/home/me/.cache/softvox-gym"),
        ({}, "linux", "/home/me/.cache/softvox-gym"),
        ({"XDG_CACHE_HOME": "/xdg"}, "darwin", "/home/me/Library/Caches/softvox-gym"),
    ],
)
def test_the_folder_is_the_users_own(monkeypatch, variables, platform, folder):
    for name in ("SOFTVOX_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(tables.sys, "platform", platform)
    monkeypatch.setattr(Path, "home", lambda: Path("/home/me"))
    assert os.fspath(cache_path(Physics.exact()).parent) == folder


def test_parameters_that_are_arrays_are_refused():
    with pytest.raises(ValueError, match="single numbers"):
        landscape({"friction_static": np.ones(6561)})
    with pytest.raises(ValueError, match="presets are"):
        landscape("newton")


def test_a_table_shows_itself_at_the_prompt_and_in_a_notebook():
    shown = repr(landscape()).splitlines()
    assert shown[0].split()[:3] == ["design", "digits", "voxels"]
    assert [line.split()[0] for line in shown[1:]] == [
        "0", "1", "2", "3", "4", "...", "6556", "6557", "6558", "6559", "6560", "[6561",
    ]  # fmt: skip
    html = landscape()._repr_html_()
    assert html.count("<tr>") == 12
    assert "<td>22222222</td>" in html
    assert "6453" not in repr(softvox_gym.noisy_landscape(1))


def test_its_columns_and_rows_are_plain_arrays():
    table = landscape()
    assert (
        type(table["fitness"]) is type(table[:3]) is type(table[table["fitness"] > 4]) is np.ndarray
    )
    assert table[6453]["digits"] == "00021222"
    assert repr(table.reshape(3, -1)).startswith("array(")


def test_a_copy_and_a_pickle_know_their_physics():
    table = landscape()
    for other in (table.copy(), pickle.loads(pickle.dumps(table))):
        assert isinstance(other, Table)
        assert other.physics == Physics.published()
        assert other.tobytes() == table.tobytes()
