"""Replays: what a player in a browser needs to show robots moving, and the page around it."""

from softvox_gym.replay.data import pose, recording
from softvox_gym.replay.page import SPEED, page, script, style
from softvox_gym.replay.recorded import Recorded
from softvox_gym.replay.still import still

__all__ = ["SPEED", "Recorded", "page", "pose", "recording", "script", "still", "style"]
