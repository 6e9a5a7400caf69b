"""Pictures of a robot: a small software renderer that needs numpy and nothing else.

Everything drawn here, but lines and letters, is a parallelogram (a face of a cube, its shadow), a
half of one (faces of the skin are two triangles) or a plane (the floor), and all are handled by one
identity. A parallelogram holds the points ``c + u a + v b``, with centre ``c`` and half-edges ``a``
and ``b``. A 3 x 4 projection takes a point to homogeneous pixel
coordinates, so on that surface ``w (x, y, 1) = M (u, v, 1)``, with a 3 x 3 matrix ``M`` and the
depth ``w``. The inverse of ``M`` takes a pixel to ``(u, v, 1) / w``. Three functions that are
linear in the pixel thus give the test for being inside (``|u|, |v| <= 1``), the depth, and the
perspective-correct distance to the nearest edge. The halves are those of ``u > v`` and ``u < v``.

Pixel coordinates grow to the right and down; the centre of the first pixel is (0.5, 0.5).
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import compress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Pose", "Stage", "Walk", "fitting_distance", "lanes", "png", "render"]

Array = NDArray[Any]  # geometry is float64; rasters are float32, for speed

FIELD_OF_VIEW = math.radians(30.0)  # across the shorter side of the picture
FILL = 4.8  # camera distance in radii of the robot: leaves room for the shadow and a few steps
SMALLEST_RADIUS = 2.2  # of a 2x2x2 robot at its largest, so that its breathing does not zoom
AIM = 0.065  # height of the point looked at, in camera distances: the robot sits mid-picture
NEAR = 0.05  # voxel widths; what comes closer to the camera is not drawn

BAND = 48  # rows of floor drawn at a time: several times faster, as the arrays stay in the cache
SUPERSAMPLING = 2  # samples per pixel and axis, for cubes and lines
SEAM = 1e-4  # by which the two triangles of a face overlap, of its half edge
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

AZIMUTH = -62.0  # degrees; from where a robot is seen that has gone nowhere
NOWHERE = 0.05  # voxel widths; a shorter way has no direction
ROOM = 0.8  # of the half picture that a robot alone is given, which it fills beside its path
FARTHEST = 2.6  # times the distance for a robot alone; a longer path is followed
TRAIL = (0.36, 0.20, 0.52)  # the path of the centre of mass: neither cyan nor red, and dark
TRAIL_WIDTH = 2.6  # pixels in a picture of 360 rows, and in proportion
GHOST = 0.17  # opacity of the robot where it stood when the pump began
RULER_GAP = 0.19  # from the path to the ruler, in distances for a robot alone
TICK = 0.16  # voxel widths, half of a tick that has a number
LANE = 0.3  # between robots in one scene, in distances for a robot alone

MOST_TICKS = 2000  # of a ruler, on either side of the start

# The corners of a cube, by bits x, y, z; those of its faces +x, -x, +y, -y, +z, -z, anticlockwise.
CORNERS = np.array([[2 * (c >> axis & 1) - 1.0 for axis in range(3)] for c in range(8)])
FACES = np.array(
    [[1, 3, 7, 5], [0, 4, 6, 2], [2, 6, 7, 3], [0, 1, 5, 4], [4, 5, 7, 6], [0, 2, 3, 1]]
)

# Letters of five columns, from the left, whose lowest bit is the upper end.
ALPHABET = "0123456789.-voxelwidths"
COLUMNS = bytes.fromhex(
    "3E5149453E 00427F4000 4261514946 2141454B31 1814127F10 2745454539 3C4A494930 0171090503"
    "3649494936 064949291E 0060600000 0808080808 1C2040201C 3844444438 4428102844 3854545418"
    "00417F4000 3C4030403C 00447D4000 384444487F 043F444020 7F08040478 4854545420"
)
LETTERS = {letter: COLUMNS[5 * k : 5 * k + 5] for k, letter in enumerate(ALPHABET)}

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
    site : array of int, shape (m, 3), optional
        Where on the lattice each was built. With it, neighbours are drawn as one skin: they share
        the corners between them, each the mean of theirs. Else every voxel is a cube.

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
    site: Array | None = None

    def __post_init__(self) -> None:
        m = len(self.position) if np.ndim(self.position) else 0
        shapes = {"position": (m, 3), "quaternion": (m, 4), "edge": (m,), "active": (m,)}
        if self.site is not None:
            shapes["site"] = (m, 3)
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


class Walk(NamedTuple):
    """Where a robot came from and went, which its pictures show too; lengths in voxel widths."""

    start: Pose  #: as it stood when the pump began
    path: Array  #: (k, 3) its centre of mass from then to the end

    @property
    def way(self) -> Array:
        """From the path's start to its end, on the floor, shape (2,)."""
        return np.asarray(self.path[-1, :2] - self.path[0, :2])

    def moved(self, shift: Array) -> Walk:
        """Return the walk somewhere else."""
        start = replace(self.start, position=self.start.position + shift)
        return Walk(start, self.path + shift)


class Stage:
    """A floor on which robots are drawn moment after moment; see `render`.

    Parameters
    ----------
    walks : sequence of Walk
        Of the robots, in order. With them come a ghost of each where it started, the path so far, a
        ruler along the first robot's way, and the distance in words; the camera looks across that
        way and sees all of the paths, or follows where they are long.
    width, height, look_at, distance, azimuth, elevation, boxes
        As of `render`.
    """

    def __init__(
        self,
        walks: Sequence[Walk] = (),
        *,
        width: int = 480,
        height: int = 360,
        look_at: Sequence[float] | None = None,
        distance: float | None = None,
        azimuth: float | None = None,
        elevation: float = 27.0,
        boxes: bool = False,
    ) -> None:
        _check_view(width, height, look_at, distance, azimuth, elevation)
        self._has_voxels = [len(walk.start.position) > 0 for walk in walks]
        self.walks = list(compress(walks, self._has_voxels))
        self.width, self.height, self.boxes = width, height, boxes
        self.look_at, self.distance = look_at, distance
        self.elevation = math.radians(elevation)
        self.heading = _heading(self.walks)
        self.azimuth = self.heading - math.pi / 2 if azimuth is None else math.radians(azimuth)
        self.camera = np.zeros((3, 4))
        self._backdrops: dict[bytes, Array] = {}  # the last, which serves while the camera stands

    def picture(
        self, poses: Sequence[Pose], moments: Sequence[int] | None = None
    ) -> NDArray[np.uint8]:
        """Draw the robots at an index of each walk's path; past its end, and where None, its last.

        Raises
        ------
        ValueError
            Where there are not as many moments as walks.
        """
        if moments is None:
            moments = [-1] * len(self._has_voxels)
        if len(moments) != len(self._has_voxels):
            raise ValueError(f"moments must be {len(self._has_voxels)}, one per walk")
        shown = compress(moments, self._has_voxels)
        so_far = [walk.path[: k + 1 or None] for walk, k in zip(self.walks, shown, strict=True)]
        poses = [pose for pose in poses if len(pose.position)]
        target, distance = self._aim(poses, so_far)
        focal = min(self.width, self.height) / (2 * math.tan(FIELD_OF_VIEW / 2))
        lens = [[focal, 0.0, self.width / 2], [0.0, focal, self.height / 2], [0.0, 0.0, 1.0]]
        self.camera = np.array(lens) @ _view(target, distance, self.azimuth, self.elevation)
        scale = focal / distance  # pixels per voxel width at the point looked at
        line = max(LINE * scale, THINNEST_LINE)
        light = _light(self.azimuth)

        key = self.camera.tobytes()
        if key not in self._backdrops:
            self._backdrops = {key: self._backdrop(target, distance, line, light)}
        picture = self._backdrops[key].copy()
        shapes = [_faces(pose, light, boxes=self.boxes) for pose in poses]
        if shapes:
            faces = _Faces(*map(np.concatenate, zip(*shapes, strict=True)))
            blur = PENUMBRA * scale
            _cast_shadow(picture, faces, self.camera, light, blur, math.sin(self.elevation))
            self._draw_travel(picture, so_far)
            _draw_cubes(picture, faces, self.camera, line)
        if len(so_far) > 1:  # the ruler, or a path, may be where the words are
            plate = picture[:, -(8 + 11 * len(so_far)) * self._letters :, : 120 * self._letters]
            plate += 0.8 * (np.array(BACKGROUND)[:, None, None] - plate)
        for row, path in enumerate(reversed(so_far)):
            words = f"{np.hypot(*(path[-1] - path[0])[:2]):.2f} voxel widths"
            size = self._letters
            _write(picture, words, 6 * size, self.height - (6 + 11 * row) * size, size)
        channels = [(channel * 255 + 0.5).astype(np.uint8) for channel in picture]
        return np.stack(channels, axis=-1)

    def sign(self, robot: int) -> tuple[float, float]:
        """Return the pixel of the last picture (x, y) in front of where a robot started."""
        aside = np.array([math.sin(self.heading), -math.cos(self.heading), 0.0])
        walk = self.walks[robot]
        x, y, depth = self.camera @ [*(walk.path[0] * [1, 1, 0] + 0.13 * self._alone * aside), 1.0]
        depth = max(depth, NEAR)  # what is behind the camera is far off the picture
        return float(x / depth), float(y / depth)

    @property
    def _letters(self) -> int:
        """The size of a dot of a letter, pixels."""
        return max(1, round(self.height / 220))

    @property
    def _alone(self) -> float:
        """The distance from which each robot of the walks fits into the picture."""
        return max(fitting_distance(walk.start) for walk in self.walks)

    def _aim(self, poses: Sequence[Pose], so_far: Sequence[Array]) -> tuple[Array, float]:
        """Return the point that the camera looks at, and from how far."""
        if self.walks:
            target, distance = self._framed(so_far)
        else:
            distance = max([fitting_distance(p) for p in poses], default=FILL * SMALLEST_RADIUS)
            centres = [pose.position.mean(axis=0) for pose in poses] or [np.zeros(3)]
            x, y, _ = np.mean(centres, axis=0)
            distance = self.distance or distance
            target = np.array([x, y, AIM * distance])
        return np.asarray(target if self.look_at is None else self.look_at, float), float(
            self.distance or distance
        )

    def _framed(self, so_far: Sequence[Array]) -> tuple[Array, float]:
        """Return a target and a distance that show all paths, or the robots now where they can't.

        The picture's two directions on the floor are taken one by one: to the right, and to the
        viewer.
        """
        sine, cosine = math.sin(self.azimuth), math.cos(self.azimuth)
        axes = np.array([[-sine, cosine], [cosine, sine]])
        places = np.concatenate([walk.path[:, :2] for walk in self.walks]) @ axes.T
        low, high = places.min(axis=0), places.max(axis=0)
        # One robot leaves room for the ruler; several need it.
        high[1] += RULER_GAP * self._alone * (1 - 1 / len(self.walks))
        slope = math.tan(FIELD_OF_VIEW / 2)
        aspect = self.width / min(self.width, self.height)
        alone = self._alone
        room = ROOM * alone * slope
        across, deep = ((high - low) / 2).tolist()
        needed = max(alone, (across + room) / (slope * aspect)) + 2 * deep
        distance = min(needed, FARTHEST * alone)
        spare = 0.0
        if needed > distance:
            spare = max((distance - 2 * min(deep, alone / 4)) * slope * aspect - room, 0.0)
        free = np.maximum((high - low) / 2 - spare, 0.0) if spare else np.zeros(2)
        now = np.mean([path[-1, :2] for path in so_far], axis=0) @ axes.T
        middle = (low + high) / 2
        target = np.clip(now, middle - free, middle + free) @ axes
        return np.array([*target, AIM * alone]), distance

    def _backdrop(self, target: Array, distance: float, line: float, light: Array) -> Array:
        """Draw what stands still: the floor, the ghosts and the ruler."""
        tops = range(0, self.height, BAND)
        bands = [_Tile(0, y, self.width, min(y + BAND, self.height)) for y in tops]
        floors = [_floor(self.camera, band, target, distance) for band in bands]
        picture = np.concatenate(floors, axis=1)
        for walk in self.walks:
            ghost = _faces(walk.start, light, boxes=self.boxes)
            _draw_cubes(picture, ghost, self.camera, line, GHOST)
        if self.walks:
            self._draw_ruler(picture)
        return picture

    def _draw_ruler(self, picture: Array) -> None:
        """Draw the ruler: from the start along the way, with a tick each voxel width."""
        low, high = self._reach
        step = _numbered(high - low)
        width = TRAIL_WIDTH * self.height / 360 / 2
        _stroke(picture, self.camera, [self._on_ruler([low, high], [0, 0])], width, INK)
        ticks = [
            self._on_ruler([s, s], [0, TICK * (1 if s % step else 2)]) for s in range(low, high + 1)
        ]
        _stroke(picture, self.camera, ticks, width / 2, INK)
        for s in range(low, high + 1):
            if s % step == 0:
                [x, y, depth] = self.camera @ [*self._on_ruler([s], [3 * TICK])[0], 1.0]
                if depth > NEAR:
                    _write(picture, str(s), x / depth, y / depth, self._letters, is_centred=True)

    def _draw_travel(self, picture: Array, so_far: Sequence[Array]) -> None:
        """Draw the paths so far, and how far along the ruler the first robot is."""
        width = TRAIL_WIDTH * self.height / 360
        lines = [path * [1, 1, 0] for path in so_far if len(path) > 1]
        if lines:
            along = float(self._along(so_far[0][-1, :2]))
            lines.append(self._on_ruler([0, along], [0, 0]))
            _stroke(picture, self.camera, lines, width, TRAIL)

    def _along(self, places: Array) -> Array:
        """Return how far places (..., 2) are along the ruler."""
        ahead = [math.cos(self.heading), math.sin(self.heading)]
        return np.asarray((places - self.walks[0].path[0, :2]) @ ahead)

    @property
    def _reach(self) -> tuple[int, int]:
        """The whole numbers at which the ruler begins and ends."""
        places = np.concatenate([self._along(walk.path[:, :2]) for walk in self.walks])
        low, high = math.floor(places.min() + 0.5), math.ceil(places.max() - 0.02)
        return max(min(low, 0), -MOST_TICKS), min(max(high, 1), MOST_TICKS)

    def _on_ruler(self, along: Sequence[float], off: Sequence[float]) -> Array:
        """Return points (k, 3): so far along the ruler, and off it towards the viewer."""
        sine, cosine = math.sin(self.heading), math.cos(self.heading)
        aside = np.array([sine, -cosine])
        origin = self.walks[0].path[0, :2]
        nearest = max(float(((walk.path[:, :2] - origin) @ aside).max()) for walk in self.walks)
        gap = nearest + RULER_GAP * self._alone
        points = origin + np.multiply.outer(along, [cosine, sine])
        points = points + np.multiply.outer(np.add(off, gap), aside)
        return np.column_stack([points, np.zeros(len(points))])


def render(
    pose: Pose | None,
    walk: Walk | None = None,
    *,
    width: int = 480,
    height: int = 360,
    look_at: Sequence[float] | None = None,
    distance: float | None = None,
    azimuth: float | None = None,
    elevation: float = 27.0,
    boxes: bool = False,
) -> NDArray[np.uint8]:
    """Draw a robot above the floor, in perspective.

    The squares of the floor are one voxel wide; the half-axes +x (umber) and +y (green) start at
    the origin. Equal arguments give equal bytes.

    Parameters
    ----------
    pose : Pose or None
        The robot; None, or no voxels, for the empty floor.
    walk : Walk, optional
        What it has walked: the path on the floor, a ghost of the robot at its start, a ruler along
        it in voxel widths, and the distance in words.
    width, height : int
        Size of the picture, pixels.
    look_at : three floats, optional
        Point in the middle of the picture, voxel widths. By default it follows the robot's
        horizontal centre, at a constant height, or shows all of the walk.
    distance : float, optional
        From the camera to that point, voxel widths; `fitting_distance`, or what the walk needs, by
        default.
    azimuth : float, optional
        Direction from that point to the camera, degrees from +x towards +y. By default -62, or
        across the walk, which then goes to the right. The light turns with it.
    elevation : float
        Of the camera above the horizon, degrees, above 0 and up to 90.
    boxes : bool
        Whether to draw each voxel as the cube that it is in the model, rather than a skin.

    Returns
    -------
    array of uint8, shape (height, width, 3)
        Red, green and blue.

    Raises
    ------
    ValueError
        If a size, the distance or the elevation is out of range, or the view is not finite.
    """
    stage = Stage(
        [] if walk is None else [walk],
        width=width,
        height=height,
        look_at=look_at,
        distance=distance,
        azimuth=azimuth,
        elevation=elevation,
        boxes=boxes,
    )
    return stage.picture([] if pose is None else [pose])


def lanes(walks: Sequence[Walk]) -> list[Array]:
    """Return by how much to move walks (3,) so that they go side by side, the first in front."""
    heading = _heading(walks)
    away = np.array([-math.sin(heading), math.cos(heading), 0.0])
    distance = LANE * max((fitting_distance(walk.start) for walk in walks), default=0.0)
    return [k * distance * away for k in range(len(walks))]


def _check_view(
    width: int,
    height: int,
    look_at: Sequence[float] | None,
    distance: float | None,
    azimuth: float | None,
    elevation: float,
) -> None:
    """Raise ValueError as `render` says."""
    for name, size in {"width": width, "height": height}.items():
        if isinstance(size, bool) or not isinstance(size, int | np.integer) or size < 1:
            raise ValueError(f"{name} must be a positive integer, not {size!r}")
    if distance is not None and not 0 < distance < math.inf:
        raise ValueError(f"distance must be positive and finite, not {distance}")
    if look_at is not None:
        target = np.asarray(look_at, float)
        if target.shape != (3,) or not np.isfinite(target).all():
            raise ValueError(f"look_at must be three finite numbers, not {look_at}")
    if azimuth is not None and not math.isfinite(azimuth):
        raise ValueError(f"azimuth must be finite, not {azimuth}")
    if not 0 < elevation <= 90:
        raise ValueError(f"elevation must be above 0 and at most 90 degrees, not {elevation}")


def _heading(walks: Sequence[Walk]) -> float:
    """Return the direction of the first walk, radians; of one that leads nowhere, to the right."""
    if walks and math.hypot(*walks[0].way.tolist()) >= NOWHERE:
        x, y = walks[0].way.tolist()
        return math.atan2(y, x)
    return math.radians(AZIMUTH) + math.pi / 2


def _light(azimuth: float) -> Array:
    """Return the direction to the light: from the viewer's left, wherever that is; radians."""
    turn = azimuth - math.radians(AZIMUTH)
    sine, cosine = math.sin(turn), math.cos(turn)
    x, y, z = LIGHT.tolist()
    return np.array([cosine * x - sine * y, sine * x + cosine * y, z])


def _numbered(length: float) -> int:
    """Return of how many ticks of a ruler one has a number."""
    return next((step for step in (1, 2, 5, 10, 20, 50) if length / step <= 8), 100)


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


class _Faces(NamedTuple):
    """Faces, or the two triangles of each."""

    frame: Array  # (k, 3, 3) as columns the half-edges a and b, with a x b outwards, and the centre
    half: Array  # (k,) the triangle u > v where 1, u < v where -1, the whole where 0
    colour: Array  # (k, 3) shaded


def _faces(pose: Pose, light: Array, *, boxes: bool) -> _Faces:
    """Return the faces of a robot that can be seen from outside."""
    position, edge = np.asarray(pose.position, float), np.asarray(pose.edge, float)
    rotation = _rotations(np.asarray(pose.quaternion, float))
    corner = position[:, None] + CORNERS @ (rotation * (edge / 2)[:, None, None]).swapaxes(1, 2)
    if is_skin := not boxes and pose.site is not None:
        assert pose.site is not None
        group, is_outside = _skin(np.asarray(pose.site, np.int64).tobytes())
        flat, count = corner.reshape(-1, 3), np.bincount(group)
        means = [np.bincount(group, flat[:, axis]) / count for axis in range(3)]
        corner = np.stack(means, axis=1)[group].reshape(corner.shape)
    else:
        is_outside = np.ones((len(position), 6), bool)
    voxel, face = np.nonzero(is_outside)
    a, b, c, d = np.moveaxis(corner[voxel[:, None], FACES[face]], 1, 0)
    normal = np.cross(c - a, d - b)
    # Half-Lambert shading: faces turned from the light still differ from each other.
    lit = (1 + normal @ light / np.linalg.norm(normal, axis=1)) / 2
    colour = np.where(np.asarray(pose.active)[voxel, None], ACTIVE, PASSIVE)
    colour = colour * (DARKEST + (1 - DARKEST) * lit[:, None])
    middle = (a + c) / 2
    if not is_skin:
        frame = np.stack([(b - a) / 2, (d - a) / 2, middle], -1)
        return _Faces(frame, np.zeros(len(frame)), colour)
    lower = np.stack([(b - a) / 2, (c - b) / 2, middle], -1)
    upper = np.stack([(c - d) / 2, (d - a) / 2, middle], -1)
    half = np.repeat([1.0, -1.0], len(middle))
    return _Faces(np.concatenate([lower, upper]), half, np.tile(colour, (2, 1)))


@lru_cache(maxsize=64)
def _skin(sites: bytes) -> tuple[Array, Array]:
    """Return which corners are one, and which faces are outside, of voxels on their sites.

    A group (8 m,) for every corner, which neighbours, and neighbours of those around it, share; and
    (m, 6) for the faces +x, -x, +y, -y, +z, -z.
    """
    site = np.frombuffer(sites, np.int64).reshape(-1, 3)
    place = {tuple(at): k for k, at in enumerate(site.tolist())}
    corner = np.arange(8)
    links = []
    outside = np.ones((len(site), 6), bool)
    for axis in range(3):
        beyond = (site + np.eye(3, dtype=np.int64)[axis]).tolist()
        pairs = [(k, place[tuple(at)]) for k, at in enumerate(beyond) if tuple(at) in place]
        one, other = np.array(pairs, int).reshape(-1, 2).T
        outside[one, 2 * axis] = outside[other, 2 * axis + 1] = False
        high = corner[corner >> axis & 1 == 1]
        links.append(((one[:, None], high), (other[:, None], high - (1 << axis))))
    group = np.arange(8 * len(site)).reshape(-1, 8)
    before = np.zeros_like(group)
    while (before != group).any():
        before = group.copy()
        for one_side, other_side in links:
            group[one_side] = group[other_side] = np.minimum(group[one_side], group[other_side])
    return np.unique(group, return_inverse=True)[1].ravel(), outside


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
    half: Array  # (q,) as of _Faces
    inverse: Array  # (q, 3, 3) from (pixel x, pixel y, 1) to (u, v, 1) / w
    scale: Array  # (q, 2) pixels from the centre to the edges u = 1 and v = 1
    lower: Array  # (q, 2) bounding box, pixels
    upper: Array  # (q, 2)

    def bounds(self) -> tuple[Array, Array]:
        """Return the box around all quads; it is inside out if there are none."""
        return self.lower.min(axis=0, initial=np.inf), self.upper.max(axis=0, initial=-np.inf)


def _project(faces: _Faces, projection: Array) -> _Quads:
    """Project the faces; what reaches behind the camera is left out."""
    matrix = projection[:, :3] @ faces.frame
    matrix[:, :, 2] += projection[:, 3]
    corner = matrix @ SIGNS
    # With y down, the outside of a face is seen where u, v turn against x, y.
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
    picture: Array, faces: _Faces, camera: Array, light: Array, blur: float, foreshortening: float
) -> None:
    """Darken the floor where the cubes keep the light off; the blur is in pixels."""
    # First along the light to the floor's (x, y, 1), then from the floor to the picture.
    along_light = np.eye(3, 4)
    along_light[:, 2] = -light / light[2]
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
    for q, window, (u, v, inverse_depth) in _patches(quads, tile):
        inside = (np.abs(u) <= inverse_depth) & (np.abs(v) <= inverse_depth)
        shade[window] |= inside & (quads.half[q] * (u - v) >= -SEAM * inverse_depth)
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


def _draw_cubes(
    picture: Array, faces: _Faces, camera: Array, line: float, opacity: float = 1.0
) -> None:
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


def _stroke(
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


def _write(
    picture: Array, text: str, x: float, y: float, size: int, *, is_centred: bool = False
) -> None:
    """Write into a picture; x and y are the lower left of the letters, or the middle above them."""
    columns = [column for letter in text for column in (*LETTERS.get(letter, bytes(3)), 0)]
    dots = np.array([[column >> bit & 1 for column in columns] for bit in range(8)], bool)
    dots = dots.repeat(size, axis=0).repeat(size, axis=1)
    left = round(x - dots.shape[1] / 2) if is_centred else round(x)
    top = round(y) if is_centred else round(y) - dots.shape[0]
    row, column = np.nonzero(dots)
    row, column = row + top, column + left
    inside = (row >= 0) & (row < picture.shape[1]) & (column >= 0) & (column < picture.shape[2])
    picture[:, row[inside], column[inside]] = np.array(INK)[:, None]
