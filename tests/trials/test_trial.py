"""One trial: what it takes, what it refuses in which words, and its file."""

import copy
import json
import pickle
import random
from dataclasses import replace
from functools import cache
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from softvox_gym import Design, Lattice
from softvox_gym.trials import Trial, TrialError
from softvox_gym.trials.trial import KEYS, LICENSES, MOST_BYTES, MOST_POINTS, PROVENANCE

NEEDED = {
    "design": 6453,
    "cycle": [0, 0.5, 1],
    "position": [[0, 0], [0.1, 0.05], [0.3, -0.1]],
    "surface": "acrylic",
    "who": "A. Person",
    "date": "2026-11-27",
    "license": "CC0-1.0",
}

FULL = {
    **NEEDED,
    "position": [[0, 0], [-0.1, 0.05], [-0.3, -0.1]],
    "design": Design("03120", shape=Lattice.of((5, 1, 1), phases=2)),
    "robot": "B",
    "powder": "corn starch",
    "pressure_kpa": 6,
    "frequency_hz": 0.5,
    "cycles": 90,
    "repetition": 3,
    "voxel_cm": 1.25,
    "camera": "from above, 30 Hz",
    "notes": "é, 日本",
    "provenance": {
        "file": "run.csv",
        "sha256": "0f" * 32,
        "kind": "Tracker",
        "cm_per_pixel": 0.02,
        "x_axis_deg": -90,
        "point": "centre",
    },
}

SIMULATED = {
    **{key: value for key, value in NEEDED.items() if key != "date"},
    "source": "simulated",
    "reality": "reversal",
    "voxel_cm": 1,
}

CONTENT = """\
{
"format": "softvox-gym trial",
"version": 1,
"shape": [2, 2, 2],
"phases": 1,
"design": "00021222",
"surface": "acrylic",
"who": "A. Person",
"license": "CC0-1.0",
"date": "2026-11-27",
"source": "measured",
"cycles": 1,
"repetition": 1,
"voxel_cm": 1.5,
"track": [
[0, 0, 0],
[0.5, 0.1, 0.05],
[1, 0.3, -0.1]
]
}
"""


def trial(**changes):
    return Trial(**{**NEEDED, **changes})


def test_its_file_is_this_and_a_change_of_it_would_give_every_trial_another_name():
    assert trial().to_bytes().decode() == CONTENT
    assert trial().digest == sha256(CONTENT.encode()).hexdigest()


@pytest.mark.parametrize("facts", [NEEDED, FULL, SIMULATED])
def test_it_is_read_as_it_was_written(facts):
    made = Trial(**facts)
    read = Trial.from_bytes(made.to_bytes())
    assert read == made
    assert hash(read) == hash(made)
    assert read.to_bytes() == made.to_bytes()
    assert read.design == made.design
    assert np.array_equal(read.position, made.position)
    assert read.facts == made.facts
    said = json.loads(made.to_bytes())
    assert said.pop("track") == np.column_stack([made.cycle, made.position]).tolist()
    assert made.facts == {**made.facts, **said}
    assert all(made.facts[name] in ("", None, {}) for name in made.facts.keys() - said.keys())


def test_it_is_a_value():
    one = trial()
    assert one != trial(repetition=2)
    assert one != "a trial"
    assert {one, trial(), replace(one)} == {one}
    assert pickle.loads(pickle.dumps(one)) == copy.deepcopy(one) == one
    assert replace(one, notes="again").run == one.run
    for name, value in {
        **{"repetition": 2, "robot": "B", "surface": "wood", "powder": "talc", "design": 6560},
        **{"who": "B. Person", "date": "2026-11-28", "pressure_kpa": 6, "frequency_hz": 1},
    }.items():
        assert replace(one, **{name: value}).run != one.run
    assert repr(one) == f"<Trial {one.digest[:10]}: 6453, measured by A. Person>"
    with pytest.raises(ValueError, match="read-only"):
        one.position[0] = 1


def test_numbers_are_kept_to_a_micrometre_whatever_type_they_have():
    made = trial(
        cycle=np.float32([0, 0.5, 1]),
        position=[[-0.0, 0], [0.10001, 0.049999], [0.3, -0.1]],
        voxel_cm=np.float64(1.5),
        cycles=np.int64(1),
        repetition=np.int64(1),
    )
    assert made == trial(position=[[0, 0], [0.1, 0.05], [0.3, -0.1]])
    assert trial(cycle=[0, 1, 89.999999]).cycles == 90
    assert trial(cycle=[0, 1, 3.983675], cycles=3.983675).cycles == 3.98368
    assert made.displacement.tolist() == [0.3 / 1.5, -0.1 / 1.5]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"design": 6561}, "design index 6561 is outside 0 ... 6560"),
        ({"design": 0}, "design has no voxels; give the design that was built"),
        ({"design": "9" * 8}, "may have the digits 0, 1 and 2 only"),
        ({"design": 10**400}, "design index of 1329 bits is outside"),
        ({"cycle": "abc"}, "cycle must be numbers, got 'abc'"),
        ({"cycle": [0, 1, 10**400]}, "cycle must be numbers, got [0, 1, 1000"),
        ({"cycle": [0, 1, float("nan")]}, "cycle must be finite numbers up to a million"),
        ({"cycle": [0, 1, 1e300]}, "cycle must be finite numbers up to a million"),
        ({"cycle": [[0, 1]]}, "cycle must be an array of 1 dimensions, got 2"),
        ({"cycle": [0, 1]}, "position must have shape (2, 2), a row for each cycle, got"),
        ({"cycle": [0], "position": [[0, 0]]}, "a track must have 2 to 100000 points, got 1"),
        ({"cycle": [1, 2, 3]}, "a track must begin at cycle 0 and position 0, 0; sub"),
        ({"position": np.ones((3, 2))}, "a track must begin at cycle 0 and position 0, 0; sub"),
        ({"cycle": [0, 2, 1]}, "cycle must increase, but 1 follows 2; sort the points"),
        ({"cycle": [0, 1, 1.000001]}, "cycle must increase, but 1 follows 1; sort the points"),
        ({"position": [[0, 0], [1, 1], [60, 80.01]]}, "the track goes 100 cm from its start"),
        ({"surface": ""}, "surface is required, but empty; give it"),
        ({"who": ""}, "who is required, but empty; give it"),
        ({"who": " A"}, "who must be a string of at most 2000 characters without leading"),
        ({"who": b"A"}, "who must be a string of at most 2000 characters without leading"),
        ({"notes": "a\nb"}, "notes must be one line of printable characters, got 'a\\nb'"),
        ({"notes": "\ud800"}, "notes must be one line of printable characters, got '\\ud800'"),
        ({"notes": "x" * 2001}, "notes must be a string of at most 2000 characters"),
        ({"license": ""}, "license must be one of CC0-1.0, CC-BY-4.0, ODC-By-1.0, PDDL-1.0, MIT"),
        ({"license": "GPL"}, "license must be one of CC0-1.0, CC-BY-4.0, ODC-By-1.0, PDDL-1.0, M"),
        ({"source": "seen"}, "source must be one of measured, simulated, got 'seen'"),
        ({"reality": "reversal"}, "reality is for simulated trials only; leave it out"),
        ({"date": ""}, "date is required if measured; give it as 2026-11-27"),
        ({"date": "20261127"}, "date must be written as 2026-11-27, got '20261127'"),
        ({"date": "2026-02-30"}, "date must be written as 2026-11-27, got '2026-02-30'"),
        ({"pressure_kpa": 0}, "pressure_kpa must be a number above 0 and at most 1000, got 0"),
        ({"frequency_hz": True}, "frequency_hz must be a number above 0 and at most 1000, got Tr"),
        ({"frequency_hz": 10**400}, "frequency_hz must be a number above 0 and at most 1000, got"),
        ({"frequency_hz": 10**5000}, "frequency_hz must be a number above 0 and at most 1000, go"),
        ({"voxel_cm": None}, "voxel_cm must be a number above 0 and at most 100, got None"),
        ({"voxel_cm": float("nan")}, "voxel_cm must be a number above 0 and at most 100, got nan"),
        ({"cycles": 0.5}, "cycles is 0.5, but the track lasts until cycle 1; give the number"),
        ({"repetition": 0}, "repetition must be a whole number from 1 to 10000, got 0"),
        ({"repetition": True}, "repetition must be a whole number from 1 to 10000, got True"),
        ({"repetition": 1.0}, "repetition must be a whole number from 1 to 10000, got 1.0"),
        (
            {"provenance": {"path": "x"}},
            "provenance may have keys file, sha256, kind, cm_per_pixel, x_",
        ),
        ({"provenance": None}, "provenance may have keys file, sha256, kind, cm_per_pixel, x_"),
        ({"provenance": {"file": ""}}, "provenance: file is required, but empty; give it"),
        ({"provenance": {"sha256": "0"}}, "provenance: sha256 must be 64 hexadecimal digits"),
        ({"provenance": {"cm_per_pixel": 0}}, "provenance: cm_per_pixel must be a number above 0"),
        ({"provenance": {"x_axis_deg": "e"}}, "provenance: x_axis_deg must be a number above -36"),
    ],
)
def test_what_cannot_be_is_refused_with_a_remedy(changes, message):
    with pytest.raises(TrialError) as error:
        trial(**changes)
    assert message in str(error.value)
    assert len(str(error.value)) < 400


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"reality": ""}, "reality of a simulated trial: no reality ''; there are "),
        ({"reality": "reversl"}, "no reality 'reversl'; did you mean reversal?"),
        ({"voxel_cm": 1.5}, "simulated robots have voxels of 1 cm; give voxel_cm=1"),
        ({"date": "today"}, "date must be written as 2026-11-27, got 'today'"),
    ],
)
def test_a_simulated_trial_says_where(changes, message):
    with pytest.raises(TrialError) as error:
        Trial(**{**SIMULATED, **changes})
    assert message in str(error.value)


def test_a_simulated_trial_may_be_of_the_simulator_or_of_a_set():
    for name in ("published", "public-0"):
        assert Trial(**{**SIMULATED, "reality": name}).reality == name


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("{\n", "", "line 1: is not valid JSON; restore the file, or remove it"),
        (CONTENT, "[" * 100_000, "is not valid JSON; restore the file, or remove it"),
        (CONTENT, "[]", "is not a trial: its format is not 'softvox-gym trial'; remove it"),
        ("softvox-gym trial", "a", "is not a trial: its format is not 'softvox-gym trial'; remov"),
        (
            '"version": 1',
            '"version": 2',
            "is a trial of version 2, but this package reads version",
        ),
        ('"version": 1', '"version": true', "is a trial of version True, but this package reads"),
        ('"who": "A. Person",\n', "", "lacks the key 'who'; restore the file, or add its track"),
        ('"cycles": 1,\n', "", "differs from what softvox trials writes; restore the file, or add"),
        ('"cycles"', '"cicles"', "has the unknown key 'cicles'; restore the file, or install a"),
        ("[2, 2, 2]", "[2, 2]", "shape or track can't be read (shape must be three whole numbers"),
        ("[2, 2, 2]", "[true, 8, 1]", "differs from what softvox trials writes; restore the file"),
        ("[0.5, 0.1, 0.05]", "[0.5, 0.1]", "shape or track can't be read (setting an array ele"),
        (
            "[0.5, 0.1, 0.05]",
            '["0.5", 0.1, 0.05]',
            "differs from what softvox trials writes; restore",
        ),
        ("0.5", "NaN", "cycle must be finite numbers up to a million; leave out other"),
        ('"00021222"', "6453", "design must be a string of digits, got 6453"),
        ("1.5,", '1.5,\n"notes": "",', "differs from what softvox trials writes; restore the file"),
        ("1.5,", "1.5,\n" * 2, "line 15: is not valid JSON; restore the file, or remove it"),
        (
            '"phases": 1',
            '"phases": 1, "phases": 1',
            "differs from what softvox trials writes; restore",
        ),
        ("\n", "\r\n", "has Windows line endings; put '*.json -text' into .gitattributes, and"),
        ("0.5", "0.50", "differs from what softvox trials writes; restore the file, or add"),
        ("\n}\n", "\n}\n\n", "differs from what softvox trials writes; restore the file, or add"),
        ("CC0-1.0", "", "license must be one of CC0-1.0, CC-BY-4.0"),
    ],
)
def test_a_file_that_is_none_is_refused_with_a_remedy(old, new, message):
    assert old in CONTENT
    with pytest.raises(TrialError) as error:
        Trial.from_bytes(CONTENT.replace(old, new).encode())
    assert str(error.value).startswith(message)
    assert len(str(error.value)) < 400


def test_a_file_that_is_no_text_or_too_large_is_refused():
    for content in (b"", b"\xff\xfe\x00", CONTENT.encode("utf-16"), CONTENT.encode() + b"\xff"):
        with pytest.raises(TrialError):
            Trial.from_bytes(content)
    with pytest.raises(TrialError, match=r"is larger than 8,000,000 bytes, which no trial is"):
        Trial.from_bytes(bytes(MOST_BYTES + 1))


def test_the_largest_trial_is_within_the_limit():
    sides = (100, 100, 100)
    track = np.full((MOST_POINTS, 2), -70.1234)
    track[0] = 0
    text = "\N{SUPERSCRIPT TWO}" * 2000
    largest = trial(
        design=Design("2" * 10**6, shape=sides),
        cycle=np.linspace(0, 999_999.99999, MOST_POINTS),
        position=track,
        **dict.fromkeys(("surface", "who", "robot", "powder", "camera", "notes"), text),
    )
    assert len(largest.to_bytes()) < MOST_BYTES


#: Put in the place of anything.
ODD = [
    *(None, True, False, 0, -1, 2, 1.5, -0.0, 10**18, 10**400, 1e308, float("nan"), float("inf")),
    *("", " ", "x", "x" * 3000, "é", "\ud800", "\0", "1", "2026-11-28", "simulated", "published"),
    *([], {}, [[]], [0, 0, 0], [[0, 0, 0]], {"file": "a"}, {"\ud800": 1}, [None], [True, 1, 1]),
    json.loads("[" * 400 + "]" * 400),
]


def laid_out(data):
    """Write data as a trial is, where that can be, so that what it says is what is refused."""
    lines = [f"{json.dumps(key)}: {json.dumps(data[key])}" for key in data if key != "track"]
    track = data.get("track")
    points = track if isinstance(track, list) else [track]
    lines.append('"track": [\n' + ",\n".join(map(json.dumps, points)) + "\n]")
    return ("{\n" + ",\n".join(lines) + "\n}\n").encode()


@cache
def contents():
    return [Trial(**facts).to_bytes() for facts in (NEEDED, FULL, SIMULATED)]


def odd_data(draw):
    data = json.loads(draw.choice(contents()))
    for _ in range(draw.choice([1, 1, 2])):
        place, key = data, draw.choice(list(data))
        while isinstance(place[key], (dict, list)) and place[key] and draw.random() < 0.7:
            place = place[key]
            key = draw.choice(list(place) if isinstance(place, dict) else range(len(place)))
        if draw.random() < 0.15:
            del place[key]
        else:
            place[key] = copy.deepcopy(draw.choice(ODD))
        if not data:
            break
    return laid_out(data)


def odd_bytes(draw):
    content = bytearray(draw.choice(contents()))
    for _ in range(draw.randint(1, 3)):
        at = draw.randrange(len(content))
        end = at + draw.choice([0, 1, 1, 1, 20])
        content[at:end] = draw.randbytes(draw.choice([0, 1, 1, 2]))
    return bytes(content)


@pytest.mark.parametrize(("kind", "seed"), [(odd_data, 1), (odd_bytes, 2)])
def test_thousands_of_malformed_files_are_refused_in_a_line_or_read_as_they_are(kind, seed):
    draw = random.Random(seed)
    messages = []
    for _ in range(3000):
        content = kind(draw)
        try:
            made = Trial.from_bytes(content)
        except TrialError as error:
            messages.append(str(error))
        else:
            assert made.to_bytes() == content  # some changes make another trial
    assert 1500 < len(messages) < 3000
    assert all(0 < len(message) < 500 and "\n" not in message for message in messages)


def test_the_documented_file_is_one_and_the_table_has_its_keys():
    page = Path(__file__).parents[2].joinpath("docs/trials-database.md").read_text("utf-8")
    example = page.partition("```json\n")[2].partition("```")[0]
    assert Trial.from_bytes(example.encode()).to_bytes().decode() == example
    table = page.partition("| key |")[2].partition("\n\n")[0].splitlines()[2:]
    assert [line.split("|")[1].strip() for line in table] == list(KEYS)
    assert all(name in page for name in (*LICENSES, *PROVENANCE))
