"""Recordings as glTF: a node per voxel, which moves, turns and grows, for any 3-D program.

Source: The Khronos Group, "glTF 2.0 Specification", 2021.
"""

from __future__ import annotations

import base64
import json
import math
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym.rendering import CORNERS, FACES
from softvox_view.replay.data import STEPS

APART = 5.0  # voxel widths between robots that have no place of their own
FLOAT, UINT16 = 5126, 5123  # of OpenGL
HALF_TURN = math.sqrt(0.5)


def glb(recording: dict[str, Any]) -> bytes:
    """Return the robots of a recording in one scene, as the bytes of a .glb file.

    In metres, y upwards, as glTF has it. Robots that do not share a panel stand 5 voxel widths from
    each other. Voxels are the boxes of the model, and have no skin.
    """
    content = bytearray()
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []

    def accessor(values: NDArray[Any], kind: str, **more: Any) -> int:
        size = {"byteOffset": len(content), "byteLength": values.nbytes}
        views.append({"buffer": 0, **size})
        number = FLOAT if values.dtype == np.float32 else UINT16
        own = {"bufferView": len(accessors), "componentType": number, "count": len(values)}
        accessors.append({**own, "type": kind, **more})
        content.extend(values.tobytes())
        return len(accessors) - 1

    corners = (CORNERS[FACES].reshape(-1, 3) / 2).astype("<f4")
    normals = np.repeat(CORNERS[FACES].mean(axis=1), 4, axis=0).astype("<f4")
    triangles = (4 * np.arange(6)[:, None] + [0, 1, 2, 0, 2, 3]).astype("<u2").ravel()
    box = {"min": [-0.5] * 3, "max": [0.5] * 3}
    cube = {"POSITION": accessor(corners, "VEC3", **box), "NORMAL": accessor(normals, "VEC3")}
    indices = accessor(triangles, "SCALAR")
    time = (np.arange(recording["frames"]) * recording["seconds_per_frame"]).astype("<f4")
    ends = {"min": [float(time[0])], "max": [float(time[-1])]}
    clock = accessor(time, "SCALAR", **ends)

    upright, metres = [-HALF_TURN, 0.0, 0.0, HALF_TURN], [recording["physics"]["edge"]] * 3
    nodes: list[dict[str, Any]] = [{"rotation": upright, "scale": metres, "children": []}]
    samplers: list[dict[str, Any]] = []
    channels: list[dict[str, Any]] = []
    for k, robot in enumerate(recording["robots"]):
        x, y = robot.get("shift", [0.0, 0.0])
        own = {"name": robot["label"], "translation": [x, y + APART * robot.get("panel", k), 0.0]}
        nodes[0]["children"].append(len(nodes))
        nodes.append({**own, "children": []} if robot["active"] else own)
        parent = nodes[-1]
        for v, values in enumerate(zip(*map(_voxels, _movement(robot)), strict=True)):
            parent["children"].append(len(nodes))
            for path, moving in zip(("translation", "rotation", "scale"), values, strict=True):
                kind = "VEC4" if path == "rotation" else "VEC3"
                channels.append(
                    {"sampler": len(samplers), "target": {"node": len(nodes), "path": path}}
                )
                samplers.append({"input": clock, "output": accessor(moving, kind)})
            nodes.append({"mesh": robot["active"][v]})
    style = recording["style"]
    # Colours are linear there.
    colours = [[round(c**2.2, 4) for c in style[name]] for name in ("passive", "active")]
    shine = {"metallicFactor": 0.0, "roughnessFactor": 0.9}
    parts = {"attributes": cube, "indices": indices}
    scene: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "softvox-gym"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "meshes": [{"primitives": [{**parts, "material": k}]} for k in (0, 1)],
        "materials": [
            {"pbrMetallicRoughness": {"baseColorFactor": [*colour, 1.0], **shine}}
            for colour in colours
        ],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(content)}],
    }
    if channels:
        scene["animations"] = [{"name": "walk", "channels": channels, "samplers": samplers}]
    text = json.dumps(scene, separators=(",", ":")).encode()
    chunks = [(b"JSON", text + b" " * (-len(text) % 4)), (b"BIN\0", bytes(content))]
    body = b"".join(struct.pack("<I", len(part)) + name + part for name, part in chunks)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def _movement(robot: dict[str, Any]) -> tuple[NDArray[np.float32], ...]:
    """Return translation, rotation and scale of every voxel: (frames, voxels, 3, 4 and 3)."""
    voxels = len(robot["active"])
    centre = np.frombuffer(base64.b64decode(robot["centre"]), "<f4").reshape(-1, 1, 3)

    def counted(name: str, values: int) -> NDArray[np.float64]:
        counts = np.frombuffer(base64.b64decode(robot[name]), "<i2")
        return counts.reshape(len(centre), voxels, values) / STEPS

    position = centre + robot["scale"] * counted("position", 3)
    quaternion = counted("quaternion", 4)[..., [1, 2, 3, 0]]
    turned = quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True)
    edge = np.repeat(robot["scale"] * counted("edge", 1), 3, axis=-1)
    return tuple(values.astype("<f4") for values in (position, turned, edge))


def _voxels(values: NDArray[np.float32]) -> list[NDArray[np.float32]]:
    """Return the movement of each voxel by itself."""
    return [np.ascontiguousarray(values[:, v]) for v in range(values.shape[1])]
