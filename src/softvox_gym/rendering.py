"""Pictures of a robot: a small software renderer that needs numpy and nothing else.

Everything drawn here is a parallelogram (a face of a cube, its shadow) or a plane (the floor), and
both are handled by one identity. A parallelogram holds the points ``c + u a + v b``, with centre
``c`` and half-edges ``a`` and ``b``. A 3 x 4 projection takes a point to homogeneous pixel
coordinates, so on that surface ``w (x, y, 1) = M (u, v, 1)``, with a 3 x 3 matrix ``M`` and the
depth ``w``. The inverse of ``M`` takes a pixel to ``(u, v, 1) / w``. Three functions that are
linear in the pixel thus give the test for being inside (``|u|, |v| <= 1``), the depth, and the
perspective-correct distance to the nearest edge.

Pixel coordinates grow to the right and down; the centre of the first pixel is (0.5, 0.5).
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Pose", "fitting_distance", "png", "render"]

Array = NDArray[Any]  # geometry is float64; rasters are float32, for speed

FIELD_OF_VIEW = math.radians(30.0)  # across the shorter side of the picture
FILL = 4.8  # camera distance in radii of the robot: leaves room for the shadow and a few steps
SMALLEST_RADIUS = 2.2  # of a 2x2x2 robot at its largest, so that its breathing does not zoom
AIM = 0.065  # height of the point looked at, in camera distances: the robot sits mid-picture
NEAR = 0.05  # voxel widths; what comes closer to the camera is not drawn

BAND = 48  # rows of floor drawn at a time: several times faster, as the arrays stay in the cache
SUPERSAMPLING = 2  # samples per pixel and axis, for the cubes only
LINE = 0.017  # half width of the cubes' edges on each face, voxel widths at the point looked at
THINNEST_LINE = 0.45  # pixels; the same half width for robots seen from afar

LIGHT = np.array([-0.42, -0.30, 1.0]) / math.hypot(0.42, 0.30, 1.0)  # towards the light
DARKEST = 0.46  # brightness of a face turned right away from the light
SHADOW = 0.32  # darkening of the floor in the full cast shadow
PENUMBRA = 0.11  # blur radius of the cast shadow, voxel widths

PASSIVE = (0.30, 0.84, 0.93)  # cyan
ACTIVE = (0.95, 0.27, 0.22)  # red
INK = (0.10, 0.12, 0.16)
BACKGROUND = (0.975, 0.98, 0.985)
FLOOR = (0.895, 0.91, 0.925)
GRID_LINE, GRID_STRENGTH = 0.014, 0.20  # half width in voxel widths, opacity
AXIS_LINE, AXIS_STRENGTH = 0.030, 0.75
AXIS_COLOURS = ((0.72, 0.36, 0.20), (0.22, 0.52, 0.36))  # +x umber, +y green
FADE = 0.62  # radius at which the floor has faded to 1/e, in camera distances

# The corners of a parallelogram, as columns (u, v, 1).
SIGNS = np.array([[-1.0, 1.0, 1.0, -1.0], [-1.0, -1.0, 1.0, 1.0], [1.0, 1.0, 1.0, 1.0]])


@dataclass(frozen=True, eq=False)
class Pose:
    """Voxels at one moment, in voxel widths; the floor is z = 0.

    Parameters
    ----------
    position : array, shape (m, 3)
        Centres.
    quaternion : array, shape (m, 4)
        Orientations w, x, y, z; of any length but zero.
    edge : array, shape (m,)
        Edge of each cube.
    active : array of bool, shape (m,)
        Active voxels are drawn red, passive ones cyan.

    Raises
    ------
    ValueError
        If a shape is wrong, a value is not finite, an edge is not positive, a quaternion is zero,
        or `active` is not boolean.
    """

    position: Array
    quaternion: Array
    edge: Array
    active: Array

    def __post_init__(self) -> None:
        m = len(self.position) if np.ndim(self.position) else 0
        shapes = {"position": (m, 3), "quaternion": (m, 4), "edge": (m,), "active": (m,)}
        for name, shape in shapes.items():
            value = np.asarray(getattr(self, name))
            if value.shape != shape:
                raise ValueError(f"{name} must have shape {shape}, not {value.shape}")
            if not np.isfinite(value).all():
                raise ValueError(f"{name} must be finite")
        if np.asarray(self.active).dtype != bool:
            raise ValueError("active must be boolean")
        if not (np.asarray(self.edge) > 0).all():
            raise ValueError("edge must be positive")
        if not np.any(self.quaternion, axis=1).all():
            raise ValueError("quaternion must not be zero")


def fitting_distance(pose: Pose) -> float:
    """Return the distance from which the camera sees the whole robot, in voxel widths.

    The default of `render`; robots of up to about 2x2x2 voxels share one. For a film of a large
    robot, take it once, from the first pose, and pass it to every frame: the picture then does not
    zoom as the robot deforms.
    """
    position, edge = np.asarray(pose.position, float), np.asarray(pose.edge, float)
    if not len(position):
        return FILL * SMALLEST_RADIUS
    centre = position.mean(axis=0)
    reach = np.linalg.norm(position - centre, axis=1) + math.sqrt(0.75) * edge
    return FILL * max(SMALLEST_RADIUS, float(reach.max()))


def render(
    pose: Pose | None,
    *,
    width: int = 480,
    height: int = 360,
    look_at: Sequence[float] | None = None,
    distance: float | None = None,
    azimuth: float = -62.0,
    elevation: float = 27.0,
) -> NDArray[np.uint8]:
    """Draw a robot above the floor, in perspective.

    The squares of the floor are one voxel wide; the half-axes +x (umber) and +y (green) start at
    the origin. Equal arguments give equal bytes.

    Parameters
    ----------
    pose : Pose or None
        The robot; None, or no voxels, for the empty floor.
    width, height : int
        Size of the picture, pixels.
    look_at : three floats, optional
        Point in the middle of the picture, voxel widths. By default it follows the robot's
        horizontal centre, at a constant height.
    distance : float, optional
        From the camera to that point, voxel widths; `fitting_distance` by default.
    azimuth : float
        Direction from that point to the camera, degrees from +x towards +y.
    elevation : float
        Of the camera above the horizon, degrees, above 0 and up to 90.

    Returns
    -------
    array of uint8, shape (height, width, 3)
        Red, green and blue.

    Raises
    ------
    ValueError
        If a size, the distance or the elevation is out of range, or the view is not finite.
    """
    for name, size in {"width": width, "height": height}.items():
        if isinstance(size, bool) or not isinstance(size, int | np.integer) or size < 1:
            raise ValueError(f"{name} must be a positive integer, not {size!r}")
    if pose is not None and not len(pose.position):
        pose = None
    if distance is None:
        distance = FILL * SMALLEST_RADIUS if pose is None else fitting_distance(pose)
    if not 0 < distance < math.inf:
        raise ValueError(f"distance must be positive and finite, not {distance}")
    if look_at is None:
        centre = np.zeros(3) if pose is None else np.mean(pose.position, axis=0)
        look_at = (centre[0], centre[1], AIM * distance)
    target = np.asarray(look_at, float)
    if target.shape != (3,) or not np.isfinite(target).all():
        raise ValueError(f"look_at must be three finite numbers, not {look_at}")
    if not math.isfinite(azimuth):
        raise ValueError(f"azimuth must be finite, not {azimuth}")
    if not 0 < elevation <= 90:
        raise ValueError(f"elevation must be above 0 and at most 90 degrees, not {elevation}")

    focal = min(width, height) / (2 * math.tan(FIELD_OF_VIEW / 2))
    lens = np.array([[focal, 0.0, width / 2], [0.0, focal, height / 2], [0.0, 0.0, 1.0]])
    camera = lens @ _view(target, distance, math.radians(azimuth), math.radians(elevation))
    bands = [_Tile(0, y, width, min(y + BAND, height)) for y in range(0, height, BAND)]
    picture = np.concatenate([_floor(camera, band, target, float(distance)) for band in bands], 1)
    if pose is not None:
        scale = focal / distance  # pixels per voxel width at the point looked at
        faces, colours = _faces(pose)
        _cast_shadow(picture, faces, camera, PENUMBRA * scale, math.sin(math.radians(elevation)))
        _draw_cubes(picture, faces, colours, camera, max(LINE * scale, THINNEST_LINE))
    channels = [(channel * 255 + 0.5).astype(np.uint8) for channel in picture]
    return np.stack(channels, axis=-1)


def png(picture: NDArray[np.uint8]) -> bytes:
    """Return a picture, uint8 of shape (height, width, 3), as the bytes of a PNG file.

    Source: W3C, "Portable Network Graphics (PNG) Specification", 2003.
    """
    height, width, _ = picture.shape
    rows = picture.reshape(height, 3 * width).astype(np.int16)
    # Each byte less the one of the pixel to its left: what is even becomes zeros.
    rows[:, 3:] -= picture.reshape(height, 3 * width)[:, :-3]
    filtered = np.concatenate([np.ones((height, 1), np.uint8), rows.astype(np.uint8)], axis=1)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    parts = [(b"IHDR", header), (b"IDAT", zlib.compress(filtered.tobytes(), 9)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(content))
        + name
        + content
        + struct.pack(">I", zlib.crc32(name + content))
        for name, content in parts
    )


def _view(target: Array, distance: float, azimuth: float, elevation: float) -> Array:
    """Return the matrix (3, 4) from points (x, y, z, 1) to right, down and depth; radians."""
    level, rise = math.cos(elevation), math.sin(elevation)
    backward = np.array([level * math.cos(azimuth), level * math.sin(azimuth), rise])
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    rotation = np.stack([right, np.cross(right, backward), -backward])
    return np.column_stack([rotation, -rotation @ (target + distance * backward)])


def _on_floor(camera: Array) -> Array:
    """Return the part (3, 3) of a projection that concerns floor points (x, y, 1)."""
    return camera[:, [0, 1, 3]]


def _faces(pose: Pose) -> tuple[Array, Array]:
    """Return the six faces of every cube and their shaded colours.

    The faces (6 m, 3, 3) have as columns their half-edges a and b, with a x b outwards, and their
    centre; the colours are (6 m, 3).
    """
    position, edge = np.asarray(pose.position, float), np.asarray(pose.edge, float)
    rotation = _rotations(np.asarray(pose.quaternion, float))
    half = rotation * (edge / 2)[:, None, None]
    frames, normals = [], []
    for i in range(3):
        n, a, b = half[:, :, i], half[:, :, i - 2], half[:, :, i - 1]
        frames += [np.stack([a, b, position + n], -1), np.stack([b, a, position - n], -1)]
        normals += [rotation[:, :, i], -rotation[:, :, i]]
    # Half-Lambert shading: faces turned from the light still differ from each other.
    lit = (1 + np.concatenate(normals) @ LIGHT) / 2
    colours = np.tile(np.where(np.asarray(pose.active)[:, None], ACTIVE, PASSIVE), (6, 1))
    return np.concatenate(frames), colours * (DARKEST + (1 - DARKEST) * lit[:, None])


def _rotations(quaternion: Array) -> Array:
    """Return the rotation matrices (m, 3, 3) of quaternions (m, 4) of any length."""
    w, x, y, z = (quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


class _Quads(NamedTuple):
    """Those of the faces that a projection sees from outside."""

    face: Array  # (q,) index of the face
    inverse: Array  # (q, 3, 3) from (pixel x, pixel y, 1) to (u, v, 1) / w
    scale: Array  # (q, 2) pixels from the centre to the edges u = 1 and v = 1
    lower: Array  # (q, 2) bounding box, pixels
    upper: Array  # (q, 2)

    def bounds(self) -> tuple[Array, Array]:
        """Return the box around all quads; it is inside out if there are none."""
        return self.lower.min(axis=0, initial=np.inf), self.upper.max(axis=0, initial=-np.inf)


def _project(faces: Array, projection: Array) -> _Quads:
    """Project the faces (k, 3, 3); what reaches behind the camera is left out."""
    matrix = projection[:, :3] @ faces
    matrix[:, :, 2] += projection[:, 3]
    corner = matrix @ SIGNS
    # With y down, the outside of a face is seen where u, v turn against x, y.
    seen = (np.linalg.det(matrix) < 0) & (corner[:, 2].min(axis=1) > NEAR)
    matrix, corner = matrix[seen], corner[seen]
    inverse = np.linalg.inv(matrix)
    gradient = np.linalg.norm(inverse[:, :2, :2], axis=2) * matrix[:, 2, 2:]
    pixel = corner[:, :2] / corner[:, 2:]
    return _Quads(np.flatnonzero(seen), inverse, 1 / gradient, pixel.min(axis=2), pixel.max(axis=2))


class _Tile(NamedTuple):
    """A rectangle of pixels: left and top included, right and bottom not."""

    left: int
    top: int
    right: int
    bottom: int

    def cut(self, lower: Array, upper: Array) -> _Tile:
        """Return the pixels of this tile that a box touches; there may be none."""
        start = np.clip(np.floor(lower), self[:2], self[2:])
        stop = np.clip(np.ceil(upper), start, self[2:])
        return _Tile(*map(int, start), *map(int, stop))

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.bottom - self.top, self.right - self.left

    def within(self, outer: _Tile) -> tuple[slice, slice]:
        """Return where this tile is in an array that holds the outer one."""
        rows = slice(self.top - outer.top, self.bottom - outer.top)
        return rows, slice(self.left - outer.left, self.right - outer.left)

    def planes(self, inverse: Array) -> Array:
        """Evaluate the rows of an inverse projection (r, 3) at each pixel: (r, rows, columns)."""
        x, y = np.arange(self.left, self.right) + 0.5, np.arange(self.top, self.bottom) + 0.5
        along_x = (inverse[:, :1] * x).astype(np.float32)
        along_y = (inverse[:, 1:2] * y + inverse[:, 2:]).astype(np.float32)
        return np.asarray(along_y[:, :, None] + along_x[:, None, :])


def _patches(quads: _Quads, tile: _Tile) -> Iterator[tuple[int, tuple[slice, slice], Array]]:
    """Yield each quad that reaches into a tile: its number, its window, u/w, v/w and 1/w there."""
    for q in range(len(quads.face)):
        box = tile.cut(quads.lower[q], quads.upper[q])
        if all(box.shape):
            yield q, box.within(tile), box.planes(quads.inverse[q])


def _floor(camera: Array, tile: _Tile, target: Array, distance: float) -> Array:
    """Draw the floor with its grid and axes: (3, rows, columns), each value from 0 to 1."""
    # Coordinates relative to a grid point near the target keep single precision precise.
    anchor = np.array([*np.floor(target[:2]), 1.0])
    matrix = _on_floor(camera)
    matrix[:, 2] = matrix @ anchor
    inverse = np.linalg.inv(matrix)
    planes = tile.planes(inverse)
    # At and above the horizon any large depth will do: the floor has faded there.
    depth = 1 / np.maximum(planes[2], 0.01 / distance)
    x, y = planes[0] * depth, planes[1] * depth
    x_step, y_step = (_step(s, inverse[row], inverse[2], depth) for row, s in enumerate((x, y)))

    off_x, off_y = (target - anchor)[:2].tolist()
    fade = FADE * distance
    near = np.exp(-(((x - off_x) / fade) ** 2) - ((y - off_y) / fade) ** 2)
    grid = np.maximum(_grid_lines(x, x_step), _grid_lines(y, y_step)) * GRID_STRENGTH
    x, y = x + float(anchor[0]), y + float(anchor[1])
    layers = [
        (FLOOR, near),
        (INK, grid * near),
        (AXIS_COLOURS[0], _half_axis(x, y, y_step) * near),
        (AXIS_COLOURS[1], _half_axis(y, x, x_step) * near),
    ]
    picture = np.empty((3, *tile.shape), np.float32)
    picture[:] = np.array(BACKGROUND)[:, None, None]
    for colour, opacity in layers:
        for channel, value in zip(picture, colour, strict=True):
            channel += opacity * (value - channel)
    return picture


def _step(s: Array, row: Array, depth_row: Array, depth: Array) -> Array:
    """Return how much a floor coordinate changes over one pixel."""
    (ax, ay, _), (dx, dy, _) = row.tolist(), depth_row.tolist()
    return np.asarray((np.abs(ax - s * dx) + np.abs(ay - s * dy)) * depth)


def _grid_lines(s: Array, step: Array) -> Array:
    """Return the part of each pixel that the lines at the integers cover, exactly box-filtered."""

    def integral(t: Array) -> Array:
        cell = np.floor(t)
        return np.asarray(cell * (2 * GRID_LINE) + np.minimum(t - cell, 2 * GRID_LINE))

    low = s - step / 2 + GRID_LINE
    return np.asarray((integral(low + step) - integral(low)) / step)


def _half_axis(along: Array, across: Array, step: Array) -> Array:
    """Return the opacity of the line from the origin towards positive values."""
    coverage = np.minimum((AXIS_LINE + step / 2 - np.abs(across)) / step, 2 * AXIS_LINE / step)
    return np.asarray(np.clip(coverage, 0, 1) * (along > 0) * AXIS_STRENGTH)


def _cast_shadow(
    picture: Array, faces: Array, camera: Array, blur: float, foreshortening: float
) -> None:
    """Darken the floor where the cubes keep the light off; the blur is in pixels."""
    # First along the light to the floor's (x, y, 1), then from the floor to the picture.
    along_light = np.eye(3, 4)
    along_light[:, 2] = -LIGHT / LIGHT[2]
    along_light[2] = [0.0, 0.0, 0.0, 1.0]
    quads = _project(faces, _on_floor(camera) @ along_light)
    radii = (max(1, round(blur * foreshortening)), max(1, round(blur)))
    margin = 2 * max(radii)
    _, height, width = picture.shape
    frame = _Tile(0, 0, width, height)
    lower, upper = quads.bounds()
    # What lies just outside the picture still blurs into it.
    tile = _Tile(-margin, -margin, width + margin, height + margin).cut(
        lower - margin, upper + margin
    )
    shade = np.zeros(tile.shape, bool)
    for _, window, (u, v, inverse_depth) in _patches(quads, tile):
        shade[window] |= (np.abs(u) <= inverse_depth) & (np.abs(v) <= inverse_depth)
    soft = shade.astype(np.float32)
    for axis in (0, 1, 0, 1):
        soft = _box_blur(soft, radii[axis], axis)
    seen = frame.cut(np.array(tile[:2]), np.array(tile[2:]))
    picture[:, *seen.within(frame)] *= 1 - SHADOW * soft[seen.within(tile)]


def _box_blur(image: Array, radius: int, axis: int) -> Array:
    """Return the running mean over 2 radius + 1 pixels; what is outside the image is 0."""
    padding = [(0, 0), (0, 0)]
    padding[axis] = (radius + 1, radius)
    total = np.moveaxis(np.pad(image, padding).cumsum(axis=axis), axis, 0)
    mean = (total[2 * radius + 1 :] - total[: -2 * radius - 1]) / (2 * radius + 1)
    return np.moveaxis(mean, 0, axis)


def _draw_cubes(picture: Array, faces: Array, colours: Array, camera: Array, line: float) -> None:
    """Draw the cubes, supersampled; `line` is the half width of their edges in pixels."""
    s = SUPERSAMPLING
    _, height, width = picture.shape
    frame = _Tile(0, 0, width, height)
    camera = np.diag([s, s, 1.0]) @ camera
    quads = _project(faces, camera)
    lower, upper = quads.bounds()
    tile = frame.cut(lower / s, upper / s)
    fine = _Tile(*(s * side for side in tile))

    # The floor hides what has sunk into it; above the horizon there is nothing to hide.
    nearest = np.maximum(fine.planes(np.linalg.inv(_on_floor(camera))[2:])[0], 0)
    to_edge = np.full(fine.shape, np.inf, np.float32)
    drawn = np.zeros(fine.shape, np.intp)  # 0: no face, f + 1: face f
    for q, window, planes in _patches(quads, fine):
        inverse_depth = np.maximum(planes[2], 1e-12)
        u, v = np.abs(planes[:2]) / inverse_depth
        u_scale, v_scale = quads.scale[q].tolist()
        margin = np.minimum((1 - u) * u_scale, (1 - v) * v_scale)
        front = (margin >= 0) & (inverse_depth > nearest[window])
        np.copyto(nearest[window], inverse_depth, where=front)
        np.copyto(to_edge[window], margin, where=front)
        np.copyto(drawn[window], quads.face[q] + 1, where=front)

    ink = np.clip(s * line + 0.5 - to_edge, 0, 1)
    covered = _shrink((drawn > 0).astype(np.float32))
    for channel, part in enumerate(picture[:, *tile.within(frame)]):
        palette = np.concatenate([[0], colours[:, channel]], dtype=np.float32)
        tone = palette[drawn]
        tone += ink * (INK[channel] - tone)
        part += _shrink(tone) - covered * part


def _shrink(image: Array) -> Array:
    """Average the samples of each pixel."""
    s = SUPERSAMPLING
    samples: list[Array] = [image[i::s, j::s] for i in range(s) for j in range(s)]
    return np.asarray(sum(samples[1:], samples[0]) / (s * s))
