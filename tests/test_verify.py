from dataclasses import replace

import numpy as np
import pytest

from softvox_gym import Physics, engine, simulate, verify
from softvox_gym.data import designs, document, flags, records
from softvox_gym.verify.agreement import UNJUDGED, judge
from softvox_gym.verify.trajectories import trajectories


@pytest.fixture(scope="module")
def landscape(published_result):
    return published_result


def nudged(array, i, by):
    copy = array.copy()
    copy[i] += by
    return copy


def test_differences_within_the_tolerance_pass_and_beyond_it_fail():
    assert judge("it", [0.0, 1e-6], 1e-6).verdict == "ok"
    row = judge("it", [0.0, 2e-6], 1e-6)
    assert (row.verdict, row.agree, row.compared, row.largest) == ("FAILED", 1, 2, 2e-6)


def test_a_missing_number_fails():
    row = judge("it", [0.0, np.nan], 1e9)
    assert row.verdict == "FAILED"
    assert np.isnan(row.largest)


def test_what_is_not_judged_never_fails():
    assert judge("it", [np.nan, 5.0], 1e-6, verdicts=UNJUDGED).passed


def test_an_exception_covers_its_own_design_up_to_its_own_limit(monkeypatch):
    monkeypatch.setattr(verify, "EXCEPTIONS", {"soft": {7: (1e-3, "because")}})
    changes = {"soft": document("variants.json")["soft"]}

    def verdicts(first, second):
        found = simulate([5, 7], replace(Physics.published(), **changes["soft"]))
        rows = [
            {
                "variant": "soft",
                "design": number,
                **dict(zip(("dx", "dy", "dz"), found.displacement[i] + off, strict=True)),
                "steps": found.steps[i],
                "time_step": found.physics.time_step,
            }
            for i, (number, off) in enumerate(((5, first), (7, second)))
        ]
        return [row.verdict for row in verify.variants(changes, rows)]

    assert verdicts(0.0, 1e-4) == ["ok", "known"]
    assert verdicts(1e-4, 0.0) == ["FAILED", "known"]
    assert verdicts(0.0, 1e-2) == ["ok", "FAILED"]
    assert verdicts(0.0, np.nan) == ["ok", "FAILED"]


def test_a_fitness_off_by_a_hundredth_fails_the_published_table(landscape):
    published = records("published_top100.csv")
    assert verify.published_top100(landscape.fitness, published).verdict == "ok"
    row = verify.published_top100(nudged(landscape.fitness, 5757, 0.01), published)
    assert (row.verdict, row.agree) == ("FAILED", 99)


def test_one_flipped_bit_fails_the_digest(landscape):
    assert verify.golden(landscape.displacement).verdict == "ok"
    flipped = landscape.displacement.copy()
    flipped.view(np.uint64)[4000, 1] ^= 1
    assert verify.golden(flipped).verdict == "FAILED"


def test_one_flipped_bit_fails_every_instruction_set(landscape):
    flipped = landscape.displacement.copy()
    flipped.view(np.uint64)[40, 2] ^= 1
    rows = list(verify.instruction_sets(flipped, threads=None))
    assert [row.name for row in rows] == engine.isa_names()
    assert {row.verdict for row in rows} == {"FAILED"}


def test_every_instruction_set_is_tried_whatever_the_environment_asks_for(landscape, monkeypatch):
    monkeypatch.setenv("SOFTVOX_ISA", "portable")
    rows = list(verify.instruction_sets(landscape.displacement, threads=1))
    assert [row.name for row in rows] == engine.isa_names()
    assert all(row.passed for row in rows)


def test_each_part_of_the_landscape_sample_is_judged_by_its_own_tolerance(landscape):
    tenth = records("landscape_sample.csv")
    assert all(row.passed for row in verify.sample(landscape.displacement, tenth))

    def failed(design, by):
        moved = nudged(landscape.displacement, design, by)
        return [row.name for row in verify.sample(moved, tenth) if not row.passed]

    numbers = np.array(designs(tenth))
    linkless, sensitive = flags(tenth, "linkless"), flags(tenth, "sensitive")
    plain = numbers[~linkless & ~sensitive][0]
    assert failed(plain, 2e-7) == ["landscape sample"]
    assert failed(numbers[linkless][0], 1e-5) == []
    assert failed(numbers[linkless][0], 1e-2) == ["linkless"]
    assert failed(numbers[sensitive][0], 1e-2) == []


def test_a_variant_with_another_number_of_steps_fails():
    changes = {"soft": document("variants.json")["soft"]}
    rows = [row for row in records("variants.csv") if row["variant"] == "soft"]
    (row,) = verify.variants(changes, rows)
    assert row.verdict == "ok"
    (row,) = verify.variants(changes, [{**rows[0], "steps": "8000"}, *rows[1:]])
    assert (row.verdict, row.agree) == ("FAILED", len(rows) - 1)
    (row,) = verify.variants({"soft": {}}, rows)
    assert (row.verdict, row.agree) == ("FAILED", 0)


def test_a_lattice_that_ends_elsewhere_fails():
    cases = [case for case in document("lattices.json") if case["name"].startswith("phase222")]
    assert [row.verdict for row in verify.lattices(cases)] == ["ok"]
    moved = [{**cases[0], "dx": cases[0]["dx"] + 1e-5}, *cases[1:]]
    assert [row.agree for row in verify.lattices(moved)] == [len(cases) - 1]


def test_trajectories_agree_and_a_sensitive_one_is_only_reported():
    rows = list(trajectories({6453}, verify.TOLERANCE))
    assert [row.verdict for row in rows] == ["ok", "not judged"]
    assert not all(row.passed for row in trajectories(set(), verify.TOLERANCE))


def test_every_exception_still_belongs_to_a_design_of_the_data():
    held = {(row["variant"], int(row["design"])) for row in records("variants.csv")}
    excepted = {(name, design) for name, known in verify.EXCEPTIONS.items() for design in known}
    assert excepted <= held


def test_the_published_preset_is_what_is_verified(landscape):
    assert landscape.physics == Physics.published()
