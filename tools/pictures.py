"""Redraw the committed pictures that are made of figures.

Run by `make pictures`, after a change in the look of figures. Redraws the figures of
docs/figures.md, docs/trials-compare.md and the README; those of baselines/*/report.md, with these
pages, from the tables of the committed comparisons; and the films of docs/environments/control.md
and growth.md.
"""

import io
from contextlib import chdir
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import gymnasium as gym
import numpy as np
from PIL import Image

from softvox_gym import landscape
from softvox_gym.build import plan
from softvox_gym.design import Design, buildable
from softvox_gym.files import write_file
from softvox_gym.landscapes.table import all_digits, phased_lattice
from softvox_gym.rendering import Stage, Walk
from softvox_gym.trials import compare
from softvox_search.experiment.results import read
from softvox_search.report import figures, page, style, text, transfer, transfer_figures
from softvox_view.encode import film
from softvox_view.figures import FIGURES, OF_RESULTS, Drawing, Inputs, files_of, make, sheets
from softvox_view.figures import style as view_style
from softvox_view.figures.pages import style as sheet_style
from softvox_view.figures.trials import draw_comparison

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
BASELINES = ("noise_free", "noise", "transfer", "phased")

#: Colours of the files; pictures have fewer, except those of shaded robots.
COLOURS = 256

#: The best design of the published landscape.
BEST = Design(6453)


def smaller(png: bytes) -> bytes:
    """Return a picture with a palette of `COLOURS`."""
    content = io.BytesIO()
    picture = Image.open(io.BytesIO(png)).convert("RGB").quantize(COLOURS)
    picture.save(content, "png", optimize=True)
    return content.getvalue()


def draw_docs() -> None:
    """Draw every figure of this project's data, and the gallery with one robot per class."""
    files = files_of(make("gallery", Inputs(one_per_class=True)), ["png"])
    files = {"gallery_classes.png": files["gallery.png"]}
    for name in FIGURES:
        if name not in OF_RESULTS:
            files |= files_of(make(name), ["png"])
    for name, content in files.items():
        if name.endswith(".png"):
            write_file(DOCS / name, smaller(content), force=True)


def draw_phased() -> None:
    """Draw the distribution of distances by phases; of four phases only if it is known here."""
    with view_style.style():
        made = view_style.figure(4.2, 2.4)
        axis = made.subplots()
        colours = view_style.on_white(view_style.SEQUENTIAL)
        for colour, phases in zip((0.0, 0.5, 0.9), (1, 2, 4), strict=True):
            lattice, fitness = phased_lattice(phases), landscape(phases=phases)["fitness"]
            kit = fitness[buildable(all_digits(lattice), lattice)]
            for own, looks in ((fitness, {"ls": "-"}), (kit, {"ls": ":"})):
                share = 1 - np.arange(len(own)) / len(own)
                label = f"{phases} phase{'s' * (phases > 1)}" if own is fitness else None
                axis.step(np.sort(own), share, color=colours(colour), label=label, lw=1, **looks)
        axis.plot([], [], color=view_style.INK, ls=":", lw=1, label="that the kit can build")
        axis.set(yscale="log", xlabel="fitness (voxel widths)", ylabel="share of designs above")
        axis.set_xlim(left=0)
        axis.legend(frameon=False, loc="upper right")
        write_file(DOCS / "environments" / "phased.png", view_style.encoded(made), force=True)


def draw_sheet() -> None:
    """Draw the sheet of the best design for docs/build.md."""
    (page,) = sheets.draw_sheet(plan(BEST), sheets.facts_of([BEST])[0])
    with sheet_style():
        write_file(DOCS / "build_6453.png", smaller(view_style.encoded(page)), force=True)


def draw_trials() -> None:
    """Draw the figures of docs/trials-compare.md, from the trials that its program makes."""
    program = (DOCS / "trials-compare.md").read_text().split("```python\n")[1].split("```")[0]
    names: dict[str, Any] = {}
    with TemporaryDirectory() as folder, chdir(folder):
        exec(program, names)
    for name, content in files_of(
        Drawing(draw_comparison(compare(names["trials"]))), ["png"]
    ).items():
        write_file(DOCS / f"trials_{name}", smaller(content), force=True)


def draw_growth() -> None:
    """Film the best design as it grows and walks, every third picture."""
    env = gym.make("SoftVoxGrow2x2x2-v0", render_mode="rgb_array_list")
    env.reset(seed=0)
    for digit in (0, 0, 0, 2, 1, 2, 2, 2):
        env.step(digit)
    pictures = [np.asarray(Image.fromarray(p).resize((240, 180))) for p in env.render()[::3]]
    content = film(".gif", pictures, (240, 180), fps=25 / 3)
    write_file(ROOT / "docs/environments/growth.gif", content, force=True)


def draw_baselines() -> None:
    """Draw the figures of the committed comparisons, and write their pages."""
    for name in BASELINES:
        folder = ROOT / "baselines" / name
        tables, results = text.read(folder / "tables"), read(folder, of_transfer=None)
        drawing, showing = (
            (transfer_figures, transfer) if results.is_of_transfer else (figures, page)
        )
        with style.style():
            made = {f"{key}.png": one for key, one in drawing.draw(tables).items()}
            for file, figure in made.items():
                write_file(folder / "figures" / file, style.encoded(figure), force=True)
        content = showing.page(results, tables, list(made)).encode()
        write_file(folder / "report.md", content, force=True)


def draw_control() -> None:
    """Film the full cube with the controller of docs/environments/control.md, in real time."""
    gait = np.array([[1, 0], [1, 1], [0, 1], [0, 1]])[:, [0, 1] * 4]
    env = gym.make(
        "SoftVoxControl-v0", design=6560, interval=0.25, render_mode="rgb_array_list"
    ).unwrapped
    env.reset(seed=0)
    for step in range(env.episodes.steps):
        env.step(gait[step % 4] * env.action_space.high)
    seen = env._seen[1:]
    path, poses = np.array(seen[-1].path), [pose for step in seen for pose in step.poses]
    size = (384, 288)
    # The whole path is known here, so the camera can stand still, which makes a smaller file.
    stage = Stage([Walk(seen[0].stand, path)], width=size[0], height=size[1])
    first = len(path) - len(poses)
    every = range(0, len(poses), 4)  # of 50 per second
    content = film(".gif", (stage.picture([poses[k]], [first + k]) for k in every), size, 12.5)
    write_file(ROOT / "docs" / "environments" / "control.gif", content, force=True)


def main() -> None:
    """Draw all pictures."""
    draw_docs()
    draw_sheet()
    draw_control()
    draw_growth()
    draw_phased()
    draw_trials()
    draw_baselines()


if __name__ == "__main__":
    main()
