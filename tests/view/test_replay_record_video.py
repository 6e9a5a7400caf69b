"""Gymnasium's RecordVideo films the environment."""

import gymnasium as gym
import numpy as np
import pytest
from films import read_film
from gymnasium.wrappers import RecordVideo

import softvox_gym  # noqa: F401  registers the environment

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
