"""Reading films back, with the ffmpeg that writes them."""

import re
import subprocess
from pathlib import Path
from typing import NamedTuple

import numpy as np


class Film(NamedTuple):
    codec: str
    fps: float
    pictures: np.ndarray  # (n, height, width, 3)


def read_film(path: Path) -> Film:
    from imageio_ffmpeg import get_ffmpeg_exe

    done = subprocess.run(
        [get_ffmpeg_exe(), "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=True,
    )
    about = re.search(r"Video: (\w+).*?, (\d+)x(\d+).*?, ([\d.]+) fps", done.stderr.decode())
    width, height = int(about[2]), int(about[3])
    pictures = np.frombuffer(done.stdout, np.uint8).reshape(-1, height, width, 3)
    return Film(about[1], float(about[4]), pictures)
