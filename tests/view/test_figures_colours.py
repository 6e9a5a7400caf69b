import matplotlib
import numpy as np
import pytest
from matplotlib import colormaps

from softvox_view.figures import style
from softvox_view.figures.maps import COLOURS, DIMMED, STILL

#: Of sRGB to CIE XYZ, for the white of daylight D65 (IEC 61966-2-1).
XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
WHITE = XYZ.sum(axis=1)

#: Steps that a scale is taken in; its 256 colours are rounded less than that.
STEPS = 32

SCALES = {"fitness": colormaps[style.SEQUENTIAL], "time": style.on_white(style.TIME)}


def cielab(colours):
    """L*, a*, b* (CIE 15:2004) of sRGB colours, shape (n, 3)."""
    colours = np.asarray(colours)
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    share = linear @ XYZ.T / WHITE
    root = np.where(share > 216 / 24389, np.cbrt(share), (24389 / 27 * share + 16) / 116)
    x, y, z = root.T
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=1)


def unevenness(colours):
    """How far the steps of a scale are from their mean, in lightness and in colour difference."""
    steps = np.diff(cielab(colours(np.linspace(0, 1, STEPS + 1))[:, :3]), axis=0)
    difference = np.linalg.norm(steps, axis=1)
    return [float(np.abs(part / part.mean() - 1).max()) for part in (steps[:, 0], difference)]


def test_black_and_white_are_the_ends_of_lightness():
    assert cielab([[0, 0, 0], [1, 1, 1]]) == pytest.approx(
        np.array([[0, 0, 0], [100, 0, 0]]), abs=1e-9
    )


@pytest.mark.parametrize("name", SCALES)
def test_scales_are_perceptually_uniform(name):
    # They were made even in CAM02-UCS. CIELAB, which can be written down here, is another model of
    # sight: by it evenly made scales differ by up to 0.3 in lightness and 0.55 in all.
    in_lightness, in_colour = unevenness(SCALES[name])
    assert in_lightness < 0.3
    assert in_colour < 0.55


@pytest.mark.parametrize("name", ["jet", "hot", "hsv"])
def test_that_test_finds_scales_that_are_not(name):
    assert unevenness(colormaps[name])[0] > 0.9


@pytest.mark.parametrize("name", SCALES)
def test_scales_grow_lighter_by_more_than_half_of_what_there_is(name):
    lightness = cielab(SCALES[name](np.linspace(0, 1, STEPS + 1))[:, :3])[:, 0]
    assert np.all(np.diff(lightness) > 0)
    assert lightness[-1] - lightness[0] > 50


def test_kinds_and_headings_stay_apart_without_colour():
    kinds = cielab([matplotlib.colors.to_rgb(colour) for colour in COLOURS])[:, 0]
    assert np.diff(kinds).min() > 10
    assert STILL == "white"
    wheel = DIMMED * colormaps[style.CYCLIC](np.linspace(0, 1, 64))[:, :3]
    assert cielab(wheel)[:, 0].max() < 80


def test_a_scale_beside_white_ends_before_it():
    pale = style.on_white(style.SEQUENTIAL)(1.0)[:3]
    assert cielab([pale])[0, 0] < 86
