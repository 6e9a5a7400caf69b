"""Films with captions: GIF by Pillow, MP4 by the ffmpeg of imageio-ffmpeg."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from softvox_gym.engine import Progress
from softvox_view.replay.still import columns

Picture = NDArray[np.uint8]

CAPTION_SIZE = 0.05  # of a panel's height
SMALLEST_CAPTION = 9  # pixels, below which it can't be read
CAPTION_INK = (26, 31, 41)
COLOURS = 256
SAMPLES = 6  # beside the first, pictures that the colours of a GIF are taken from
LOOP_FOREVER = 0
CENTISECOND = 100  # per second: what a GIF counts in
FASTEST_GIF = 50  # pictures per second; browsers slow faster ones down to 10
CRF = "20"  # quality of an MP4: lower is better and larger, 18 looks lossless


def captioned(
    picture: Picture, captions: Sequence[tuple[str, str]], panel: tuple[int, int]
) -> Picture:
    """Write captions into the upper left corners of the panels of `softvox_view.replay.still`.

    Each with a shorter one for where it has no room; a panel has a width and a height, pixels.
    """
    from PIL import Image, ImageDraw, ImageFont

    image = Image.fromarray(picture)
    draw = ImageDraw.Draw(image)
    width, height = panel
    size = max(round(CAPTION_SIZE * height), SMALLEST_CAPTION)
    font = ImageFont.load_default(size)
    across = columns(len(captions))
    for k, (long, short) in enumerate(captions):
        caption = long if font.getlength(long) <= width - 2 * size else short
        corner = (k % across * width + size, k // across * height + size * 0.7)
        draw.text(corner, caption, fill=CAPTION_INK, font=font)
    return np.asarray(image)


def gif_fps(fps: float) -> float:
    """Return the pictures per second nearest to a wish that a GIF can have.

    It counts the time of a picture in whole hundredths of a second, and below two of them browsers
    play it slowly.
    """
    return CENTISECOND / max(round(CENTISECOND / fps), CENTISECOND // FASTEST_GIF)


def gif(
    draw: Callable[[int], Picture], count: int, *, fps: float, progress: Progress | None = None
) -> bytes:
    """Return a film of so many pictures as the bytes of a GIF that repeats for ever.

    `draw` returns the k-th, shape (height, width, 3); `fps` is rounded as `gif_fps` does.
    """
    from PIL import Image

    # One palette for all, or the colours flicker; no dithering, whose dots swell the file.
    samples = [draw(k) for k in sorted({i * (count - 1) // SAMPLES for i in range(SAMPLES + 1)})]
    palette = Image.fromarray(np.concatenate(samples)).quantize(COLOURS, kmeans=3)
    pictures = (
        Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE)
        for picture in _drawn(draw, count, progress)
    )
    file = io.BytesIO()
    next(pictures).save(
        file,
        format="GIF",
        save_all=True,
        append_images=pictures,
        duration=round(1000 / gif_fps(fps)),
        loop=LOOP_FOREVER,
        optimize=False,  # the palette is one for all, and stays as it is
        disposal=1,
    )
    return file.getvalue()


def mp4(
    draw: Callable[[int], Picture], count: int, *, fps: float, progress: Progress | None = None
) -> bytes:
    """Return a film as the bytes of an MP4 (H.264, which every browser plays).

    As `gif`, but width and height must be even, and fps is not rounded; OSError where ffmpeg fails.
    """
    import imageio_ffmpeg

    height, width, _ = draw(0).shape
    with TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        writer = imageio_ffmpeg.write_frames(
            str(path),
            (width, height),
            fps=fps,
            codec="libx264",
            quality=None,
            macro_block_size=2,
            ffmpeg_log_level="error",
            output_params=["-crf", CRF, "-fflags", "+bitexact", "-movflags", "+faststart"],
        )
        writer.send(None)
        try:
            for picture in _drawn(draw, count, progress):
                writer.send(np.ascontiguousarray(picture))
        finally:
            writer.close()
        return path.read_bytes()


def _drawn(
    draw: Callable[[int], Picture], count: int, progress: Progress | None
) -> Iterator[Picture]:
    for k in range(count):
        yield draw(k)
        if progress is not None:
            progress(k + 1, count)
