"""Replays: recordings of moving robots, the player in the browser, and the page around it."""

from softvox_view.replay.data import lap, recording, versus
from softvox_view.replay.gltf import glb
from softvox_view.replay.page import SPEED, page, script, style
from softvox_view.replay.still import still

__all__ = ["SPEED", "glb", "lap", "page", "recording", "script", "still", "style", "versus"]
