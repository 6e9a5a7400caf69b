"""Designs as files: this package's own, JSON, and the bodies of VoxCad's .vxa."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Mapping
from math import isfinite
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from softvox_gym.files import OutputError, check_file, write_file
from softvox_gym.lattice import Lattice

#: Digits indexed [x, y, z], and their lattice.
Body = tuple[NDArray[np.uint8], Lattice]

FORMAT, VERSION = "softvox-gym design", 1

#: Largest file that is read; a .vxa of the largest lattice takes a ninth.
MOST_BYTES = 2**23

#: Compression of the only structure that is read and written: a character per voxel.
READABLE = "ASCII_READABLE"

_VXA = """\
<?xml version="1.0" encoding="ISO-8859-1"?>
<VXA Version="1.0">
<VXC Version="0.93">
<Lattice><Lattice_Dim>0.01</Lattice_Dim></Lattice>
<Palette>
<Material ID="1"><Name>Passive</Name><Mechanical><CTE>0</CTE></Mechanical></Material>
<Material ID="2"><Name>Active</Name><Mechanical><CTE>0.01</CTE></Mechanical></Material>
</Palette>
<Structure Compression="ASCII_READABLE">
<X_Voxels>{0}</X_Voxels><Y_Voxels>{1}</Y_Voxels><Z_Voxels>{2}</Z_Voxels>
<Data>
{layers}</Data>
</Structure>
</VXC>
</VXA>
"""


def is_design_file(name: str) -> bool:
    """Return whether a text names a design file, rather than a number or digits."""
    return Path(name).suffix.lower() in _KINDS


def save(path: Path, digits: str, lattice: Lattice, *, force: bool = False) -> None:
    """Write a design into a file, in the format of its ending; see `Design.save`."""
    write, _ = _kind(path)
    content = write(lattice, digits).encode("ascii")
    if os.path.lexists(path) and not force:
        raise OutputError(f"{path} exists; choose another, or replace it with force=True")
    check_file(path, force=True)
    write_file(path, content, force=force)


def load(path: Path, *, materials: Mapping[int, int] | None = None) -> Body:
    """Read a design from a file, in the format of its ending; see `Design.load`."""
    _, read = _kind(path)
    with path.open("rb") as file:
        content = file.read(MOST_BYTES + 1)
    try:
        if len(content) > MOST_BYTES:
            raise ValueError(
                f"has more than {MOST_BYTES} bytes, which no design has; name another file"
            )
        if materials is not None and read is not _read_vxa:
            raise ValueError("names no materials; leave out materials")
        return read(content, materials)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path}: {error}") from None


def _json(lattice: Lattice, digits: str) -> str:
    data = {"format": FORMAT, "version": VERSION, "shape": list(lattice)}
    more = {"phases": lattice.phases} if lattice.phases > 1 else {}
    return json.dumps({**data, **more, "digits": digits}, indent=1) + "\n"


def _read_json(content: bytes, _: object) -> Body:
    try:
        data = json.loads(content)
    except (ValueError, RecursionError):
        data = None
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise ValueError(
            f"is not a design: JSON with the format {FORMAT!r}, as Design.save writes it"
        )
    if type(data.get("version")) is not int or data["version"] != VERSION:
        raise ValueError(
            f"is a design of version {shown(data.get('version'))}, but this package reads version "
            f"{VERSION}; install a version of softvox-gym that reads it"
        )
    # An unknown key may change the meaning of the others, so the file is refused.
    phases = data.pop("phases", 1)
    if others := sorted(data.keys() ^ {"format", "version", "shape", "digits"}):
        raise ValueError(
            f"has or lacks the key {shown(others[0])}, unlike a design file; save the design again"
        )
    shape, digits = data["shape"], data["digits"]
    if not (isinstance(shape, list) and all(type(side) is int for side in shape)):
        raise ValueError(f"shape must be three whole numbers, got {shown(shape)}")
    if type(phases) is not int:
        raise ValueError(f"phases must be a whole number, got {shown(phases)}")
    lattice = Lattice.of(shape, phases=phases)
    return _body(lattice, digits, {str(digit): digit for digit in range(lattice.states)})


def _body(lattice: Lattice, text: Any, digits: Mapping[str, int]) -> Body:
    """Return the body for a text with a character per site, given each character's digit."""
    if not isinstance(text, str) or len(text) != lattice.sites or set(text) - set(digits):
        raise ValueError(
            f"a {lattice} design must be {lattice.sites} digits {', '.join(digits)}, got "
            f"{shown(text)}"
        )
    rows = np.array([digits[character] for character in text], dtype=np.uint8)
    return lattice.to_stack(rows), lattice


def shown(value: Any) -> str:
    """Return the beginning of any value's repr, for an error."""
    try:
        text = repr(value[:40] if isinstance(value, str) else value)
    except (ValueError, RecursionError):  # a number of thousands of digits, or lists in lists
        text = f"a {type(value).__name__}"
    return text if len(text) <= 40 else f"{text[:37]}..."


def _vxa(lattice: Lattice, digits: str) -> str:
    if lattice.phases > 1:
        raise ValueError(f"a .vxa has no phases, but the design is on {lattice}; save it as .json")
    area = lattice.nx * lattice.ny
    layers = [digits[begin : begin + area] for begin in range(0, len(digits), area)]
    marked = (f"<Layer><![CDATA[{layer}]]></Layer>\n" for layer in layers)
    return _VXA.format(*lattice, layers="".join(marked))


class _Builder(ElementTree.TreeBuilder):
    """Builds a tree of elements; refuses a DOCTYPE, whose entities an attacker could misuse."""

    def doctype(self, *_: object) -> None:
        raise ValueError("has a DOCTYPE, which no .vxa needs; remove it")


def _read_vxa(content: bytes, materials: Mapping[int, int] | None) -> Body:
    try:
        root = ElementTree.fromstring(content, ElementTree.XMLParser(target=_Builder()))
    except (ElementTree.ParseError, LookupError) as error:
        raise ValueError(f"is not XML: {error}") from None
    vxc = root if root.tag == "VXC" else root.find("VXC")
    structure = None if vxc is None else vxc.find("Structure")
    if vxc is None or structure is None:
        raise ValueError("is not a .vxa: it has no VXC with a Structure")
    if (compression := structure.get("Compression")) != READABLE:
        raise ValueError(f"has compression {shown(compression)}; save it as {READABLE}")
    shape = [_number(structure, f"{axis}_Voxels", int) for axis in "XYZ"]
    layers = ["".join((layer.text or "").split()) for layer in structure.findall("Data/Layer")]
    lattice = Lattice.of(shape)
    if [len(layer) for layer in layers] != [lattice.nx * lattice.ny] * lattice.nz:
        raise ValueError(
            f"must have {lattice.nz} layers of {lattice.nx * lattice.ny} voxels each, has "
            f"{shown([len(layer) for layer in layers])}"
        )
    known = {0: 0, **{_id(one): _digit(one) for one in vxc.findall("Palette/Material")}}
    known |= {} if materials is None else materials
    if not set(known.values()) <= {0, 1, 2}:
        raise ValueError(f"materials must map to the digits 0, 1 or 2, got {materials}")
    text = "".join(layers)
    if unknown := set(text) - set(map(str, known)):
        raise ValueError(
            f"has voxels of material {shown(min(unknown))}, which its palette lacks; give its "
            "digit with materials={...}"
        )
    return _body(lattice, text, {str(number): digit for number, digit in known.items()})


def _id(material: ElementTree.Element) -> int:
    if not re.fullmatch("[1-9]", number := material.get("ID", "")):
        raise ValueError(f"has a material of ID {shown(number)}; IDs must be 1 to 9")
    return int(number)


def _digit(material: ElementTree.Element) -> int:
    """Return 2 for a material that expands with temperature, which actuates it; else 1."""
    expands = material.find("Mechanical/CTE") is not None
    return 2 if expands and _number(material, "Mechanical/CTE", float) != 0 else 1


def _number(element: ElementTree.Element, name: str, kind: Callable[[str], Any]) -> Any:
    text = element.findtext(name, "")
    try:
        if isfinite(number := kind(text)):
            return number
    except ValueError:
        pass
    raise ValueError(f"{name} must be a number, got {shown(text)}")


_KINDS: Mapping[str, tuple[Callable[..., str], Callable[..., Body]]] = {
    ".json": (_json, _read_json),
    ".vxa": (_vxa, _read_vxa),
}


def _kind(path: Path) -> tuple[Callable[..., str], Callable[..., Body]]:
    if (kind := _KINDS.get(path.suffix.lower())) is None:
        raise ValueError(f"{path} must end in {' or '.join(_KINDS)}")
    return kind
