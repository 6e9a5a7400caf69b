"""Gymnasium's RecordVideo films the environment."""

import gymnasium as gym
import numpy as np
import pytest
from films import read_film
from gymnasium.wrappers import RecordVideo

from softvox_gym.wrappers import RecordWalk

pytest.importorskip("moviepy", reason="RecordVideo needs moviepy: pip install moviepy")


def test_record_video_films_each_episode(tmp_path):
    bare = gym.make("SoftVox2x2x2-v0", render_mode="rgb_array")
    env = RecordVideo(bare, str(tmp_path / "films"), episode_trigger=lambda episode: True, fps=2)
    env.reset(seed=0)
    env.step(np.array([0, 0, 0, 2, 1, 2, 2, 2]))
    shown = env.unwrapped.render()
    env.close()
    [path] = (tmp_path / "films").glob("*.mp4")
    film = read_film(path)
    assert film.pictures.shape == (2, *shown.shape)  # the floor after the reset, then the robot
    red = [int(np.count_nonzero(p[..., 0] > p[..., 2].astype(int) + 80)) for p in film.pictures]
    assert red[0] < 100 < 5000 < red[1]


def test_record_walk_films_the_way_from_the_start(tmp_path):
    physics = {"preset": "published", "duration": 0.75}
    bare = gym.make("SoftVox2x2x2-v0", render_mode="rgb_array_list", physics=physics)
    env = RecordWalk(bare, str(tmp_path / "films"), episode_trigger=lambda episode: True)
    env.reset(seed=0)
    env.step(np.array([0, 0, 0, 2, 1, 2, 2, 2]))
    env.reset()
    env.close()
    first, second = sorted((tmp_path / "films").glob("*.mp4"))
    film = read_film(first)
    assert film.fps == 25
    assert len(film.pictures) == 1 + 25  # the floor, then half a second at half its speed
    red = film.pictures[..., 0] > film.pictures[..., 2].astype(int) + 80
    middles = [np.flatnonzero(picture.any(axis=0)).mean() for picture in red[1:]]
    assert middles[-1] > middles[0] + 20  # to the right
    assert not red[0].any()
    assert len(read_film(second).pictures) == 1


def test_record_walk_films_every_step_of_a_controlled_robot(tmp_path):
    physics = {"preset": "published", "duration": 0.75}
    bare = gym.make("SoftVoxControl-v0", render_mode="rgb_array_list", physics=physics)
    env = RecordWalk(bare, str(tmp_path / "films"), episode_trigger=lambda episode: True)
    env.reset(seed=0)
    for _ in range(2):
        env.step(env.action_space.high)
    env.close()
    [path] = (tmp_path / "films").glob("*.mp4")
    film = read_film(path)
    assert film.fps == 25
    assert len(film.pictures) == 1 + 2 * 13  # as it stands, then two cycles at half their speed


def test_record_walk_asks_for_a_list_of_pictures(tmp_path):
    with pytest.raises(ValueError, match="render_mode='rgb_array_list', got 'rgb_array'"):
        RecordWalk(gym.make("SoftVox2x2x2-v0", render_mode="rgb_array"), str(tmp_path))
