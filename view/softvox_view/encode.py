"""Films with captions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softvox_view.replay.still import columns

Picture = NDArray[np.uint8]

CAPTION_SIZE = 0.05  # of a panel's height
SMALLEST_CAPTION = 9  # pixels, below which it can't be read
CAPTION_INK = (26, 31, 41)
HALO = (249, 250, 251)  # around words that may lie over a robot


class Caption(NamedTuple):
    """The text written into a panel."""

    lines: Sequence[tuple[str, str]]  # each with a shorter form for when it has no room
    signs: Sequence[tuple[float, float, str]] = ()  # x, y, pixels, and a text that ends there


#: ffmpeg's settings by kind of film: codec, pixel format, further options.
KINDS = {
    # One palette for all pictures, or the colours flicker; no dithering: its dots swell the file.
    ".gif": ("gif", "pal8", ["-vf", "split[a][b];[a]palettegen[p];[b][p]paletteuse=dither=none"]),
    # H.264, which every browser plays; 18 looks lossless.
    ".mp4": ("libx264", "yuv420p", ["-crf", "20", "-movflags", "+faststart"]),
}


def captioned(picture: Picture, panels: Sequence[Caption], panel: tuple[int, int]) -> Picture:
    """Write captions into the upper left corners of the panels of `softvox_view.replay.still`.

    A panel has a width and a height, pixels.
    """
    from PIL import Image, ImageDraw, ImageFont

    image = Image.fromarray(picture)
    draw = ImageDraw.Draw(image)
    width, height = panel
    size = max(round(CAPTION_SIZE * height), SMALLEST_CAPTION)
    font = ImageFont.load_default(size)
    across = columns(len(panels))
    for k, caption in enumerate(panels):
        left, top = k % across * width, k // across * height
        for line, (long, short) in enumerate(caption.lines):
            text = long if font.getlength(long) <= width - 2 * size else short
            corner = (left + size, top + size * (0.7 + 1.3 * line))
            draw.text(corner, text, fill=CAPTION_INK, font=font)
        for x, y, text in caption.signs:
            place = left + max(x, font.getlength(text) + size / 2), top + y
            draw.text(place, text, CAPTION_INK, font, "rm", stroke_width=1, stroke_fill=HALO)
    return np.asarray(image)


def film(kind: str, pictures: Iterable[Picture], size: tuple[int, int], fps: float) -> bytes:
    """Return a film, one of `KINDS`, of pictures (height, width, 3); a GIF repeats for ever.

    `size` is their width and height, both even.

    Raises
    ------
    OSError, RuntimeError
        If ffmpeg fails, or is not there.
    """
    import imageio_ffmpeg

    codec, pixels, options = KINDS[kind]
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"film{kind}"
        writer = imageio_ffmpeg.write_frames(
            str(path),
            size,
            fps=fps,
            codec=codec,
            pix_fmt_out=pixels,
            quality=None,
            macro_block_size=2,
            ffmpeg_log_level="error",
            output_params=["-fflags", "+bitexact", *options],
        )
        writer.send(None)
        try:
            for picture in pictures:
                writer.send(np.ascontiguousarray(picture))
        finally:
            writer.close()
        return path.read_bytes()
