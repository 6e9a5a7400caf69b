"""Recordings as glTF for 3-D programs: one node per voxel, which moves, turns and grows.

Source: The Khronos Group, "glTF 2.0 Specification", 2021.
"""

from __future__ import annotations

import base64
import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym.rendering import CORNERS, FACES

APART = 5.0  # voxel widths between robots without positions of their own
FLOAT, UINT16 = 5126, 5123  # of OpenGL
KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
CORNER, TRIANGLE, TIME = range(3)  # the arrays that all voxels share


def glb(recording: dict[str, Any]) -> bytes:
    """Return the robots of a recording in one scene, as the bytes of a .glb file.

    In metres, y upwards, as in glTF. Robots that do not share a panel stand 5 voxel widths apart.
    Voxels are the boxes of the model, without a skin.
    """
    triangles = FACES[:, [0, 1, 2, 0, 2, 3]].astype("<u2").reshape(-1, 1)
    time = np.arange(recording["frames"])[:, None] * recording["seconds_per_frame"]
    arrays = [(CORNERS / 2).astype("<f4"), triangles, time.astype("<f4")]
    metres = [recording["physics"]["edge"]] * 3
    nodes: list[dict[str, Any]] = [{"rotation": [-(0.5**0.5), 0, 0, 0.5**0.5], "scale": metres}]
    channels: list[dict[str, Any]] = []
    for k, robot in enumerate(recording["robots"]):
        for v, moving in enumerate(_voxels(robot, APART * robot.get("panel", k))):
            for path in ("translation", "rotation", "scale"):
                target = {"node": len(nodes), "path": path}
                channels.append({"sampler": len(channels), "target": target})
            arrays += moving
            nodes.append({"name": f"{robot['label']} · {v}", "mesh": robot["active"][v]})
    if len(nodes) > 1:
        nodes[0]["children"] = list(range(1, len(nodes)))
    starts = np.cumsum([0, *(values.nbytes for values in arrays)]).tolist()
    accessors: list[dict[str, Any]] = [
        {
            "bufferView": k,
            "componentType": UINT16 if values.dtype == "<u2" else FLOAT,
            "count": len(values),
            "type": KINDS[values.shape[1]],
        }
        for k, values in enumerate(arrays)
    ]
    for k in (CORNER, TIME):  # their bounds are required
        accessors[k] |= {"min": arrays[k].min(0).tolist(), "max": arrays[k].max(0).tolist()}
    # Lights of colours are linear there. Without normals, faces are flat.
    colours = [
        [round(c**2.2, 4) for c in recording["style"][name]] for name in ("passive", "active")
    ]
    primitive = {"attributes": {"POSITION": CORNER}, "indices": TRIANGLE}
    scene: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "softvox-gym"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "meshes": [{"primitives": [{**primitive, "material": k}]} for k in (0, 1)],
        "materials": [
            {"pbrMetallicRoughness": {"baseColorFactor": [*colour, 1], "metallicFactor": 0}}
            for colour in colours
        ],
        "accessors": accessors,
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": values.nbytes}
            for start, values in zip(starts[:-1], arrays, strict=True)
        ],
        "buffers": [{"byteLength": starts[-1]}],
    }
    if channels:
        samplers = [{"input": TIME, "output": TIME + 1 + k} for k in range(len(channels))]
        scene["animations"] = [{"name": "walk", "channels": channels, "samplers": samplers}]
    text = json.dumps(scene, separators=(",", ":")).encode()
    content = b"".join(values.tobytes() for values in arrays)
    chunks = [(b"JSON", text + b" " * (-len(text) % 4)), (b"BIN\0", content)]
    body = b"".join(struct.pack("<I", len(part)) + name + part for name, part in chunks)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def _voxels(robot: dict[str, Any], aside: float) -> list[list[NDArray[Any]]]:
    """Return of every voxel translation, rotation and scale: (frames, 3, 4 and 3)."""
    centre = np.frombuffer(base64.b64decode(robot["centre"]), "<f4").reshape(-1, 1, 3)
    position, quaternion, edge = (
        np.frombuffer(base64.b64decode(robot[name]), "<i2").reshape(len(centre), -1, size)
        for name, size in (("position", 3), ("quaternion", 4), ("edge", 1))
    )
    x, y = robot.get("shift", (0.0, 0.0))
    scale = robot["scale"] / (2**15 - 1)
    moved = centre + scale * position + [x, y + aside, 0.0]
    turned = quaternion[..., [1, 2, 3, 0]] / np.linalg.norm(quaternion, axis=-1, keepdims=True)
    moving = [values.astype("<f4") for values in (moved, turned, np.repeat(scale * edge, 3, -1))]
    return [[values[:, v] for values in moving] for v in range(position.shape[1])]
