"""Pictures of robots: poses, scenes and the camera.

`softvox_gym.raster` draws the pixels. Lengths are voxel widths.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import compress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softvox_gym import raster
from softvox_gym.raster import INK, NEAR, Array, Faces, png

__all__ = ["Pose", "Stage", "Walk", "fitting_distance", "lanes", "png", "render"]

FIELD_OF_VIEW = math.radians(30.0)  # across the shorter side of the picture
FILL = 4.8  # camera distance in radii of the robot: leaves room for the shadow and a few steps
SMALLEST_RADIUS = 2.2  # of a 2x2x2 robot at its largest, so that its pumping does not zoom
AIM = 0.065  # height of the point looked at, in camera distances: puts the robot in the middle

LINE = 0.017  # half width of the cubes' edges on each face, voxel widths at the point looked at
THINNEST_LINE = 0.45  # pixels; the same half width for robots seen from afar

LIGHT = np.array([-0.42, -0.30, 1.0]) / math.hypot(0.42, 0.30, 1.0)  # towards the light
DARKEST = 0.46  # brightness of a face turned right away from the light
PENUMBRA = 0.11  # blur radius of the cast shadow, voxel widths

PASSIVE = (0.30, 0.84, 0.93)  # cyan
ACTIVE = (0.95, 0.27, 0.22)  # red

AZIMUTH = -62.0  # degrees; of the camera if the robot has gone nowhere
NOWHERE = 0.05  # voxel widths; a shorter path has no direction
ROOM = 0.8  # room for a robot beside its path, over half the picture for it alone
FARTHEST = 2.6  # times the distance for a robot alone; a longer path is followed
TRAIL = (0.36, 0.20, 0.52)  # the path of the centre of mass: neither cyan nor red, and dark
TRAIL_WIDTH = 2.6  # pixels in a picture of 360 rows, and in proportion
GHOST = 0.17  # opacity of the robot where it stood when the pump began
RULER_GAP = 0.19  # from the path to the ruler, in distances for a robot alone
TICK = 0.16  # voxel widths, half of a tick that has a number
SIGN = 0.18  # from a start back to the label beside it, in distances for a robot alone
LANE = 0.3  # between robots in one scene, in distances for a robot alone

MOST_TICKS = 2000  # of a ruler, on either side of the start

# The corners of a cube, by bits x, y, z; those of its faces +x, -x, +y, -y, +z, -z, anticlockwise.
CORNERS = np.array([[2 * (c >> axis & 1) - 1.0 for axis in range(3)] for c in range(8)])
FACES = np.array(
    [[1, 3, 7, 5], [0, 4, 6, 2], [2, 6, 7, 3], [0, 1, 5, 4], [4, 5, 7, 6], [0, 2, 3, 1]]
)


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
        Lattice site of each voxel. With it, neighbours are drawn as one skin: each corner that they
        share is the mean of theirs. Without it, every voxel is a cube.

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

    The default of `render`; all robots of up to about 2x2x2 voxels have the same. For a film of a
    large robot, compute it once, from the first pose, and pass it to every frame, so that the
    picture does not zoom as the robot deforms.
    """
    position, edge = np.asarray(pose.position, float), np.asarray(pose.edge, float)
    if not len(position):
        return FILL * SMALLEST_RADIUS
    centre = position.mean(axis=0)
    reach = np.linalg.norm(position - centre, axis=1) + math.sqrt(0.75) * edge
    return FILL * max(SMALLEST_RADIUS, float(reach.max()))


class Walk(NamedTuple):
    """The start and path of a robot, which its pictures show too; lengths in voxel widths."""

    start: Pose  #: as it stood when the pump began
    path: Array  #: (k, 3) its centre of mass from then to the end

    @property
    def way(self) -> Array:
        """Vector from the path's start to its end, on the floor, shape (2,)."""
        return np.asarray(self.path[-1, :2] - self.path[0, :2])

    def moved(self, shift: Array) -> Walk:
        """Return the walk shifted."""
        start = replace(self.start, position=self.start.position + shift)
        return Walk(start, self.path + shift)


class Stage:
    """A scene in which robots are drawn frame after frame; see `render`.

    Parameters
    ----------
    walks : sequence of Walk
        The walks of the robots, in order. With them the pictures show a ghost of each robot at its
        start, the path so far, a ruler along the first robot's path, and the distance in words; the
        camera looks across that path and sees all paths, or follows if they are long.
    width, height, look_at, distance, azimuth, elevation, boxes
        As in `render`.
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
        self.heading = _heading(self.walks, AZIMUTH if azimuth is None else azimuth)
        self.azimuth = self.heading - math.pi / 2 if azimuth is None else math.radians(azimuth)
        self.camera = np.zeros((3, 4))
        self._backdrops: dict[bytes, Array] = {}  # only the last one, for a still camera

    def picture(
        self, poses: Sequence[Pose], moments: Sequence[int] | None = None
    ) -> NDArray[np.uint8]:
        """Draw the robots, each at an index of its path; the last point if past its end or None.

        Raises
        ------
        ValueError
            If there are not as many moments as walks.
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
            faces = Faces(*map(np.concatenate, zip(*shapes, strict=True)))
            blur = PENUMBRA * scale
            raster.cast_shadow(picture, faces, self.camera, light, blur, math.sin(self.elevation))
            self._draw_travel(picture, so_far)
            raster.draw_faces(picture, faces, self.camera, line)
        if so_far:
            gone = [f"{np.hypot(*(path[-1] - path[0])[:2]):.2f}" for path in so_far]
            size, words = self._letters, f"{'  '.join(gone)} voxel widths"
            raster.write(picture, words, 6 * size, self.height - 6 * size, size)
        channels = [(channel * 255 + 0.5).astype(np.uint8) for channel in picture]
        return np.stack(channels, axis=-1)

    def sign(self, robot: int) -> tuple[float, float]:
        """Return the pixel (x, y) in the last picture to the left of a robot's start."""
        ahead = np.array([math.cos(self.heading), math.sin(self.heading), 0.0])
        place = self.walks[robot].path[0] - SIGN * self._alone * ahead
        x, y, depth = self.camera @ [*place, 1.0]
        depth = max(depth, NEAR)  # points behind the camera map far outside the picture
        return float(x / depth), float(y / depth)

    @property
    def _letters(self) -> int:
        """The dot size of letters, pixels."""
        return max(1, round(self.height / 220))

    @property
    def _alone(self) -> float:
        """The distance at which each robot of the walks fits into the picture."""
        return max(fitting_distance(walk.start) for walk in self.walks)

    def _aim(self, poses: Sequence[Pose], so_far: Sequence[Array]) -> tuple[Array, float]:
        """Return the target of the camera and its distance."""
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
        """Return a target and a distance that show all paths, or if they can't, the robots now.

        Treats the picture's two directions on the floor separately: to the right, and towards the
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
        """Draw the static parts: the floor, the ghosts and the ruler."""
        picture = raster.floor(self.camera, (self.width, self.height), target, distance)
        for walk in self.walks:
            ghost = _faces(walk.start, light, boxes=self.boxes)
            raster.draw_faces(picture, ghost, self.camera, line, GHOST)
        if self.walks:
            self._draw_ruler(picture)
        return picture

    def _draw_ruler(self, picture: Array) -> None:
        """Draw the ruler: from the start along the path, with a tick each voxel width."""
        low, high = self._reach
        step = _numbered(high - low)
        width = TRAIL_WIDTH * self.height / 360 / 2
        raster.stroke(picture, self.camera, [self._on_ruler([low, high], [0, 0])], width, INK)
        ticks = [
            self._on_ruler([s, s], [0, TICK * (1 if s % step else 2)]) for s in range(low, high + 1)
        ]
        raster.stroke(picture, self.camera, ticks, width / 2, INK)
        for s in range(low, high + 1):
            if s % step == 0:
                [x, y, depth] = self.camera @ [*self._on_ruler([s], [3 * TICK])[0], 1.0]
                if depth > NEAR:
                    raster.write(
                        picture, str(s), x / depth, y / depth, self._letters, is_centred=True
                    )

    def _draw_travel(self, picture: Array, so_far: Sequence[Array]) -> None:
        """Draw the paths so far, and the first robot's position on the ruler."""
        width = TRAIL_WIDTH * self.height / 360
        lines = [path * [1, 1, 0] for path in so_far if len(path) > 1]
        if lines:
            along = float(self._along(so_far[0][-1, :2]))
            lines.append(self._on_ruler([0, along], [0, 0]))
            raster.stroke(picture, self.camera, lines, width, TRAIL)

    def _along(self, places: Array) -> Array:
        """Return the coordinates of points (..., 2) along the ruler."""
        ahead = [math.cos(self.heading), math.sin(self.heading)]
        return np.asarray((places - self.walks[0].path[0, :2]) @ ahead)

    @property
    def _reach(self) -> tuple[int, int]:
        """The whole numbers at which the ruler begins and ends."""
        places = np.concatenate([self._along(walk.path[:, :2]) for walk in self.walks])
        low, high = math.floor(places.min() + 0.5), math.ceil(places.max() - 0.02)
        return max(min(low, 0), -MOST_TICKS), min(max(high, 1), MOST_TICKS)

    def _on_ruler(self, along: Sequence[float], off: Sequence[float]) -> Array:
        """Return points (k, 3) at distances along the ruler, and off it towards the viewer."""
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
        The robot; None, or no voxels, for an empty floor.
    walk : Walk, optional
        Its walk so far: the picture shows the path on the floor, a ghost of the robot at its start,
        a ruler in voxel widths along the path, and the distance in words.
    width, height : int
        Size of the picture, pixels.
    look_at : three floats, optional
        Point in the middle of the picture, voxel widths. By default it follows the robot's
        horizontal centre, at a constant height, or shows the whole walk.
    distance : float, optional
        Distance from the camera to that point, voxel widths; by default `fitting_distance`, or as
        far as the walk needs.
    azimuth : float, optional
        Direction from that point to the camera, degrees from +x towards +y. By default -62, or
        across the walk, which then goes to the right. The light turns with it.
    elevation : float
        Angle of the camera above the horizon, degrees, above 0 and up to 90.
    boxes : bool
        Whether to draw each voxel as the cube that it is in the model, not as part of a skin.

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
    """Return the shifts (3,) that put walks side by side, the first in front."""
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
    """Raise ValueError as `render` does."""
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


def _heading(walks: Sequence[Walk], azimuth: float = AZIMUTH) -> float:
    """Return the direction of the first walk, radians; to the right if it leads nowhere."""
    if walks and math.hypot(*walks[0].way.tolist()) >= NOWHERE:
        x, y = walks[0].way.tolist()
        return math.atan2(y, x)
    return math.radians(azimuth) + math.pi / 2


def _light(azimuth: float) -> Array:
    """Return the direction to the light, which is at the viewer's left; radians."""
    turn = azimuth - math.radians(AZIMUTH)
    sine, cosine = math.sin(turn), math.cos(turn)
    x, y, z = LIGHT.tolist()
    return np.array([cosine * x - sine * y, sine * x + cosine * y, z])


def _numbered(length: float) -> int:
    """Return the step between numbered ticks of a ruler."""
    return next((step for step in (1, 2, 5, 10, 20, 50) if length / step <= 8), 100)


def _view(target: Array, distance: float, azimuth: float, elevation: float) -> Array:
    """Return the matrix (3, 4) from points (x, y, z, 1) to right, down and depth; radians."""
    level, rise = math.cos(elevation), math.sin(elevation)
    backward = np.array([level * math.cos(azimuth), level * math.sin(azimuth), rise])
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    rotation = np.stack([right, np.cross(right, backward), -backward])
    return np.column_stack([rotation, -rotation @ (target + distance * backward)])


def _faces(pose: Pose, light: Array, *, boxes: bool) -> Faces:
    """Return the faces of a robot that are visible from outside."""
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
        return Faces(frame, np.zeros(len(frame)), colour)
    lower = np.stack([(b - a) / 2, (c - b) / 2, middle], -1)
    upper = np.stack([(c - d) / 2, (d - a) / 2, middle], -1)
    half = np.repeat([1.0, -1.0], len(middle))
    return Faces(np.concatenate([lower, upper]), half, np.tile(colour, (2, 1)))


@lru_cache(maxsize=64)
def _skin(sites: bytes) -> tuple[Array, Array]:
    """Return which corners coincide, and which faces are outside, for voxels on their sites.

    Returns for every corner the group (8 m,) that it shares with neighbours, and with neighbours of
    those around it; and whether each of the faces +x, -x, +y, -y, +z, -z is outside (m, 6).
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
