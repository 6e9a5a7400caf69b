"""A design survives as a file, and what is none is refused in one line that names the file."""

import json

import numpy as np
import pytest
from cli_process import snapshot

from softvox_gym import Design, Lattice
from softvox_gym.cli import main
from softvox_gym.files import OutputError

BEST = Design(6453)
WHOLE = {"format": "softvox-gym design", "version": 1, "shape": [2, 2, 2], "digits": "00021222"}

#: As others write it: a header, materials that are no design's business, blanks in the layers.
VXA = """<?xml version="1.0" encoding="ISO-8859-1"?>
<VXA Version="1.1">
<Simulator><Integration><DtFrac>0.9</DtFrac></Integration></Simulator>
<VXC Version="0.94">
<Lattice><Lattice_Dim>0.01</Lattice_Dim></Lattice>
<Palette>
<Material ID="1"><Name>Soft</Name><Mechanical><CTE>0</CTE></Mechanical></Material>
<Material ID="2"><Name>Bone</Name></Material>
<Material ID="3"><Name>Muscle</Name><Mechanical><CTE>-0.01</CTE></Mechanical></Material>
</Palette>
<Structure Compression="ASCII_READABLE">
<X_Voxels>3</X_Voxels><Y_Voxels>2</Y_Voxels><Z_Voxels>1</Z_Voxels>
<Data><Layer><![CDATA[
012
330]]></Layer></Data>
</Structure>
</VXC>
</VXA>"""


def random_design(seed):
    rng = np.random.default_rng(seed)
    shape = rng.integers(1, 5, size=3)
    return Design(rng.integers(3, size=shape))


@pytest.mark.parametrize("ending", ["json", "vxa", "VXA"])
@pytest.mark.parametrize("design", [BEST, Design(0), *map(random_design, range(6))], ids=repr)
def test_a_design_comes_back_from_its_file(design, ending, tmp_path):
    path = tmp_path / f"robot.{ending}"
    design.save(path)
    assert Design.load(str(path)) == design
    before = path.read_bytes()
    with pytest.raises(OutputError, match=r"exists; choose another, or replace it with force=True"):
        BEST.save(path)
    assert path.read_bytes() == before
    design.save(path, force=True)
    assert snapshot(tmp_path) == {path.name: before}


def test_the_json_is_as_documented(tmp_path):
    BEST.save(tmp_path / "best.json")
    assert json.loads((tmp_path / "best.json").read_text()) == WHOLE


def test_a_design_of_several_phases_comes_back_from_json_and_is_no_vxa(tmp_path):
    design, path = Design("30003334", shape=Lattice.of((2, 2, 2), phases=4)), tmp_path / "a.json"
    design.save(path)
    assert json.loads(path.read_text()) == {**WHOLE, "phases": 4, "digits": "30003334"}
    assert Design.load(path) == design
    with pytest.raises(ValueError, match=r"a \.vxa has no phases.* save it as \.json"):
        design.save(tmp_path / "a.vxa")
    for phases, message in (
        (1.5, "must be a whole number"),
        (9, "1 to 8"),
        (2, "8 digits 0, 1, 2, 3"),
    ):
        path.write_text(json.dumps({**WHOLE, "phases": phases, "digits": "30003334"}))
        with pytest.raises(ValueError, match=rf"a\.json: .*{message}"):
            Design.load(path)


def test_in_a_vxa_what_expands_is_active_or_what_one_says(tmp_path):
    path = tmp_path / "robot.vxa"
    path.write_text(VXA)
    assert Design.load(path) == Design("011220", shape=(3, 2, 1))
    assert Design.load(path, materials={2: 2, 3: 0}) == Design("012000", shape=(3, 2, 1))
    inner = VXA[VXA.index("<VXC") : VXA.index("</VXA>")]  # as VoxCad's own .vxc has it
    path.write_text(inner.replace("ID=", "ID =").replace("012", "0 1 2"))
    assert Design.load(path) == Design("011220", shape=(3, 2, 1))


BOMB = """<!DOCTYPE VXA [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">
<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">]><VXA>&c;</VXA>"""


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "is not XML: no element found"),
        ("<VXA><VXC>", "is not XML: no element found"),
        ('<?xml version="1.0" encoding="none"?><VXA/>', "is not XML: unknown encoding"),
        (BOMB, "has a DOCTYPE, which no .vxa needs; remove it"),
        (BOMB.encode("utf-16"), "has a DOCTYPE"),
        ("<VXA/>", "is not a .vxa: it has no VXC with a Structure"),
        (VXA.replace(' Compression="ASCII_READABLE"', ""), "has compression None; save it as ASC"),
        (VXA.replace("ASCII_READABLE", "ZLIB"), "has compression 'ZLIB'; save it as ASCII_READ"),
        (VXA.replace("<X_Voxels>3</X_Voxels>", ""), "X_Voxels must be a number, got ''"),
        (VXA.replace(">3<", ">1e9<"), "X_Voxels must be a number, got '1e9'"),
        (VXA.replace(">3<", ">-3<"), "shape must have positive sides"),
        (VXA.replace(">3<", ">999999999<"), "sites; at most 1000000 are allowed"),
        (VXA.replace(">3<", ">4<"), r"must have 1 layers of 8 voxels each, has \[6\]"),
        (VXA.replace("012", "019"), "has voxels of material '9', which its palette lacks; give"),
        (VXA.replace("012", "01A"), "has voxels of material 'A'"),
        (VXA.replace('ID="1"', 'ID="x"'), "has a material of ID 'x'; IDs must be 1 to 9"),
        (VXA.replace("-0.01", "nan"), "Mechanical/CTE must be a number, got 'nan'"),
        (b" " * (2**23 + 1), "has more than 8388608 bytes"),
    ],
    ids=range(18),
)
def test_what_is_no_vxa_is_refused(content, says, tmp_path):
    path = tmp_path / "robot.vxa"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(ValueError, match=says) as caught:
        Design.load(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "is not a design: JSON with the format 'softvox-gym design'"),
        ("[" * 100000, "is not a design"),
        (b"\xff\xfe\x00", "is not a design"),
        ("[6453]", "is not a design"),
        ({"format": "other"}, "is not a design"),
        ({"version": 2}, "is a design of version 2, but this package reads version 1; install"),
        ({"version": True}, "is a design of version True"),
        ({"states": 4}, "has or lacks the key 'states', unlike a design"),
        ({"shape": "222"}, "shape must be three whole numbers, got '222'"),
        ({"shape": [2, 2]}, r"shape must be three whole numbers \(nx, ny, nz\)"),
        ({"shape": [2, 2, True]}, "shape must be three whole numbers"),
        ({"shape": [2, 2, 10**9]}, "at most 1000000 are allowed"),
        ({"digits": "0002122"}, "a 2x2x2 design must be 8 digits 0, 1, 2, got '0002122'"),
        ({"digits": "00021223"}, "must be 8 digits 0, 1, 2, got '00021223'"),
        ({"digits": 21222}, "must be 8 digits 0, 1, 2, got 21222"),
        ({"digits": [0, 0, 0, 2, 1, 2, 2, 2]}, "must be 8 digits 0, 1, 2"),
    ],
    ids=range(16),
)
def test_what_is_no_design_is_refused(content, says, tmp_path):
    path = tmp_path / "robot.json"
    if isinstance(content, dict):
        content = json.dumps(WHOLE | content)
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(ValueError, match=says) as caught:
        Design.load(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("ending", ["json", "vxa"])
def test_a_damaged_file_is_a_design_or_refused_in_one_line(ending, tmp_path):
    path, rng = tmp_path / f"robot.{ending}", np.random.default_rng(14)
    BEST.save(path)
    whole = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    for _ in range(150):
        damaged = whole.copy()
        damaged[rng.integers(len(whole), size=3)] = rng.integers(256, size=3)
        path.write_bytes(damaged[: rng.integers(len(whole) // 2, len(whole) + 1)].tobytes())
        said = f"{path}: "
        try:
            assert isinstance(Design.load(path), Design)
        except ValueError as error:
            said = str(error)
        assert said.startswith(f"{path}: ")
        assert "\n" not in said


def test_other_endings_and_places_are_refused(tmp_path):
    with pytest.raises(ValueError, match=r"robot\.npz must end in \.json or \.vxa"):
        BEST.save(tmp_path / "robot.npz")
    with pytest.raises(ValueError, match=r"must end in \.json or \.vxa"):
        Design.load(tmp_path / "robot")
    with pytest.raises(FileNotFoundError):
        Design.load(tmp_path / "robot.json")
    with pytest.raises(OutputError, match="is not a folder; make it first"):
        BEST.save(tmp_path / "none" / "robot.json")
    BEST.save(tmp_path / "robot.json")
    with pytest.raises(ValueError, match="names no materials; leave out materials"):
        Design.load(tmp_path / "robot.json", materials={1: 2})
    BEST.save(tmp_path / "robot.vxa")
    with pytest.raises(
        ValueError, match=r"materials must map to the digits 0, 1 or 2, got \{1: 3\}"
    ):
        Design.load(tmp_path / "robot.vxa", materials={1: 3})


def test_the_command_line_takes_a_file_where_it_takes_a_design(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    design = Design("012020100", shape=(3, 3, 1))
    design.save("robot.json")
    short = ["--json", "--duration", "0.05", "--settle-time", "0.01"]
    assert main(["simulate", "robot.json", *short]) == 0
    of_file = capsys.readouterr().out
    assert main(["simulate", design.digits, "--shape", "3", "3", "1", *short]) == 0
    assert capsys.readouterr().out == of_file
    assert main(["simulate", "robot.json", "--shape", "3", "3", "3"]) == 2
    assert "robot.json is on 3x3x1, not 3x3x3; drop --shape and --phases" in capsys.readouterr().err
    assert main(["simulate", "none.json"]) == 2
    assert "DESIGN none.json: No such file or directory" in capsys.readouterr().err
