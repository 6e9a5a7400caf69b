from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest

from softvox_gym import raster
from softvox_gym.rendering import GHOST, TRAIL, Pose, Stage, Walk, fitting_distance, png, render


def pose_of(design: str, *, side: int = 2, shift: tuple[float, float, float] = (0, 0, 0)) -> Pose:
    """Return a robot at rest: digit i is site x + side (y + side z); 0 absent, 1 passive."""
    sites = [i for i, digit in enumerate(design) if digit != "0"]
    corner = [(i % side, i // side % side, i // side**2) for i in sites]
    return Pose(
        position=np.reshape(corner, (-1, 3)) + 0.5 + np.array(shift),
        quaternion=np.tile([1.0, 0.0, 0.0, 0.0], (len(sites), 1)),
        edge=np.ones(len(sites)),
        active=np.array([design[i] == "2" for i in sites], bool),
        site=np.reshape(corner, (-1, 3)),
    )


def changed(pose: Pose, **values: Any) -> Pose:
    return Pose(**{**vars(pose), **values})


def red(picture: np.ndarray) -> np.ndarray:
    r, g, b = np.moveaxis(picture.astype(int), -1, 0)
    return (r > 130) & (r > 2.5 * g) & (r > 2.5 * b)


def cyan(picture: np.ndarray) -> np.ndarray:
    r, g, b = np.moveaxis(picture.astype(int), -1, 0)
    return (g > 110) & (b > 120) & (g > 2 * r) & (b > 2 * r)


def robot(picture: np.ndarray) -> np.ndarray:
    return red(picture) | cyan(picture)


@pytest.mark.parametrize(("width", "height"), [(480, 360), (101, 67), (60, 200), (1, 1)])
def test_a_picture_has_the_asked_size_and_holds_bytes(width: int, height: int) -> None:
    picture = render(pose_of("00021222"), width=width, height=height)
    assert picture.shape == (height, width, 3)
    assert picture.dtype == np.uint8
    assert picture.flags.c_contiguous


def test_no_voxels_look_like_no_pose() -> None:
    np.testing.assert_array_equal(render(pose_of("00000000")), render(None))


def test_the_empty_floor_is_light_and_has_a_grid() -> None:
    picture = render(None)
    assert np.median(picture) > 220
    assert picture[240:].std() > 2
    assert not robot(picture).any()


def test_equal_arguments_give_equal_bytes() -> None:
    assert render(pose_of("12211221")).tobytes() == render(pose_of("12211221")).tobytes()


def test_rendering_leaves_the_pose_as_it_was() -> None:
    pose = pose_of("00021222")
    before = {name: value.copy() for name, value in vars(pose).items()}
    render(pose)
    for name, value in before.items():
        np.testing.assert_array_equal(getattr(pose, name), value)


def test_active_voxels_are_red_and_passive_ones_cyan() -> None:
    active, passive, both = (render(pose_of(d)) for d in ("22222222", "11111111", "12121212"))
    assert red(active).sum() > 10_000
    assert not cyan(active).any()
    assert cyan(passive).sum() > 10_000
    assert not red(passive).any()
    assert red(both).sum() > 3_000
    assert cyan(both).sum() > 3_000


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_a_nearer_cube_hides_a_farther_one(order: list[int]) -> None:
    # The camera stands on the -y side, so the active cube at y = 0 hides the passive one at y = 2.
    position = np.array([[0.5, 0.5, 0.5], [0.5, 2.5, 0.5]])[order]
    active = np.array([True, False])[order]
    pose = Pose(position, np.tile([1.0, 0, 0, 0], (2, 1)), np.ones(2), active)
    view: dict[str, Any] = {"look_at": (0.5, 1.5, 0.5), "azimuth": -90.0, "elevation": 2.0}
    picture = render(pose, **view)
    assert red(picture).sum() > 1_000
    assert not cyan(picture).any()
    picture = render(pose, **{**view, "azimuth": 90.0})
    assert cyan(picture).sum() > 1_000
    assert not red(picture).any()


def test_of_two_interpenetrating_cubes_each_shows_its_nearer_part() -> None:
    # Seen from above, two cubes with one centre; tilting one makes each the higher on one side.
    tilt = np.radians(20) / 2
    pose = Pose(
        position=np.array([[0.0, 0.0, 0.6], [0.0, 0.0, 0.6]]),
        quaternion=np.array([[1.0, 0, 0, 0], [np.cos(tilt), 0, np.sin(tilt), 0]]),
        edge=np.ones(2),
        active=np.array([True, False]),
    )
    picture = render(pose, azimuth=-90.0, elevation=90.0, distance=4.0)
    # A positive turn about y lowers the +x side, which is on the right.
    assert cyan(picture)[180, 190:225].mean() > 0.9
    assert red(picture)[180, 265:290].mean() > 0.9


def test_the_floor_hides_what_has_sunk_into_it() -> None:
    above = render(pose_of("2", side=1), look_at=(0.5, 0.5, 0.5))
    sunk = render(pose_of("2", side=1, shift=(0, 0, -0.5)), look_at=(0.5, 0.5, 0.5))
    buried = render(pose_of("2", side=1, shift=(0, 0, -1.5)), look_at=(0.5, 0.5, 0.5))
    assert 0 < red(sunk).sum() < 0.9 * red(above).sum()
    assert not red(buried).any()


def test_a_larger_edge_makes_a_larger_cube() -> None:
    pose = pose_of("2", side=1)
    swollen = changed(pose, edge=np.array([1.24]))
    assert red(render(swollen)).sum() > 1.3 * red(render(pose)).sum()


def test_only_the_direction_of_a_quaternion_counts() -> None:
    pose = pose_of("00021222")
    scaled = changed(pose, quaternion=-4.0 * pose.quaternion)
    np.testing.assert_array_equal(render(scaled), render(pose))


def test_a_quarter_turn_of_a_cube_changes_nothing_to_see() -> None:
    pose = pose_of("2", side=1)
    turned = changed(pose, quaternion=np.array([[1.0, 0.0, 0.0, 1.0]]))
    difference = render(turned).astype(int) - render(pose).astype(int)
    assert (np.abs(difference) > 2).mean() < 1e-3


@pytest.mark.parametrize("shift", [(5, -4, 0), (-7.3, 2.2, 0), (300, 41, 0)])
def test_a_robot_that_has_walked_stays_in_the_picture(shift: tuple[float, float, float]) -> None:
    home, away = robot(render(pose_of("00021222"))), robot(render(pose_of("00021222", shift=shift)))
    assert abs(int(away.sum()) - int(home.sum())) < 0.02 * home.sum()
    assert not away[[0, -1]].any()
    assert not away[:, [0, -1]].any()


def test_the_grid_shows_a_walk_that_the_camera_follows() -> None:
    home, away = render(pose_of("00021222")), render(pose_of("00021222", shift=(0.5, 0, 0)))
    assert (home[300:].astype(int) != away[300:]).mean() > 0.05


def test_a_fixed_camera_sees_the_robot_move_right_along_x() -> None:
    view: dict[str, Any] = {"look_at": (0.0, 0.0, 0.5), "distance": 20.0}
    seen = [
        robot(render(pose_of("2", side=1, shift=(x, 0, 0)), **view)).any(axis=0)
        for x in (-1.0, 0.0, 1.0)
    ]
    columns = [np.flatnonzero(row).mean() for row in seen]
    assert columns == sorted(columns)
    assert columns[-1] - columns[0] > 20


def test_a_large_robot_fits_into_the_picture() -> None:
    picture = robot(render(pose_of("12" * 108, side=6)))
    assert picture.sum() > 10_000
    assert not picture[[0, -1]].any()
    assert not picture[:, [0, -1]].any()


def test_small_robots_share_a_distance_and_large_ones_are_seen_from_farther() -> None:
    small = fitting_distance(pose_of("11111111"))
    assert fitting_distance(pose_of("2", side=1)) == small
    assert fitting_distance(pose_of("00000000")) == small
    breathing = changed(pose_of("22222222"), edge=np.full(8, 1.24))
    assert fitting_distance(breathing) == small
    assert fitting_distance(pose_of("1" * 216, side=6)) > 2 * small


def test_the_robot_casts_a_shadow_on_the_floor() -> None:
    # The light comes from -x, -y and above: the shadow falls on the floor beyond +x.
    pose = pose_of("11111111")
    view: dict[str, Any] = {"look_at": (1.0, 1.0, 0.7), "distance": 11.0}
    lit, shaded = (render(p, **view).astype(int).sum(axis=-1) for p in (None, pose))
    darker = (shaded < 0.8 * lit) & ~robot(render(pose, **view))
    assert darker[:, 330:].sum() > 500
    assert (shaded <= lit)[:, 380:].all()
    assert (shaded == lit)[:, :40].all()


def test_what_is_behind_the_camera_is_not_drawn() -> None:
    pose = pose_of("2", side=1, shift=(0, -40, 2))
    picture = render(pose, look_at=(0, 0, 0.5), distance=10.0, azimuth=-90.0)
    assert not robot(picture).any()


@pytest.mark.parametrize("scale", [1e-3, 1e4, 1e9])
def test_a_robot_that_has_fallen_apart_is_still_drawn(scale: float) -> None:
    pose = pose_of("12121212")
    scattered = changed(pose, position=pose.position * scale)
    walk = Walk(pose, np.outer([0.0, scale], [1.0, 2.0, 0.0]))
    assert render(scattered, walk).shape == (360, 480, 3)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("position", np.zeros((8, 2))),
        ("position", np.zeros(3)),
        ("position", np.float64(1.0)),
        ("position", np.full((8, 3), np.nan)),
        ("position", np.full((8, 3), np.inf)),
        ("quaternion", np.ones((8, 3))),
        ("quaternion", np.ones((7, 4))),
        ("quaternion", np.zeros((8, 4))),
        ("quaternion", np.full((8, 4), np.nan)),
        ("edge", np.ones((8, 1))),
        ("edge", np.zeros(8)),
        ("edge", np.full(8, np.nan)),
        ("active", np.ones(7, bool)),
        ("site", np.ones((7, 3), int)),
        ("active", np.ones(8, int)),
    ],
)
def test_a_bad_pose_is_refused_by_name(name: str, value: np.ndarray) -> None:
    # A wrong number of positions shows as the others not matching it.
    with pytest.raises(ValueError, match=f"^({name}|quaternion) must "):
        changed(pose_of("12121212"), **{name: value})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("width", 0),
        ("width", -5),
        ("width", 480.0),
        ("width", True),
        ("height", 0),
        ("height", "360"),
        ("look_at", (0.0, 0.0)),
        ("look_at", (0.0, 0.0, np.nan)),
        ("distance", 0.0),
        ("distance", np.inf),
        ("distance", np.nan),
        ("azimuth", np.nan),
        ("elevation", 0.0),
        ("elevation", 91.0),
        ("elevation", np.nan),
    ],
)
def test_a_bad_view_is_refused_by_name(name: str, value: Any) -> None:
    with pytest.raises(ValueError, match=f"^{name} must be "):
        render(None, **{name: value})


def test_a_numpy_integer_is_a_size() -> None:
    assert render(None, width=np.int64(40), height=np.int32(30)).shape == (30, 40, 3)


def test_boxes_and_skin_are_alike_at_rest_and_part_where_voxels_do() -> None:
    pose = pose_of("22222222")
    difference = np.abs(render(pose).astype(int) - render(pose, boxes=True))
    assert (difference > 60).mean() < 2e-3
    apart = changed(pose, position=pose.position + 0.15 * (pose.position - 1.0))
    skin, boxes = render(apart), render(apart, boxes=True)
    ink = [np.count_nonzero(picture.max(axis=-1) < 60) for picture in (skin, boxes)]
    assert red(skin).sum() > red(boxes).sum() + 1_000  # which have gaps, and more edges
    assert ink[0] < ink[1]


def test_the_skin_joins_what_is_linked_and_nothing_else() -> None:
    # Two voxels that meet in an edge only: each keeps its corners, as a box does.
    apart = pose_of("10000001")
    np.testing.assert_array_equal(render(apart) != 0, render(changed(apart, site=None)) != 0)
    swollen = changed(pose_of("11000000"), edge=np.array([1.4, 0.6]))
    assert (render(swollen) != render(swollen, boxes=True)).any()


WAYS = [(4.0, 0.0), (0.0, 4.0), (-3.0, 2.0), (-0.5, -4.5)]


def walked(way: tuple[float, float], design: str = "00021222", count: int = 9) -> Walk:
    start = pose_of(design)
    path = start.position.mean(axis=0) + np.outer(np.linspace(0, 1, count), [*way, 0.0])
    return Walk(start, path)


def arrived(walk: Walk) -> Pose:
    return changed(walk.start, position=walk.start.position + np.append(walk.way, 0.0))


def violet(picture: np.ndarray) -> np.ndarray:
    return np.abs(picture - 255 * np.array(TRAIL)).max(axis=-1) < 12


@pytest.mark.parametrize("way", WAYS)
def test_a_walk_goes_to_the_right_whole_in_the_picture(way: tuple[float, float]) -> None:
    walk = walked(way)
    stage = Stage([walk])
    home, away = stage.picture([walk.start], [0]), stage.picture([arrived(walk)])
    columns = [np.flatnonzero(robot(picture).any(axis=0)) for picture in (home, away)]
    assert columns[1].mean() - columns[0].mean() > 150
    for picture in (home, away):
        assert not robot(picture)[:, [0, -1]].any()
        assert not robot(picture)[[0, -1]].any()
    path = np.flatnonzero(violet(away).any(axis=0))
    assert not violet(home).any()
    assert path[-1] - path[0] > 150
    np.testing.assert_array_equal(away, render(arrived(walk), walk))


def test_a_ghost_stays_where_the_walk_began_and_a_ruler_lies_along_it() -> None:
    walk = walked((4.0, 0.0))
    stage = Stage([walk])
    with_ghost, robot_alone = stage.picture([arrived(walk)]), stage.picture([])
    pale = robot_alone.astype(int)
    coloured = pale.max(axis=-1) - pale.min(axis=-1) > 20 * GHOST / 0.17
    assert 3_000 < coloured[:, :240].sum() > 5 * coloured[:, 240:].sum()
    assert robot(with_ghost)[:, 240:].sum() > 3_000
    dark = robot_alone.max(axis=-1) < 90
    ruler = dark.sum(axis=1).argmax()
    length = np.count_nonzero(dark[ruler])
    assert length > 200
    longer = Stage([walked((4.0, 0.0))], width=960, height=720).picture([])
    assert np.count_nonzero((longer.max(axis=-1) < 90).any(axis=0)) > 1.8 * length


def test_the_distance_so_far_is_written_below() -> None:
    walk = walked((4.0, 0.0))
    stage = Stage([walk])
    words = [stage.picture([], [moment])[330:, :200] for moment in (0, 4, 8)]
    assert all((picture.max(axis=-1) < 90).sum() > 300 for picture in words)
    assert (words[0] != words[1]).any()
    assert (words[1][:, 60:] == words[2][:, 60:]).all()  # "voxel widths"


def test_a_path_that_is_too_long_is_followed() -> None:
    walk = walked((60.0, 0.0), count=61)
    stage = Stage([walk])
    seen = []
    for moment in (0, 30, 60):
        pose = changed(walk.start, position=walk.start.position + np.eye(3)[0] * moment)
        seen.append(robot(stage.picture([pose], [moment])))
    assert all(picture.sum() > 500 for picture in seen)
    assert not any(picture[:, [0, -1]].any() for picture in seen)
    middles = [np.flatnonzero(picture.any(axis=0)).mean() for picture in seen]
    assert middles[0] < 200 < middles[1] < 280 < middles[2]


def test_robots_side_by_side_share_a_floor() -> None:
    walks = [walked((4.0, 0.0)), walked((-2.0, 0.0)).moved(np.array([0.0, 4.0, 0.0]))]
    picture = Stage(walks).picture([arrived(walk) for walk in walks])
    middles = np.flatnonzero(robot(picture).any(axis=0))
    assert np.diff(middles).max() > 20  # the first went to the right, the other to the left
    assert not robot(picture)[:, [0, -1]].any()


def test_a_walk_to_nowhere_is_seen_as_a_robot_at_rest_is() -> None:
    walk = walked((0.0, 1e-6))
    difference = np.abs(render(walk.start, walk)[:240].astype(int) - render(walk.start)[:240])
    assert (difference > 60).mean() < 0.01
    empty = Walk(pose_of("00000000"), np.zeros((1, 3)))
    np.testing.assert_array_equal(render(None, empty), render(None))


def test_a_png_holds_the_picture():
    image = pytest.importorskip("PIL.Image")
    picture = np.random.default_rng(0).integers(0, 256, (5, 7, 3), dtype=np.uint8)
    np.testing.assert_array_equal(np.asarray(image.open(io.BytesIO(png(picture)))), picture)


def test_from_within_a_voxel_the_shadow_is_not_blurred_over_many_pictures(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sizes, blur = [], raster._box_blur

    def counted(image: raster.Array, radius: int, axis: int) -> raster.Array:
        sizes.append(image.size)
        return blur(image, radius, axis)

    monkeypatch.setattr(raster, "_box_blur", counted)
    assert render(pose_of("00021222"), width=40, height=30, distance=0.01).shape == (30, 40, 3)
    assert max(sizes) < 100_000
