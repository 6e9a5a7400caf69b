"""The transfer methods do what their papers say, held against plain second writings."""

import warnings

import numpy as np
import pytest
from cheap_models import cheap_models  # noqa: F401, a fixture
from sklearn.gaussian_process import GaussianProcessRegressor, kernels

from softvox_gym import Lattice, Physics, Task, noisy_landscape, realities, reality, simulate
from softvox_search.transfer import METHODS, Simulator, Test, check, make, transfer
from softvox_search.transfer.library import CLASSES, drawn, library, physics_at
from softvox_search.transfer.methods.gaussian import GaussianProcess, hamming, matern
from softvox_search.transfer.methods.identification import Identification, weights
from softvox_search.transfer.protocol import after_tests, first_best

PUBLISHED = Physics.published()
TASK = Task("directed", 90.0)
LATTICE = Lattice()
DIGITS = LATTICE.digits(np.arange(6561))
TESTED = [6453, 4295, 17, 926, 2117, 5000]

#: With tests of their own, as they need further libraries.
EXTRAS = ("npe", "mfbo")

#: Options with which a method takes little time.
QUICK = {
    "eea": {"size": 3, "ensemble": 2},
    "domain_randomisation": {"size": 3},
    "transferability": {"population": 8, "generations": 2},
    "simopt": {"candidates": 8, "draws": 3, "rounds": 1, "fit_at": [1, 3]},
}

pytestmark = pytest.mark.usefixtures("cheap_models")


def made(name, task=TASK, seed=0, **options):
    return make(name, Simulator(PUBLISHED), task, np.random.default_rng(seed), **options)


def told(method, displacements):
    """Let a method learn tests of designs of one's own choice, past the guard."""
    for design, shown in displacements.items():
        moved = np.array([*shown, 0.0])
        method.method.tell(Test(design, float(TASK.reward(moved)), moved))
    return method


@pytest.mark.parametrize("name", [name for name in METHODS if name not in (*EXTRAS, "oracle")])
def test_a_method_conforms(name):
    check(name, **QUICK.get(name, {}))


def test_the_oracle_does_not_conform():
    with pytest.raises(AssertionError, match="method oracle acts on what it has not tested"):
        check("oracle")


@pytest.mark.parametrize("choice", ["random", "disagreement", "fittest"])
def test_estimation_and_exploration_conforms_with_every_choice(choice):
    check("eea", choice=choice, **QUICK["eea"])


@pytest.mark.parametrize("options", [{"kernel": "behaviour"}, {"prior": "simulated"}], ids=str)
def test_ite_conforms_with_every_kernel_and_prior(options):
    check("ite", **options)


def test_chance_tests_every_design_alike_and_none_twice():
    assert len(set(transfer("random", tests=2000).tested.tolist())) == 2000
    firsts = [transfer("random", tests=1, seed=seed).tested[0] for seed in range(200)]
    assert np.mean(firsts) == pytest.approx(3280, abs=400)


@pytest.mark.parametrize("task", [TASK, Task()], ids=str)
def test_jakobi_takes_the_best_of_the_noisy_simulator(task):
    noisy = noisy_landscape(2.0)
    expected = noisy["mean"] if task.heading is None else noisy["dy"] * (1 - noisy["p_diverged"])
    order = np.argsort(-np.round(np.nan_to_num(expected), 9), kind="stable")
    assert transfer("jakobi", task=task, tests=5, level=2.0).tested.tolist() == order[:5].tolist()


# Gaussian processes.


def test_the_process_is_that_of_scikit_learn():
    one_hot = (DIGITS[:, :, np.newaxis] == np.arange(3)).reshape(6561, -1) / np.sqrt(16)
    values = np.random.default_rng(0).normal(size=len(TESTED))
    kernel = kernels.ConstantKernel(1.7) * kernels.Matern(0.6, nu=2.5)
    theirs = GaussianProcessRegressor(kernel, alpha=0.01, optimizer=None)
    theirs.fit(one_hot[TESTED], values)
    mean, deviation = theirs.predict(one_hot, return_std=True)
    ours = GaussianProcess(
        np.zeros(6561), lambda i: 1.7 * matern(hamming(i), 0.6), np.full(6561, 1.7), 0.01
    )
    for design, value in zip(TESTED, values, strict=True):
        ours.add(design, value)
    assert np.abs(ours.mean - mean).max() < 1e-9
    assert np.abs(ours.deviation - deviation).max() < 1e-9


def test_a_design_tested_again_is_learnt_again():
    ours = GaussianProcess(np.zeros(6561), lambda i: matern(hamming(i), 0.6), np.ones(6561), 0.1)
    for value in (1.0, 2.0, 3.0):
        ours.add(17, value)
    assert ours.mean[17] == pytest.approx(6 / 3.1)
    assert ours.variance[17] == pytest.approx(1 - 3 / 3.1)


@pytest.mark.parametrize("kernel", ["hamming", "behaviour"])
@pytest.mark.parametrize("prior", ["signed", "simulated"])
def test_ite_is_a_process_about_what_the_simulator_says(kernel, prior):
    method = made("ite", kernel=kernel, prior=prior, length=0.5, signal=0.8, noise=0.01)
    shown = np.random.default_rng(1).normal(size=(len(TESTED), 2))
    told(method, dict(zip(TESTED, shown, strict=True)))
    said = Simulator(PUBLISHED).landscape()
    unit = said[:, 1].max()
    mean = said[:, 1] / unit
    if kernel == "hamming":
        apart = np.sqrt((DIGITS[:, np.newaxis] != DIGITS[TESTED]).mean(axis=-1))
    else:
        plane = said[:, :2] / np.hypot(*said[:, :2].T).max()
        apart = np.linalg.norm(plane[:, np.newaxis] - plane[TESTED], axis=-1)
    d = np.sqrt(5) * apart / 0.5
    covariance = 0.64 * (1 + d + d**2 / 3) * np.exp(-d)
    if prior == "signed":
        covariance += np.outer(mean, mean[TESTED])
    gain = covariance @ np.linalg.inv(covariance[TESTED] + 0.01 * np.eye(len(TESTED)))
    expected = mean + gain @ (shown[:, 1] / unit - mean[TESTED])
    assert np.abs(method.predict() - expected * unit).max() < 1e-9
    before = 0.64 + (mean**2 if prior == "signed" else 0)
    deviation = np.sqrt(before - (gain * covariance).sum(axis=1))
    assert np.abs(method.process.deviation - deviation).max() < 1e-8
    bound = expected + 0.05 * deviation
    bound[TESTED] = -np.inf
    assert method.ask() == bound.round(9).argmax()


def test_a_signed_prior_learns_that_all_goes_the_other_way():
    said = Simulator(PUBLISHED).landscape()
    method = made("ite", length=0.1)
    told(method, {i: -said[i, :2] for i in np.argsort(-said[:, 1])[:10]})
    others = np.argsort(said[:, 1])[:100]  # they go the other way in the simulator
    assert (method.predict()[others] > 0).mean() > 0.9


def test_upper_bounds_without_a_simulator_learn_the_kernel():
    method = made("gp_ucb", learn_at=[6])
    first = method.ask()
    shown = {design: (0.0, float(DIGITS[design].sum())) for design in TESTED}
    told(method, shown)
    one_hot = (DIGITS[:, :, np.newaxis] == np.arange(3)).reshape(6561, -1) / np.sqrt(16)
    values = np.array([y for _, y in shown.values()])
    kernel = kernels.ConstantKernel(1.0, (0.01, 10)) * kernels.Matern(
        0.4, (0.05, 5), nu=2.5
    ) + kernels.WhiteKernel(0.001, (1e-4, 1))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of parameters at their bounds
        theirs = GaussianProcessRegressor(kernel).fit(one_hot[TESTED], values / values.max())
    mean = theirs.predict(one_hot) * values.max()
    assert np.abs(method.predict() - mean).max() < 1e-6
    assert first == np.random.default_rng(0).integers(6561)


# The transferability approach.


def test_disparities_are_weighted_by_the_inverse_squared_distance_in_behaviour():
    method = made("transferability", population=8)
    rng = np.random.default_rng(2)
    shown = dict(zip(TESTED, rng.normal(size=(len(TESTED), 2)), strict=True))
    told(method, shown)
    said = Simulator(PUBLISHED).landscape()
    height = simulate(TESTED, track=1).track[..., 2].mean(axis=1)
    travel = np.hypot(*said[:, :2].T)
    behaviour = method._behaviour
    assert behaviour[:, 0] == pytest.approx(travel / travel.max())
    rise = behaviour[TESTED, 1] - behaviour[TESTED[0], 1]
    apart = height - height[0]
    assert rise * apart[1] == pytest.approx(apart * rise[1])  # alike but for scale
    angle = np.arctan2(said[:, 1], said[:, 0])[travel > 0.01]
    heading = np.column_stack([np.cos(angle), np.sin(angle)]) / 2
    assert np.abs(behaviour[travel > 0.01, 2:] - heading).max() < 1e-9
    off = [np.hypot(*(said[i, :2] - xy)) for i, xy in shown.items()]
    for design in (5, 6000, 1234):
        weight = [1 / ((behaviour[design] - behaviour[i]) ** 2).sum() for i in TESTED]
        expected = np.average(off, weights=weight)
        assert method._front.disparity[design] == pytest.approx(expected, rel=1e-12)
    assert method._front.disparity[TESTED] == pytest.approx(off, rel=1e-3)


def test_the_next_test_behaves_least_like_those_tested():
    method = made("transferability", population=8, generations=3)
    first = method.ask()
    population = LATTICE.numbers(np.array(method._front.population))
    assert first == population[method._front.reward[population].argmax()]
    method.tell(Test(first, 1.0, np.ones(3)))
    second = method.ask()
    population = LATTICE.numbers(np.array(method._front.population))
    apart = np.square(method._behaviour - method._behaviour[first]).sum(axis=1)
    left = population[population != first]
    assert apart[second] == apart[left].max()


def test_diversity_is_the_share_of_sites_that_differ():
    front = made("transferability", population=8)._front
    front.advance()
    seen = []
    survivors = front._survivors

    def watched(offspring):
        pool = np.array([*offspring, *front.population])
        kept = survivors(offspring)
        seen.extend((np.array(one), one.fitness.values[2], pool) for one in kept)
        return kept

    front._survivors = watched
    front.advance()
    for digits, diversity, pool in seen:
        assert diversity == pytest.approx((pool != digits).mean())


# Libraries of models.


def test_models_vary_what_their_class_says_and_are_no_reality():
    for name, varied in CLASSES.items():
        models = drawn(PUBLISHED, name, 30)
        assert models[:5] == drawn(PUBLISHED, name, 5)
        plain = PUBLISHED.to_dict()
        differ = {
            key for one in models for key, value in one.to_dict().items() if value != plain[key]
        }
        assert differ - {"duration"} == varied
        assert len(set(models)) == 30
        assert not set(models) & {one.physics for one in realities().values()}
        for one in models:
            assert one.cycles == pytest.approx(15)
            assert 0.4 * one.friction_static <= one.friction_kinetic <= one.friction_static
    assert not set(drawn(PUBLISHED, "coulomb", 30)) & set(drawn(PUBLISHED, "coulomb_area", 30))


def test_a_third_has_area_friction_alone_and_a_third_coulomb_friction_alone():
    models = drawn(PUBLISHED, "coulomb_area", 600)
    kinds = [(one.friction_static > 0, one.shear_strength > 0) for one in models]
    for kind in ((False, True), (True, True), (True, False)):
        assert kinds.count(kind) / 600 == pytest.approx(1 / 3, abs=0.07)
    ratios = [one.shear_ratio for one in models if one.shear_strength]
    assert 0.05 <= min(ratios) <= max(ratios) <= 1.0001


def test_a_library_costs_its_simulations_and_is_shared():
    simulator = Simulator(PUBLISHED)
    first = library(simulator, "all", 3)
    assert simulator.used == 3 * 6561
    assert library(simulator, "all", 3).displacement is first.displacement
    assert simulator.used == 3 * 6561
    for physics, moved in zip(first.physics, first.displacement, strict=True):
        assert np.array_equal(moved, simulator.landscape(physics))
    assert not first.displacement.flags.writeable


def eea(**options):
    method = made("eea", size=4, ensemble=2, fittest=5, **options)
    return method, library(Simulator(PUBLISHED), "all", 4).displacement


def test_the_ensemble_is_the_models_that_fit_the_tests_best():
    method, models = eea()
    assert method.kept.tolist() == [0, 1]
    told(method, {17: models[3, 17, :2], 18: models[3, 18, :2]})
    misfit = [np.square(one[[17, 18], :2] - models[3, [17, 18], :2]).sum() for one in models]
    assert method.kept.tolist() == np.argsort(misfit)[:2].tolist()
    assert method.kept[0] == 3
    # The model that is right to the bit is a thousandth of a square voxel width off, and no more.
    weights = np.exp(-np.sort(misfit)[:2] / 2e-3)
    expected = np.average(models[method.kept], axis=0, weights=weights)
    assert np.allclose(method.predict(), expected, rtol=0, atol=1e-12)
    assert method.models() is models


def test_models_weigh_as_likely_as_they_are():
    method, models = eea()
    told(method, {17: (0.3, 0.4)})
    misfit = np.sort(np.square(models[:, 17, :2] - (0.3, 0.4)).sum(axis=1))[:2]
    variance = misfit[0] / 2  # of one test, of dx and of dy
    ratio = np.exp(-(misfit[1] - misfit[0]) / (2 * variance))
    first, second = models[method.kept]
    assert np.allclose(method.predict(), (first + ratio * second) / (1 + ratio))


def test_every_choice_of_a_test_is_what_it_says():
    _, models = eea()
    kept = models[:2]
    expected = kept[..., 1].mean(axis=0)
    disputed = np.square(kept[0, :, :2] - kept[1, :, :2]).sum(axis=1)  # of two, as their variance
    assert eea(choice="fittest")[0].ask() == expected.argmax()
    assert eea(choice="disagreement")[0].ask() == disputed.argmax()
    fittest = np.argsort(-expected)[:5]
    assert eea(choice="both")[0].ask() == fittest[disputed[fittest].argmax()]
    drawn_one = np.random.default_rng(0).choice(6561)
    assert eea(choice="random")[0].ask() == drawn_one


def test_the_best_in_expectation_is_recommended_or_the_best_tested():
    method, models = eea()
    best = int(models[:2, :, 1].mean(axis=0).argmax())
    told(method, {best: (0.0, -50.0)})
    expected = method.predict()[:, 1]
    expected[best] = -50
    assert method.method.recommend() == expected.argmax()
    told(method, {5: (0.0, 50.0)})
    assert method.method.recommend() == 5


def test_domain_randomisation_takes_the_mean_or_the_worst_share():
    models = np.sort(library(Simulator(PUBLISHED), "all", 4).displacement[..., 1], axis=0)
    score = made("domain_randomisation", size=4).score
    assert score == pytest.approx(models.mean(axis=0))
    for tail, worst in ((0.1, 1), (0.25, 1), (0.5, 2), (1.0, 4)):
        method = made("domain_randomisation", size=4, tail=tail)
        assert method.score == pytest.approx(models[:worst].mean(axis=0))
        assert method.ask() == method.score.round(9).argmax()


def test_the_distance_to_the_library_is_told_and_whether_it_is_specified():
    options = {"size": 2, "ensemble": 2, "tests": 2}
    run = transfer("eea", reality="slippery", models="coulomb", **options)
    truth = np.stack([reality("slippery").landscape()[axis] for axis in ("dx", "dy", "dz")], -1)
    models = library(Simulator(PUBLISHED), "coulomb", 2).displacement
    expected = min(np.sqrt(((one - truth) ** 2).sum() / (truth**2).sum()) for one in models)
    assert run.distance == pytest.approx(expected)
    assert run.is_specified
    assert not transfer("eea", reality="reversal", models="coulomb", **options).is_specified


# Identification.


@pytest.mark.parametrize("divergence", [0.1, 0.5, 1.0, 2.0])
def test_weights_go_as_far_from_equal_ones_as_they_may(divergence):
    cost = np.random.default_rng(3).exponential(size=16)
    weight = weights(cost, divergence)
    assert weight.sum() == pytest.approx(1)
    assert (weight * np.log(16 * weight)).sum() == pytest.approx(divergence, abs=1e-6)
    order = np.argsort(cost)
    assert (np.diff(weight[order]) < 0).all()
    # exp(-cost / temperature), of one temperature.
    slope = np.diff(np.log(weight[order])) / np.diff(cost[order])
    assert slope == pytest.approx(slope[0])


def test_weights_of_equal_costs_are_equal_and_at_most_all_goes_to_the_best():
    assert weights(np.ones(4), 1.0) == pytest.approx(np.full(4, 0.25))
    assert weights(np.array([3.0, 1.0, 2.0]), 50.0) == pytest.approx([0, 1, 0])


def test_models_of_one_batch_are_those_of_each_alone():
    method = Identification(
        Simulator(PUBLISHED), TASK, np.random.default_rng(0), models="all", fit_at=[99]
    )
    shares = np.random.default_rng(4).random((3, 8))
    designs = np.array([6453, 926])
    together = method.simulate(shares, designs)
    assert together.shape == (3, 2, 3)
    for share, moved in zip(shares, together, strict=True):
        physics = physics_at(share, PUBLISHED, "all")
        assert moved.tobytes() == simulate(designs, physics).displacement.tobytes()
        assert method.simulate(share, designs).tobytes() == moved.tobytes()
    truth = together[1]
    for design, seen in zip(designs.tolist(), truth, strict=True):
        method.tell(Test(design, float(seen[1]), seen))
    off = np.square(together[..., :2] - truth[:, :2]).sum(axis=-1).mean(axis=-1)
    assert method.misfit(shares) == pytest.approx(off)
    assert method.misfit(shares[1]) == 0


def test_simopt_moves_towards_a_truth_in_its_class():
    shares = np.array([0.9, 0.2, 0.9, 0.5, 0.5, 0.5, 0.5, 0.5])
    truth = physics_at(shares, PUBLISHED, "coulomb")
    designs = np.array([6453, 926, 2117, 4295])
    off = []
    for seed in range(3):
        method = made(
            "simopt", seed=seed, models="coulomb", fit_at=[4], candidates=4, draws=12, rounds=3
        )
        seen = simulate(designs, truth).displacement
        told(method, dict(zip(designs.tolist(), seen[:, :2], strict=True)))
        off.append((method.misfit(method._mean), method.misfit(np.full(8, 0.5))))
    fitted, before = np.mean(off, axis=0)
    assert fitted < before / 3


def test_simopt_builds_the_best_of_the_tested_and_the_expected():
    method = made("simopt", candidates=6, fit_at=[99])
    said = Simulator(PUBLISHED).landscape()[:, 1]
    first, second = np.argsort(-said.round(9), kind="stable")[:2]
    assert method.ask() == first
    method.tell(Test(int(first), float(said[second]) - 0.1, np.zeros(3)))
    assert method.recommend() == second
    method.method.tell(Test(5, 9.0, np.zeros(3)))
    assert method.recommend() == 5


def test_simopt_ends_where_its_candidates_do():
    run = transfer("simopt", tests=9, candidates=4, fit_at=[99])
    assert len(set(run.tested.tolist())) == 4


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("ite", {"kernel": "edit"}, "kernel must be hamming or behaviour"),
        ("ite", {"prior": "none"}, "prior must be signed or simulated"),
        ("ite", {"length": 0}, "length must be above 0"),
        ("ite", {"noise": -1}, "noise must be finite and at least 0"),
        ("gp_ucb", {"learn_at": 5}, "learn_at must be a list of numbers of tests, got 5"),
        ("gp_ucb", {"learn_at": [0]}, "learn_at must be at least 1"),
        ("transferability", {"population": 6}, "population must be a multiple of 4, got 6"),
        ("transferability", {"generations": 0}, "generations must be at least 1"),
        ("eea", {"choice": "best"}, "choice must be one of random, disagreement"),
        ("eea", {"models": "coulom"}, "models must be one of coulomb, coulomb_area, all"),
        ("eea", {"size": 0}, "size must be at least 1"),
        ("eea", {"ensemble": 0}, "ensemble must be at least 1"),
        ("domain_randomisation", {"tail": 0}, "tail must be a share above 0"),
        ("jakobi", {"level": 3}, "3"),
        ("simopt", {"draws": 1}, "draws must be at least 2"),
        ("simopt", {"divergence": 0}, "divergence must be above 0"),
        ("simopt", {"fit_at": "5"}, "fit_at must be a list of numbers of tests"),
        ("simopt", {"candidats": 5}, "has no option 'candidats'; its options are: draws"),
    ],
)
def test_options_that_cant_be_say_why(name, options, message):
    with pytest.raises((TypeError, ValueError), match=message):
        made(name, **options)


def test_the_first_of_equal_values_is_the_best():
    values = np.array([1.0, 2.0 - 1e-12, 2.0, 0.0])
    assert first_best(values) == 1
    assert first_best(values, np.array([True, False, False, True])) == 0
    assert after_tests("at", (3, 1)) == {1, 3}
