"""Draw the committed pictures anew that are made of figures.

Run by `make pictures`, after a change of how figures look: the README's gallery and heatmap, and
baselines/*/figures, the figures of the committed comparisons, from their tables.
"""

import io
from pathlib import Path

from PIL import Image

from softvox_gym.files import write_file
from softvox_search.report import figures, style, text
from softvox_view.figures import files_of, make

ROOT = Path(__file__).parents[1]
BASELINES = ("noise_free", "noise")

#: Pixels, and colours: the README shows it no wider, and a hundred shaded robots make a large file.
GALLERY_WIDTH, GALLERY_COLOURS = 1100, 128


def draw_docs() -> None:
    """Draw what the README shows."""
    heatmap = files_of(make("heatmap"), ["png"])["heatmap.png"]
    write_file(ROOT / "docs" / "heatmap.png", heatmap, force=True)
    gallery = Image.open(io.BytesIO(files_of(make("gallery"), ["png"])["gallery.png"]))
    height = gallery.height * GALLERY_WIDTH // gallery.width
    small = gallery.convert("RGB").resize((GALLERY_WIDTH, height), Image.Resampling.LANCZOS)
    content = io.BytesIO()
    small.quantize(GALLERY_COLOURS).save(content, "png", optimize=True)
    write_file(ROOT / "docs" / "gallery.png", content.getvalue(), force=True)


def draw_baselines() -> None:
    """Draw the figures of the committed comparisons, as their reports do."""
    for name in BASELINES:
        folder = ROOT / "baselines" / name
        with style.style():
            for key, figure in figures.draw(text.read(folder / "tables")).items():
                write_file(folder / "figures" / f"{key}.png", style.encoded(figure), force=True)


def main() -> None:
    """Draw all."""
    draw_docs()
    draw_baselines()


if __name__ == "__main__":
    main()
