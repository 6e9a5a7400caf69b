import os

import pytest

from softvox_gym import engine, processors


@pytest.fixture
def machine(monkeypatch, tmp_path):
    """A machine of eight processors without limits; gives a function that adds files to it."""
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: range(8), raising=False)
    monkeypatch.setattr(processors, "CGROUPS", tmp_path / "groups")
    monkeypatch.setattr(processors, "OWN_CGROUPS", tmp_path / "own")
    monkeypatch.delenv("SLURM_CPUS_PER_TASK", raising=False)

    def write(**files):
        for name, text in files.items():
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)

    return write


def test_without_limits_it_is_the_affinity(machine):
    assert engine.default_threads() == 8


@pytest.mark.parametrize(
    ("own", "limit", "expected"),
    [
        ("50000 100000\n", None, 1),
        ("150000 100000\n", None, 2),
        ("300000 100000\n", None, 3),
        ("max 100000\n", None, 8),
        ("max 100000\n", "200000 100000\n", 2),
        ("900000 100000\n", None, 8),
        ("nonsense\n", None, 8),
    ],
)
def test_a_limit_of_its_own_group_or_one_above_holds_rounded_up(machine, own, limit, expected):
    machine(**{"own": "0::/user/job\n", "groups/user/job/cpu.max": own})
    if limit:
        machine(**{"groups/user/cpu.max": limit})
    assert engine.default_threads() == expected


def test_a_containers_group_is_the_root_that_it_sees(machine):
    machine(**{"own": "0::/\n", "groups/cpu.max": "50000 100000\n"})
    assert engine.default_threads() == 1


@pytest.mark.parametrize(("quota", "expected"), [("50000", 1), ("250000", 3), ("-1", 8)])
def test_control_groups_of_version_1_have_two_files(machine, quota, expected):
    machine(
        **{
            "own": "3:cpuset:/job\n1:cpu,cpuacct:/job\n0::/\n",
            "groups/cpu/job/cpu.cfs_quota_us": quota + "\n",
            "groups/cpu/job/cpu.cfs_period_us": "100000\n",
        }
    )
    assert engine.default_threads() == expected


@pytest.mark.parametrize(("tasks", "expected"), [("1", 1), ("3", 3), ("99", 8), ("", 8), ("x", 8)])
def test_slurms_share_holds(machine, monkeypatch, tasks, expected):
    monkeypatch.setenv("SLURM_CPUS_PER_TASK", tasks)
    assert engine.default_threads() == expected
