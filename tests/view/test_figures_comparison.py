import csv
import io

import numpy as np
import pytest

from softvox_gym.real_tracks import RealTrack, as_csv, as_lines, compare, short

PER_CYCLE = 4

#: A walk of two cycles, straight along x.
STRAIGHT = np.stack([np.arange(9) / 4.0, np.zeros(9)], axis=1)


def real(position, cycle=None):
    cycle = np.arange(len(position)) / PER_CYCLE if cycle is None else np.asarray(cycle, float)
    return RealTrack(6453, "1", cycle, np.asarray(position, dtype=float))


def turned(track, degrees):
    a = np.radians(degrees)
    return track @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]])


def test_a_robot_that_did_as_simulated_has_no_errors():
    made = compare(real(STRAIGHT), STRAIGHT, PER_CYCLE)
    assert (made.angle, made.end_point_error, made.rms_error) == (0, 0, 0)
    assert made.cycles == 2


@pytest.mark.parametrize("degrees", [30, 90, 179, -120])
def test_the_angle_is_how_far_the_robot_turned_away(degrees):
    made = compare(real(turned(STRAIGHT, degrees)), STRAIGHT, PER_CYCLE)
    assert made.angle == pytest.approx(abs(degrees), abs=1e-9)
    assert made.heading_simulated == 0
    assert made.heading_real == pytest.approx(degrees, abs=1e-9)


def test_the_angle_across_the_back_is_the_short_one():
    made = compare(real(turned(STRAIGHT, 170)), turned(STRAIGHT, -170), PER_CYCLE)
    assert made.angle == pytest.approx(20, abs=1e-9)


def test_the_rms_of_a_distance_that_grows_evenly_is_its_end_by_root_three():
    made = compare(real(1.5 * STRAIGHT), STRAIGHT, PER_CYCLE)
    assert made.end_point_error == pytest.approx(1.0, abs=1e-12)
    assert made.rms_error == pytest.approx(1 / np.sqrt(3), abs=1e-12)


def test_how_often_the_real_robot_was_looked_at_does_not_matter():
    often = compare(real(turned(STRAIGHT, 50)), STRAIGHT, PER_CYCLE)
    seldom = real(turned(STRAIGHT[[0, 3, 8]], 50), cycle=[0, 0.75, 2])
    assert compare(seldom, STRAIGHT, PER_CYCLE).rms_error == pytest.approx(often.rms_error)


def test_a_shorter_real_track_is_compared_as_far_as_it_goes():
    made = compare(real([[0, 0], [0.5, 0]], cycle=[0, 0.5]), STRAIGHT, PER_CYCLE)
    assert made.cycles == 0.5
    assert made.distance_simulated == pytest.approx(0.5)
    assert made.end_point_error == pytest.approx(0)


def test_a_robot_that_travels_little_has_no_heading_and_no_angle():
    short = [[0, 0], [0.24, 0]]
    made = compare(real(short, cycle=[0, 2]), STRAIGHT, PER_CYCLE)
    assert np.isnan([made.angle, made.heading_real]).all()
    assert made.heading_simulated == 0
    made = compare(real(STRAIGHT), 0.1 * STRAIGHT, PER_CYCLE)
    assert np.isnan([made.angle, made.heading_simulated]).all()
    assert made.heading_real == 0


def test_a_long_name_keeps_its_end_which_tells_trials_apart():
    names = [short(f"2024-05-01 run {i}") for i in (1, 2)]
    assert names == [f"2024-\N{HORIZONTAL ELLIPSIS} run {i}" for i in (1, 2)]
    assert short("twelve chars") == "twelve chars"


def test_a_robot_that_stands_still_has_no_heading():
    made = compare(real(0 * STRAIGHT), STRAIGHT, PER_CYCLE)
    assert np.isnan(made.angle)
    assert np.isnan(made.heading_real)
    assert made.end_point_error == pytest.approx(2)


def test_the_table_has_nothing_where_there_is_no_number():
    made = compare(real(0 * STRAIGHT), STRAIGHT, PER_CYCLE)._replace(trial='a, "b"')
    (row,) = csv.DictReader(io.StringIO(as_csv([made]).decode()))
    assert row["angle"] == ""
    assert row["trial"] == 'a, "b"'
    assert float(row["end_point_error"]) == 2


def test_the_lines_for_people_keep_their_columns():
    made = compare(real(STRAIGHT), STRAIGHT, PER_CYCLE)
    head, *rows, _ = as_lines([made, made._replace(trial="a very long name of a trial\x1b")])
    assert {len(row) for row in rows} == {len(head)}
    assert all(row.isprintable() for row in rows)
