"""Draw the pictures anew that are committed and that figures are made of.

Run by `make pictures`, after a change of how figures look. baselines/*/figures: of the committed
comparisons, from their tables.
"""

from pathlib import Path

from softvox_gym.files import write_file
from softvox_search.report import canvas
from softvox_search.report.drawing import drawn
from softvox_view.results_folder import read

ROOT = Path(__file__).parents[1]
BASELINES = ("noise_free", "noise")


def draw_baselines() -> None:
    """Draw the figures of the committed comparisons, as their reports do."""
    for name in BASELINES:
        folder = ROOT / "baselines" / name
        with canvas.style():
            for key, figure in drawn(read(folder)).items():
                write_file(folder / "figures" / f"{key}.png", canvas.png(figure), force=True)


def main() -> None:
    """Draw all."""
    draw_baselines()


if __name__ == "__main__":
    main()
