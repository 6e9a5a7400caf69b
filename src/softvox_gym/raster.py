"""A small software renderer that needs only NumPy: faces, shadows, lines, letters.

Everything drawn here, except lines and letters, is a parallelogram (a face of a cube, its shadow),
half of one (faces of the skin are two triangles) or a plane (the floor), and one identity covers
them all. A parallelogram holds the points ``c + u a + v b``, with centre ``c`` and half-edges ``a``
and ``b``. A 3 x 4 projection, the camera, maps a point to homogeneous pixel coordinates, so on that
surface ``w (x, y, 1) = M (u, v, 1)``, with a 3 x 3 matrix ``M`` and the depth ``w``. The inverse of
``M`` maps a pixel to ``(u, v, 1) / w``. Three functions that are linear in the pixel thus give the
test for being inside (``|u|, |v| <= 1``), the depth, and the perspective-correct distance to the
nearest edge. The two halves have ``u > v`` and ``u < v``.

Pictures are arrays (3, height, width) of values from 0 to 1, drawn into in place.

Pixel coordinates grow to the right and down; the centre of the first pixel is (0.5, 0.5).
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]  # geometry is float64; rasters are float32, for speed

NEAR = 0.05  # voxel widths; nothing closer to the camera is drawn
BAND = 48  # rows of floor drawn at a time: several times faster, as the arrays stay in the cache
SUPERSAMPLING = 2  # samples per pixel and axis, for cubes and lines
SEAM = 1e-4  # overlap of the two triangles of a face, as a share of its half-edge
SHADOW = 0.32  # darkening of the floor in the full cast shadow
INK = (0.10, 0.12, 0.16)
BACKGROUND = (0.975, 0.98, 0.985)
FLOOR = (0.895, 0.91, 0.925)
GRID_LINE, GRID_STRENGTH = 0.014, 0.20  # half width in voxel widths, opacity
AXIS_LINE, AXIS_STRENGTH = 0.030, 0.75
AXIS_COLOURS = ((0.72, 0.36, 0.20), (0.22, 0.52, 0.36))  # +x umber, +y green
FADE = 0.62  # radius at which the floor has faded to 1/e, in camera distances

# Letters of five columns, from left to right; the lowest bit of a column is at the top.
ALPHABET = "0123456789.-voxelwidths"
COLUMNS = bytes.fromhex(
    "3E5149453E 00427F4000 4261514946 2141454B31 1814127F10 2745454539 3C4A494930 0171090503"
    "3649494936 064949291E 0060600000 0808080808 1C2040201C 3844444438 4428102844 3854545418"
    "00417F4000 3C4030403C 00447D4000 384444487F 043F444020 7F08040478 4854545420"
)
LETTERS = {letter: COLUMNS[5 * k : 5 * k + 5] for k, letter in enumerate(ALPHABET)}

# The corners of a parallelogram, as columns (u, v, 1).
SIGNS = np.array([[-1.0, 1.0, 1.0, -1.0], [-1.0, -1.0, 1.0, 1.0], [1.0, 1.0, 1.0, 1.0]])


class Faces(NamedTuple):
    """Faces, or the two triangles of each."""

    frame: Array  # (k, 3, 3) as columns the half-edges a and b, with a x b outwards, and the centre
    half: Array  # (k,) 1 for the triangle u > v, -1 for u < v, 0 for the whole
    colour: Array  # (k, 3) shaded


def _on_floor(camera: Array) -> Array:
    """Return the part (3, 3) of a projection that concerns floor points (x, y, 1)."""
    return camera[:, [0, 1, 3]]


class _Quads(NamedTuple):
    """The faces whose outside a projection sees."""

    face: Array  # (q,) index of the face
    half: Array  # (q,) as in Faces
    inverse: Array  # (q, 3, 3) from (pixel x, pixel y, 1) to (u, v, 1) / w
    scale: Array  # (q, 2) pixels from the centre to the edges u = 1 and v = 1
    lower: Array  # (q, 2) bounding box, pixels
    upper: Array  # (q, 2)

    def bounds(self) -> tuple[Array, Array]:
        """Return the box around all quads; it is inside out if there are none."""
        return self.lower.min(axis=0, initial=np.inf), self.upper.max(axis=0, initial=-np.inf)


def _project(faces: Faces, projection: Array) -> _Quads:
    """Project the faces, without those that reach behind the camera."""
    matrix = projection[:, :3] @ faces.frame
    matrix[:, :, 2] += projection[:, 3]
    corner = matrix @ SIGNS
    # As y points down, the outside of a face is seen if u, v turn against x, y.
    seen = (np.linalg.det(matrix) < 0) & (corner[:, 2].min(axis=1) > NEAR)
    matrix, corner = matrix[seen], corner[seen]
    inverse = np.linalg.inv(matrix)
    gradient = np.linalg.norm(inverse[:, :2, :2], axis=2) * matrix[:, 2, 2:]
    pixel = corner[:, :2] / corner[:, 2:]
    lower, upper = pixel.min(axis=2), pixel.max(axis=2)
    return _Quads(np.flatnonzero(seen), faces.half[seen], inverse, 1 / gradient, lower, upper)


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


def floor(camera: Array, size: tuple[int, int], target: Array, distance: float) -> Array:
    """Draw the floor with its grid and axes: (3, height, width), each value from 0 to 1.

    The size is width and height, pixels; the target is the point that the camera looks at.
    """
    width, height = size
    tiles = [_Tile(0, y, width, min(y + BAND, height)) for y in range(0, height, BAND)]
    return np.concatenate([_floor(camera, tile, target, distance) for tile in tiles], axis=1)


def _floor(camera: Array, tile: _Tile, target: Array, distance: float) -> Array:
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


def cast_shadow(
    picture: Array, faces: Faces, camera: Array, light: Array, blur: float, foreshortening: float
) -> None:
    """Darken the floor in the shadow of the cubes; the blur is in pixels."""
    # First along the light to the floor's (x, y, 1), then from the floor to the picture.
    along_light = np.eye(3, 4)
    along_light[:, 2] = -light / light[2]
    along_light[2] = [0.0, 0.0, 0.0, 1.0]
    quads = _project(faces, _on_floor(camera) @ along_light)
    _, height, width = picture.shape
    blur = min(blur, max(height, width))  # seen from inside a voxel it would be huge
    radii = (max(1, round(blur * foreshortening)), max(1, round(blur)))
    margin = 2 * max(radii)
    frame = _Tile(0, 0, width, height)
    lower, upper = quads.bounds()
    # The shadow just outside the picture still blurs into it.
    tile = _Tile(-margin, -margin, width + margin, height + margin).cut(
        lower - margin, upper + margin
    )
    shade = np.zeros(tile.shape, bool)
    for q, window, (u, v, inverse_depth) in _patches(quads, tile):
        inside = (np.abs(u) <= inverse_depth) & (np.abs(v) <= inverse_depth)
        shade[window] |= inside & (quads.half[q] * (u - v) >= -SEAM * inverse_depth)
    soft = shade.astype(np.float32)
    for axis in (0, 1, 0, 1):
        soft = _box_blur(soft, radii[axis], axis)
    seen = frame.cut(np.array(tile[:2]), np.array(tile[2:]))
    picture[:, *seen.within(frame)] *= 1 - SHADOW * soft[seen.within(tile)]


def _box_blur(image: Array, radius: int, axis: int) -> Array:
    """Return the running mean over 2 radius + 1 pixels; the outside of the image counts as 0."""
    padding = [(0, 0), (0, 0)]
    padding[axis] = (radius + 1, radius)
    total = np.moveaxis(np.pad(image, padding).cumsum(axis=axis), axis, 0)
    mean = (total[2 * radius + 1 :] - total[: -2 * radius - 1]) / (2 * radius + 1)
    return np.moveaxis(mean, 0, axis)


def draw_faces(
    picture: Array, faces: Faces, camera: Array, line: float, opacity: float = 1.0
) -> None:
    """Draw faces, supersampled; `line` is the half width of their edges in pixels."""
    s = SUPERSAMPLING
    _, height, width = picture.shape
    frame = _Tile(0, 0, width, height)
    camera = np.diag([s, s, 1.0]) @ camera
    quads = _project(faces, camera)
    lower, upper = quads.bounds()
    tile = frame.cut(lower / s, upper / s)
    fine = _Tile(*(s * side for side in tile))

    # The floor hides parts that have sunk into it; above the horizon there is no floor.
    nearest = np.maximum(fine.planes(np.linalg.inv(_on_floor(camera))[2:])[0], 0)
    to_edge = np.full(fine.shape, np.inf, np.float32)
    drawn = np.zeros(fine.shape, np.intp)  # 0: no face, f + 1: face f
    for q, window, planes in _patches(quads, fine):
        inverse_depth = np.maximum(planes[2], 1e-12)
        u, v = planes[:2] / inverse_depth
        u_scale, v_scale = quads.scale[q].tolist()
        margin = np.minimum((1 - np.abs(u)) * u_scale, (1 - np.abs(v)) * v_scale)
        front = (margin >= 0) & (inverse_depth > nearest[window])
        if half := float(quads.half[q]):
            front &= half * (u - v) >= -SEAM
        np.copyto(nearest[window], inverse_depth, where=front)
        np.copyto(to_edge[window], margin, where=front)
        np.copyto(drawn[window], quads.face[q] + 1, where=front)

    ink = np.clip(s * line + 0.5 - to_edge, 0, 1)
    covered = _shrink((drawn > 0).astype(np.float32))
    for channel, part in enumerate(picture[:, *tile.within(frame)]):
        palette = np.concatenate([[0], faces.colour[:, channel]], dtype=np.float32)
        tone = palette[drawn]
        tone += ink * (INK[channel] - tone)
        part += opacity * (_shrink(tone) - covered * part)


def _shrink(image: Array) -> Array:
    """Average the samples of each pixel."""
    s = SUPERSAMPLING
    samples: list[Array] = [image[i::s, j::s] for i in range(s) for j in range(s)]
    return np.asarray(sum(samples[1:], samples[0]) / (s * s))


def stroke(
    picture: Array, camera: Array, lines: Sequence[Array], width: float, colour: Sequence[float]
) -> None:
    """Draw lines through points (k, 3) with a round brush; the width is in pixels."""
    s = SUPERSAMPLING
    _, height, columns = picture.shape
    spots = []
    for line in lines:
        x, y, depth = (camera @ np.column_stack([line, np.ones(len(line))]).T)[:, :, None]
        shown = depth[:, 0] > NEAR
        pixel = s * np.column_stack([x, y])[shown] / depth[shown]
        pixel = np.clip(pixel, -9 * s * columns, 9 * s * columns)
        gone = np.append(0.0, np.hypot(*np.diff(pixel, axis=0).T).cumsum())[: len(pixel)]
        if len(gone):
            dense = np.linspace(0, gone[-1], 2 + int(gone[-1]))
            spots.append(np.column_stack([np.interp(dense, gone, values) for values in pixel.T]))
    reach = np.arange(-math.ceil(s * width / 2), math.ceil(s * width / 2) + 1)
    brush = np.array([(i, j) for i in reach for j in reach if math.hypot(i, j) <= s * width / 2])
    spot = np.concatenate([*spots, np.zeros((0, 2))]).astype(int)
    spot = np.unique(spot, axis=0)
    column, row = (spot[:, None] + brush).reshape(-1, 2).T
    inside = (column >= 0) & (column < s * columns) & (row >= 0) & (row < s * height)
    column, row = column[inside], row[inside]
    if not len(row):
        return
    left, right, top, bottom = (
        int(v) // s for spots in (column, row) for v in (spots.min(), spots.max())
    )
    tile = _Tile(left, top, right + 1, bottom + 1)
    mask = np.zeros((s * tile.shape[0], s * tile.shape[1]), np.float32)
    mask[row - s * tile.top, column - s * tile.left] = 1.0
    covered = _shrink(mask)
    whole = _Tile(0, 0, columns, height)
    for channel, value in zip(picture[:, *tile.within(whole)], colour, strict=True):
        channel += covered * (value - channel)


def write(
    picture: Array, text: str, x: float, y: float, size: int, *, is_centred: bool = False
) -> None:
    """Write into a picture; x, y is the lower left of the letters, or the middle above them."""
    columns = [column for letter in text for column in (*LETTERS.get(letter, bytes(3)), 0)]
    dots = np.array([[column >> bit & 1 for column in columns] for bit in range(8)], bool)
    dots = dots.repeat(size, axis=0).repeat(size, axis=1)
    left = round(x - dots.shape[1] / 2) if is_centred else round(x)
    top = round(y) if is_centred else round(y) - dots.shape[0]
    row, column = np.nonzero(dots)
    row, column = row + top, column + left
    inside = (row >= 0) & (row < picture.shape[1]) & (column >= 0) & (column < picture.shape[2])
    picture[:, row[inside], column[inside]] = np.array(INK)[:, None]


def png(picture: NDArray[np.uint8]) -> bytes:
    """Return a picture, uint8 of shape (height, width, 3), as the bytes of a PNG file.

    Source: W3C, "Portable Network Graphics (PNG) Specification", 2003.
    """
    height, width, _ = picture.shape
    rows = picture.reshape(height, 3 * width).astype(np.int16)
    # The difference of each byte from the pixel to its left: uniform areas become zeros.
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
