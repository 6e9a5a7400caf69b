"""The engine keeps the laws of mechanics that have a closed form."""

from dataclasses import replace

import numpy as np
import pytest

from softvox_gym import Design, Physics, simulate

# One voxel on the floor, and one above an empty site.
STANDING, HANGING = Design("10000000"), Design("00001000")
FRICTIONLESS = Physics(damping_global=0.0, friction_static=0.0, friction_kinetic=0.0)
MASS = 1e6 * 0.01**3  # kg, of the paper's voxel
EPSILON = np.finfo(float).eps


def heights(result):
    present = result.designs[0] > 0
    return result.frames.position[0][:, present, 2][:, 0]


def sliding_acceleration(pull, **changes):
    """Acceleration along x, m/s^2, of a voxel that has settled on a floor tilted to pull at it."""
    physics = Physics(damping_global=0.0, gravity=(pull, 0.0, -9.81), duration=2.0, **changes)
    frames = simulate(STANDING, physics, frames=1000).frames
    x, time = frames.position[0, :, 0, 0, 0, 0], frames.time[0]
    assert np.ptp(frames.position[0, :4, 0, 0, 0, 1]) == 0.0
    # Semi-implicit Euler is exact for the second difference of a constant acceleration.
    return (x[3] - 2 * x[2] + x[1]) / (time[2] - time[1]) ** 2


def test_a_voxel_in_the_air_falls_freely():
    physics = replace(FRICTIONLESS, gravity=-1.0, duration=0.3)
    result = simulate(HANGING, physics, frames=1)
    step = np.arange(100)
    assert physics.time_step * 100 < np.sqrt(2 * 0.01)  # it has not yet landed
    # Semi-implicit Euler falls g dt^2 k (k + 1) / 2 in k steps, exactly but for rounding.
    fall = 0.5 * physics.time_step**2 * step * (step + 1)
    np.testing.assert_allclose(heights(result)[:100], 0.015 - fall, rtol=100 * EPSILON)


def test_gravity_is_a_vector():
    physics = replace(FRICTIONLESS, gravity=(0.3, -0.2, 1.0), duration=0.3)
    frames = simulate(HANGING, physics, frames=1).frames
    step = np.arange(frames.position.shape[1] - 1)
    flight = frames.position[0, step, 0, 0, 1] - frames.position[0, 0, 0, 0, 1]
    fall = 0.5 * physics.time_step**2 * step * (step + 1)
    expected = np.multiply.outer(fall, [0.3, -0.2, 1.0])
    np.testing.assert_allclose(flight, expected, rtol=1e-9, atol=1e-14)


def test_a_standing_voxel_sinks_until_the_floor_carries_it():
    physics = Physics(duration=2.0)
    frames = simulate(STANDING, physics, frames=100).frames
    weight = 9.81 * physics.density * physics.edge**3
    depth = weight / (2 * physics.youngs_modulus * physics.edge)
    # What is left of the bouncing after two seconds is below a millionth of the depth.
    assert frames.edge[0, -2, 0, 0, 0] / 2 - frames.position[0, -2, 0, 0, 0, 2] == pytest.approx(
        depth, rel=1e-6
    )


def test_a_beam_vibrates_at_the_frequency_of_its_stiffness():
    # One cycle of actuation sets a floating pair swinging along its axis, then it is left alone.
    physics = Physics(
        gravity=0.0,
        damping_link=0.0,
        damping_global=0.0,
        settle_time=0.0,
        duration=0.6,
        frequency_hz=50.0,
        time_step_fraction=0.02,
        actuation="expand_and_contract",
    )
    strain = np.zeros((1, 2, 2, 2, 2))
    strain[0, 0] = 0.01
    frames = simulate(Design("00002200"), physics, strain=strain, frames=1).frames
    late = frames.time[0] > 0.03
    gap = (frames.position[0, late, 1, 0, 1, 0] - frames.position[0, late, 0, 0, 1, 0])[:-1]
    swing, time = gap - physics.edge, frames.time[0, late][:-1]
    assert swing.max() > 1e-7
    up = np.flatnonzero((swing[:-1] < 0) & (swing[1:] >= 0))
    crossing = time[up] - swing[up] * (time[up + 1] - time[up]) / (swing[up + 1] - swing[up])
    period = np.diff(crossing).mean()
    # Two masses on a spring: omega = sqrt(2 a1 / m); semi-implicit Euler at step dt swings at
    # 2 asin(omega dt / 2) / dt.
    stiffness, mass = physics.youngs_modulus * physics.edge, physics.density * physics.edge**3
    omega = np.sqrt(2 * stiffness / mass)
    stepped = 2 * np.arcsin(omega * physics.time_step / 2) / physics.time_step
    assert len(crossing) > 20
    # Linear interpolation of the crossings is good to 1e-5 of a period.
    assert period == pytest.approx(2 * np.pi / stepped, rel=1e-5)


@pytest.mark.parametrize("damping", [0.0, 0.8])
def test_the_pumps_work_is_the_energy_of_a_floating_pair_and_what_its_damper_took(damping):
    physics = Physics(
        gravity=0.0,
        damping_link=damping,
        damping_global=0.0,
        settle_time=0.0,
        duration=0.2,
        frequency_hz=20.0,
        actuation="expand_and_contract",
    )
    strain = np.zeros((1, 3, 2, 2, 2))  # two cycles of pumping, then it swings
    strain[0, :2] = 0.1, 0.05
    result = simulate(Design("00002100"), physics, strain=strain, frames=1, energy=True)
    x = result.frames.position[0, :-1, :, 0, 1, 0]
    stretch = x[:, 1] - x[:, 0] - result.frames.edge[0, :-1, :, 0, 1].mean(axis=1)
    stiffness = physics.youngs_modulus * physics.edge
    # Leapfrog keeps a discrete energy exactly: its kinetic part is the product of the speeds
    # before and after a step. The trapezoidal rule is what goes with it.
    speed = np.diff(x, axis=0) / physics.time_step
    kinetic = 0.5 * MASS * (speed[1:] * speed[:-1]).sum(axis=1)
    rate = np.diff(stretch) / physics.time_step
    damper = damping * np.sqrt(stiffness * MASS) * rate * physics.time_step
    taken = np.cumsum((damper[1:] + damper[:-1]) / 2 * rate[1:])
    balance = (kinetic + 0.5 * stiffness * stretch[1:-1] ** 2)[1:] + taken[:-1]
    swinging = result.frames.time[0, 2:-2] > 0.1 + 2 * physics.time_step
    assert result.energy[0] > 1e-4
    # Rounding of places of 0.02 m, of which stretches are 1e-4 m.
    np.testing.assert_allclose(balance[swinging], result.energy[0], rtol=1e-9)


def test_the_pump_does_no_work_on_what_it_does_not_move():
    energy = simulate(["11111111", "20000000", 0, 6453], energy=True).energy
    assert energy[:3].tobytes() == np.zeros(3).tobytes()
    assert energy[3] > 1
    assert np.isnan(simulate("22222222", Physics(strain=1e6), energy=True).energy).all()


def test_a_jump_of_edges_costs_energy_in_proportion_to_steps_per_second():
    steps = np.array([0.8, 0.4, 0.2])
    physics = Physics(duration=0.3, time_step_fraction=steps)
    quarter = np.full((3, 2, 2, 2), 0.25)
    work, jumping = (
        simulate([6453] * 3, physics, phase=phase, energy=True).energy for phase in (None, quarter)
    )
    np.testing.assert_allclose(work, work[0], rtol=0.05)
    assert np.diff(jumping)[1] == pytest.approx(2 * np.diff(jumping)[0], rel=0.05)


def test_a_floating_pair_swings_about_its_middle():
    physics = Physics(
        gravity=0.0, damping_link=0.0, damping_global=0.0, settle_time=0.0, duration=0.5
    )
    frames = simulate(Design("00002100"), physics, frames=10).frames
    middle = frames.position[0, :-1, :, 0, 1].mean(axis=1)
    assert np.ptp(frames.position[0, :-1, 0, 0, 1, 0]) > 1e-4
    # A link pushes its two ends equally, so the middle stays but for rounding.
    np.testing.assert_allclose(middle[:, 0], 0.01, rtol=1e-12)


@pytest.mark.parametrize("slope", [0.5, 0.99])
def test_a_voxel_holds_on_a_slope_flatter_than_its_static_friction(slope):
    # It lands sliding; kinetic friction as large as static friction stops it.
    physics = Physics(gravity=(9.81 * slope, 0.0, -9.81), friction_kinetic=1.0)
    assert simulate(STANDING, physics).displacement[0, 0] == 0.0


def test_a_voxel_slides_down_a_slope_at_the_acceleration_that_kinetic_friction_leaves():
    acceleration = sliding_acceleration(12.0, friction_static=1.0, friction_kinetic=0.5)
    # What is left of the landing's bounce after half a second.
    assert acceleration == pytest.approx(12.0 - 0.5 * 9.81, rel=1e-6)


def test_shear_strength_slows_a_sliding_voxel_like_friction():
    strength = 20000.0
    acceleration = sliding_acceleration(14.0, shear_strength=strength)
    brake = strength * 0.01**2 / MASS
    # The voxel's edge stays at rest, so the force is constant but for the landing's bounce.
    assert acceleration == pytest.approx(14.0 - 0.5 * 9.81 - brake, rel=1e-6)


@pytest.mark.parametrize(("share", "holds"), [(0.99, False), (1.01, True)])
def test_shear_strength_holds_a_voxel_that_friction_would_let_slide(share, holds):
    pull = 12.0
    needed = (pull - 9.81) * MASS / 0.01**2  # tau s^2 makes up for what friction lacks
    physics = Physics(
        gravity=(pull, 0.0, -9.81), shear_strength=share * needed, friction_kinetic=1.0
    )
    travel = simulate(STANDING, physics).displacement[0, 0]
    assert travel == 0.0 if holds else travel > 0.1


def test_shear_strength_does_not_hold_a_voxel_in_the_air():
    physics = replace(FRICTIONLESS, gravity=(1.0, 0.0, 1.0), duration=0.5, shear_strength=1e6)
    free = replace(physics, shear_strength=0.0)
    assert simulate(HANGING, physics).displacement[0, 0] > 0.1
    np.testing.assert_array_equal(
        simulate(HANGING, physics).displacement, simulate(HANGING, free).displacement
    )


def test_a_passive_robot_stays_where_it_is():
    result = simulate("11111111", Physics())
    np.testing.assert_allclose(result.displacement[0, :2], 0, atol=1e-9)


# Robots that do not fall over.
STEADY = [7, 1614, 1827, 2117, 4474, 5029]


@pytest.mark.parametrize("index", STEADY)
def test_a_robot_mirrored_in_the_diagonal_travels_the_mirrored_way(index):
    array = Design(index).array
    dx, dy, dz = simulate(array[np.newaxis]).displacement[0]
    swapped = simulate(array.swapaxes(0, 1)[np.newaxis]).displacement[0]
    # x and y links are alike, but their sums are rounded in another order.
    np.testing.assert_allclose(swapped, [dy, dx, dz], rtol=0, atol=1e-6)


@pytest.mark.parametrize("index", STEADY)
def test_a_turned_or_mirrored_robot_travels_nearly_the_turned_or_mirrored_way(index):
    # Nearly, because a beam is measured in the frame of its voxel at the lower coordinate.
    design = Design(index)
    dx, dy, dz = simulate(design).displacement[0]
    turned = simulate(design.rotated(1)).displacement[0]
    mirrored = simulate(design.mirrored()).displacement[0]
    np.testing.assert_allclose(turned, [-dy, dx, dz], rtol=0, atol=0.02)
    np.testing.assert_allclose(mirrored, [-dx, dy, dz], rtol=0, atol=0.02)


def test_two_bodies_that_swell_into_each_other_push_apart():
    apart = Design("20000002")  # opposite corners: no link between them
    result = simulate(apart, Physics(strain=0.4), frames=100)
    first, last = result.frames.position[0, 0], result.frames.position[0, -2]
    assert np.linalg.norm(last[1, 1, 1] - last[0, 0, 0]) > np.linalg.norm(
        first[1, 1, 1, :2] - first[0, 0, 0, :2]
    )


def test_a_lattice_of_two_thousand_voxels_runs():
    designs = np.full((1, 12, 13, 14), 1)
    designs[:, ::3, ::3, ::3] = 2
    physics = Physics(settle_time=0.0, duration=0.03, frequency_hz=40.0)
    result = simulate(designs, physics, track=2)
    assert not result.diverged[0]
    assert result.design(0).n_voxels == 2184
    assert np.isfinite(result.track).all()


def test_a_folded_link_stays_finite():
    # A strain that nearly closes neighbouring voxels folds links past a right angle.
    physics = Physics(strain=0.9, actuation="expand_and_contract", frequency_hz=10.0)
    result = simulate(np.arange(0, 6561, 97), physics)
    ok = ~result.diverged
    assert ok.any()
    assert np.isfinite(result.displacement[ok]).all()


def test_a_run_that_gains_energy_from_nowhere_has_diverged():
    # Hardly damped links of edges 3.5 times as long as the beams are stiff for: the model itself
    # gives them energy, at any step, and throws bodies about at over ten times the pump's speed.
    wild = Physics(damping_link=0.02, strain=2.5, frequency_hz=1.0)
    designs = np.arange(1, 6561, 60)
    diverged = simulate(designs, wild).diverged
    assert diverged.mean() > 0.5
    # What is only lively keeps its status: hops of many voxel widths on the moon.
    hopping = Physics(gravity=-1.62, strain=0.5, frequency_hz=8.0)
    assert not simulate(designs, hopping).diverged.any()
    # A fall and a slide are gravity's, however fast.
    falling = Physics(gravity=(0.0, 0.0, 9.81))
    sliding = Physics(gravity=(9.81, 0, -9.81), friction_static=0.0, friction_kinetic=0.0)
    for physics in (falling, sliding):
        assert not simulate(designs, physics).diverged.any()
