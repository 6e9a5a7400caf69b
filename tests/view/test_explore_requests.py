import re

import numpy as np
import pytest

pytest.importorskip("starlette", reason="the app needs softvox-gym[explore]")

from softvox_gym import Physics
from softvox_gym.physics import ParameterError
from softvox_view.explore.requests import PHYSICS, SLIDERS, physics_of, read


def physics(**given):
    """Return what a request's texts ask for."""
    return physics_of(read({name: str(text) for name, text in given.items()}, also=PHYSICS))[0]


def test_without_changes_the_physics_is_the_published_one():
    assert physics() == Physics.published()
    assert physics(gravity=-1.62).gravity == -1.62


def test_the_sliders_begin_at_the_published_physics_and_reach_beyond_it():
    for slider in SLIDERS:
        assert slider["min"] <= float(slider["standard"]) <= slider["max"]
        if slider["name"] not in ("tilt", "downhill"):
            published = getattr(Physics.published(), slider["name"])
            assert float(slider["standard"]) == pytest.approx(published, rel=1e-4)


def test_every_slider_can_be_moved_to_both_ends():
    for slider in SLIDERS:
        for end in (slider["min"], slider["max"]):
            physics(**{slider["name"]: end})


def test_a_tilted_floor_is_a_tilted_gravity():
    np.testing.assert_allclose(
        physics(tilt=30, downhill=90).gravity,
        [0, 9.81 * np.sin(np.pi / 6), -9.81 * np.cos(np.pi / 6)],
        atol=1e-12,
    )


def test_a_level_floor_keeps_the_bits_of_gravity_whatever_is_downhill():
    assert physics(tilt=0, downhill=40) == Physics.published()


@pytest.mark.parametrize(
    ("given", "name", "words"),
    [
        ({"friction_static": -1}, "friction_static", "finite and not negative, got -1.0"),
        ({"friction_static": "nan"}, "friction_static", "finite and not negative, got nan"),
        ({"frequency_hz": 0}, "frequency_hz", "positive and finite, got 0.0"),
        ({"frequency_hz": 1e9}, "frequency_hz", "at most half the steps per second"),
        ({"strain": -2}, "strain", "above -1"),
        ({"strain": 1, "actuation": "expand_and_contract"}, "strain", "below 1"),
        ({"gravity": "inf"}, "gravity", "finite, got inf"),
        ({"gravity": "down"}, "gravity", "must be a number, got 'down'"),
        ({"tilt": 90}, "tilt", "between -80 and 80"),
        ({"tilt": "nan"}, "tilt", "between -80 and 80"),
        ({"downhill": 1e300}, "downhill", "between -360 and 360"),
        ({"actuation": "wiggle"}, "actuation", "hold, clamp, expand_and_contract"),
        ({"duration": 1000}, "duration", "duration is no parameter"),
    ],
)
def test_what_is_out_of_bounds_is_refused_naming_the_parameter(given, name, words):
    with pytest.raises(ParameterError, match=re.escape(words)) as refused:
        physics(**given)
    assert refused.value.parameter == name


def test_what_is_rarely_meant_is_told_and_does_not_warn():
    _, (warning,) = physics_of({"friction_kinetic": 2.0})
    assert "friction_kinetic (2.0) is above friction_static" in warning


@pytest.mark.parametrize("text", ["6453", "00021222"])
def test_a_design_is_a_number_or_digits(text):
    assert read({"design": text}, needed=["design"]) == {"design": 6453}


@pytest.mark.parametrize("text", ["", "6561", "-1", "06453", "0002122", "00021223", "1.5", "٣"])
def test_what_is_no_design_is_refused(text):
    with pytest.raises(ParameterError, match="neither a number from 0 to 6560 nor 8 digits"):
        read({"design": text}, needed=["design"])


@pytest.mark.parametrize("text", ["0", "2001", "2.5", "nan", "9" * 5000])
def test_what_is_no_whole_number_in_bounds_is_refused(text):
    with pytest.raises(ParameterError, match="budget must be a whole number from 1 to 2000"):
        read({"budget": text}, needed=["budget"])


def test_what_is_needed_must_be_there():
    with pytest.raises(ParameterError, match="seed must be a number, got ''"):
        read({}, needed=["seed"])
