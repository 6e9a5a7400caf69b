"""The final stage: who gets into it, what it decides, and what it buys."""

import numpy as np
import pytest
from scripted import Script, noisy, tell, to_the_end
from table_answers import FITNESS, SPACE, fitness_of, numbers

from softvox_gym import Design
from softvox_search.policies import Policy, PolicySearcher
from softvox_search.registry import make

NAIVE = Policy()


def within(searcher, policy, **options):
    return PolicySearcher(searcher, policy, SPACE, **options)


@pytest.mark.parametrize("n", [None, 7])
@pytest.mark.parametrize("running_mean", [False, True])
def test_the_last_evaluations_are_fresh_draws_of_those_believed_best(running_mean, n):
    policy = Policy(running_mean=running_mean, final_stage=True, finalists=5, resamples=6)
    guarded = within(make("ga", np.random.default_rng(0)), policy, evaluations=300)
    asked, values = to_the_end(guarded, noisy(1), n)
    assert len(asked) == 300
    search, final = np.split(asked, [270])
    believed = {
        i: values[:270][search == i].mean() if running_mean else values[:270][search == i][-1]
        for i in set(search.tolist())
    }
    finalists = sorted(believed, key=lambda i: -believed[i])[:5]
    assert final.tolist() == finalists * 6
    means = {i: values[270:][final == i].mean() for i in finalists}
    best = guarded.recommend()
    assert best.index == max(means, key=means.get)
    for i, mean in means.items():
        assert guarded.belief(Design(i)) == pytest.approx(mean, rel=1e-14)
    other = next(i for i in believed if i not in means)
    assert guarded.belief(Design(other)) == pytest.approx(believed[other], rel=1e-14)


def test_the_searcher_within_learns_nothing_of_the_final_stage():
    script = Script([1, 2], [3, 4, 5], [6])
    policy = Policy(final_stage=True, finalists=2, resamples=2)
    to_the_end(within(script, policy, evaluations=8), fitness_of)
    assert [event[1] for event in script.events if event[0] == "tell"] == [[1, 2], [3, 4]]


def test_a_search_that_ends_early_goes_on_to_the_final_stage():
    policy = Policy(final_stage=True, finalists=2, resamples=3)
    guarded = within(Script([700, 800]), policy, evaluations=1000)
    asked, _ = to_the_end(guarded, fitness_of)
    assert sorted(asked[2:].tolist()) == [700] * 3 + [800] * 3


def test_where_fewer_designs_are_known_than_finalists_these_get_all_the_draws():
    guarded = within(
        Script([7, 3]), Policy(final_stage=True, finalists=5, resamples=3), evaluations=60
    )
    tell(guarded, guarded.ask(), [1.0, 2.0])
    assert numbers(guarded.ask()) == [3, 7] * 7 + [3]


def test_a_final_stage_cut_off_counts_once_every_finalist_had_a_draw():
    policy = Policy(final_stage=True, finalists=2, resamples=2)
    guarded = within(Script([1, 2, 3, 4]), policy, evaluations=8)
    tell(guarded, guarded.ask(), [1.0, 2.0, 3.0, 4.0])
    assert numbers(guarded.ask()) == [4, 3, 4, 3]
    tell(guarded, guarded.ask(1), [0.0])
    assert guarded.recommend() == Design(4)
    assert guarded.belief(Design(4)) == 4.0
    tell(guarded, guarded.ask(1), [1.0])
    assert guarded.recommend() == Design(3)
    assert [guarded.belief(Design(i)) for i in (3, 4, 2)] == [1.0, 0.0, 2.0]
    tell(guarded, guarded.ask(1), [6.0])
    assert guarded.recommend() == Design(4)
    assert guarded.belief(Design(4)) == 3.0


def test_a_budget_too_small_for_a_final_stage_is_refused():
    searcher = make("ga", np.random.default_rng(0))
    within(searcher, Policy(final_stage=True), evaluations=160)
    with pytest.raises(ValueError, match=r"leaves fewer than half .* of 159 .* at least 160"):
        within(searcher, Policy(final_stage=True), evaluations=159)


def test_a_final_stage_without_a_budget_is_refused():
    with pytest.raises(ValueError, match="evaluations must be given"):
        within(make("ga", np.random.default_rng(0)), Policy(final_stage=True))


# What they buy


SIGMA = 0.5
RUNS = 40


def outcomes(policy, name="mu_plus_lambda"):
    """Optimism in the design recommended and true regret of it, run by run."""
    optimism, regret, finalists = [], [], []
    for seed in range(RUNS):
        searcher = make(name, np.random.default_rng(seed))
        guarded = within(searcher, policy, evaluations=600)
        noise = noisy(1000 + seed, SIGMA)
        if policy.final_stage:
            to_the_end(guarded, noise)
            finalists.extend(
                guarded.belief(Design(one)) - FITNESS[one] for one in numbers(guarded._finalists)
            )
        else:
            for _ in range(15):
                designs = guarded.ask()
                tell(guarded, designs, noise(designs))
        design = guarded.recommend()
        optimism.append(guarded.belief(design) - FITNESS[design.index])
        regret.append(FITNESS.max() - FITNESS[design.index])
    return np.array(optimism), np.array(regret), np.array(finalists)


def test_the_naive_searcher_is_fooled_by_luck_and_the_final_stage_is_not():
    naive, naive_regret, _ = outcomes(NAIVE)
    final, final_regret, finalists = outcomes(Policy(final_stage=True))
    # The luckiest of some hundred draws is about two standard deviations above its truth.
    assert naive.mean() > SIGMA
    # The mean of 8 fresh draws is unbiased: 400 of them have a standard error of sigma/sqrt(3200).
    assert abs(finalists.mean()) < 4 * SIGMA / np.sqrt(8 * len(finalists))
    # Choosing the best of ten such means adds 1.54 of their standard deviations at most.
    error = SIGMA / np.sqrt(8)
    assert -4 * error / np.sqrt(RUNS) < final.mean() < (1.54 + 4 / np.sqrt(RUNS)) * error
    assert final.mean() < naive.mean() / 2
    assert final_regret.mean() < naive_regret.mean()
