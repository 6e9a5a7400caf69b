"""The oracle counts honestly, answers from its cache, and writes everything down."""

import time

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import VectorWrapper
from table_answers import FITNESS, SPACE, rows

from softvox_gym import ENV_ID, TABLE_ENV_ID, Design, Lattice, landscape
from softvox_gym.landscapes.table import tracks
from softvox_gym.wrappers.vector import FitnessNoise, JakobiNoise, Resample
from softvox_search.log import COLUMNS, digest
from softvox_search.oracle import MOST_ENVS, PATIENCE, Budget, Oracle, checked
from softvox_search.protocol import SearcherError

BEST = 6453


def table(n):
    return gym.make_vec(TABLE_ENV_ID, num_envs=n)


def engine(n):
    return gym.make_vec(ENV_ID, num_envs=n)


def measured(n):
    return FitnessNoise(table(n), sigma=0.3)


def jakobi(n):
    return JakobiNoise(engine(n), level=1.0)


def generator(seed=0):
    return np.random.default_rng(seed)


def batches(seed, sizes):
    """Designs of which many come again."""
    rng = generator(seed)
    return [rng.integers(40, size=size) * 163 for size in sizes]


def logged(oracle, designs):
    for batch in designs:
        oracle.evaluate(batch)
    return oracle.log.columns()


def test_an_answer_holds_what_the_table_says_in_the_order_asked():
    answer = Oracle(table, Budget(evaluations=9)).evaluate([BEST, 0, 4295])
    np.testing.assert_array_equal(answer.designs, rows(BEST, 0, 4295))
    np.testing.assert_array_equal(answer.values, FITNESS[[BEST, 0, 4295]])
    assert answer.info["displacement"].shape == (3, 3)
    assert answer.info["displacement"][0, 0] == landscape()["dx"][BEST]
    assert answer.info["diverged"].tolist() == [False] * 3
    assert answer.info["standard_error"].tolist() == [0] * 3


def test_every_form_of_a_batch_that_the_engine_takes_is_taken():
    numbers = np.array([BEST, 4295])
    digits = rows(*numbers)
    forms = [numbers, numbers.tolist(), digits, digits.tolist(), [Design(n) for n in numbers]]
    for form in [
        *forms,
        ["00021222", Design(4295).digits],
        np.array([Design(n).array for n in numbers]),
    ]:
        np.testing.assert_array_equal(checked(form, SPACE), digits)


def test_a_batch_of_nothing_costs_nothing():
    oracle = Oracle(table, Budget(evaluations=9))
    for nothing in ([], np.zeros((0, 8), dtype=int), np.zeros(0, dtype=int)):
        answer = oracle.evaluate(nothing)
        assert answer.designs.shape == (0, 8)
        assert answer.values.shape == (0,)
    assert (oracle.evaluations, oracle.unique, oracle.steps) == (0, 0, 0)
    assert len(oracle.log.columns()["design"]) == 0


def test_a_duplicate_is_an_evaluation_but_no_unique_one_within_a_batch_and_between():
    oracle = Oracle(table, Budget(evaluations=99))
    columns = logged(oracle, [[5, BEST, 5, 5], [BEST, 7]])
    assert (oracle.evaluations, oracle.unique) == (6, 3)
    assert oracle.steps == tracks().steps[[5, BEST, 7]].sum()
    assert columns["design"].tolist() == [5, BEST, 5, 5, BEST, 7]
    assert columns["sequence"].tolist() == [1, 2, 3, 4, 5, 6]
    assert columns["unique_sequence"].tolist() == [1, 2, 2, 2, 2, 3]
    assert columns["cached"].tolist() == [False, False, True, True, True, False]
    assert columns["noise_seed"].tolist() == [-1] * 6
    np.testing.assert_array_equal(columns["fitness"], FITNESS[columns["design"]])


def test_the_log_holds_displacement_fitness_and_divergence_of_each_evaluation():
    columns = logged(Oracle(table, Budget(evaluations=99)), batches(0, [30]))
    assert list(columns) == list(COLUMNS)
    assert {name: column.dtype.str for name, column in columns.items()} == COLUMNS
    known = landscape()[columns["design"]]
    for name in ("dx", "dy", "fitness", "diverged"):
        np.testing.assert_array_equal(columns[name], known[name])


class CountsWhatIsSimulated(VectorWrapper):
    simulated = 0
    is_noisy = False

    def step(self, actions):
        type(self).simulated += len(actions)
        return self.env.step(actions)


def test_what_the_cache_knows_is_not_simulated_again():
    CountsWhatIsSimulated.simulated = 0
    oracle = Oracle(lambda n: CountsWhatIsSimulated(table(n)), Budget(evaluations=999))
    logged(oracle, batches(0, [50, 50, 50]))
    assert CountsWhatIsSimulated.simulated == oracle.unique <= 40


@pytest.mark.parametrize(
    ("budget", "evaluations", "unique"),
    [
        (Budget(evaluations=25), 25, None),
        (Budget(unique=12), None, 12),
        (Budget(unique=20, evaluations=14), 14, 20),
        (Budget(unique=12, evaluations=900), None, 12),
    ],
    ids=str,
)
def test_a_batch_is_cut_where_a_budget_ends(budget, evaluations, unique):
    oracle = Oracle(table, budget)
    designs = batches(1, [10, 10, 10])
    answers = [oracle.evaluate(batch) for batch in designs]
    assert oracle.is_exhausted
    told = np.concatenate([answer.designs for answer in answers])
    np.testing.assert_array_equal(told, rows(*np.concatenate(designs)[: len(told)]))
    assert len(told) == oracle.evaluations
    assert oracle.unique == len(np.unique(told, axis=0))
    if evaluations is not None:
        assert oracle.evaluations == evaluations
        assert unique is None or oracle.unique < unique
    else:
        assert oracle.unique == unique
        assert not oracle.log.columns()["cached"][-1]  # it ends with the one that used it up
    assert len(oracle.evaluate([1, 2, 3]).designs) == 0


def test_the_budget_of_steps_ends_a_search_with_the_batch_that_uses_it_up():
    steps = int(tracks().steps[BEST])
    oracle = Oracle(table, Budget(evaluations=99, steps=3 * steps))
    assert len(oracle.evaluate([BEST, BEST, 4295]).designs) == 3
    assert not oracle.is_exhausted
    assert len(oracle.evaluate([5757, 6255]).designs) == 2
    assert oracle.is_exhausted
    assert oracle.steps == 4 * steps


def test_without_a_budget_of_evaluations_a_search_that_finds_nothing_new_ends_all_the_same():
    oracle = Oracle(table, Budget(unique=3))
    rounds = 0
    while not oracle.is_exhausted:
        oracle.evaluate([BEST])
        rounds += 1
    assert rounds == 3 * PATIENCE


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({}, ValueError, "must have unique, evaluations or cpu_seconds"),
        ({"steps": 3}, ValueError, "must have unique, evaluations or cpu_seconds"),
        ({"unique": 0}, ValueError, r"unique must be at least 1 .*, got 0"),
        ({"evaluations": -1}, ValueError, r"evaluations must be at least 1 .*, got -1"),
        ({"unique": 1, "steps": 0}, ValueError, r"steps must be at least 1 .*, got 0"),
        ({"unique": 1.5}, TypeError, "unique must be a whole number, got 1.5"),
        ({"evaluations": True}, TypeError, "evaluations must be a whole number, got True"),
        ({"cpu_seconds": 0.0}, ValueError, "cpu_seconds must be above 0, got 0"),
        ({"cpu_seconds": np.inf}, ValueError, "cpu_seconds must be finite and at least 0, got inf"),
        ({"cpu_seconds": "1"}, TypeError, "cpu_seconds must be a number, got '1'"),
    ],
)
def test_a_budget_that_is_none_is_refused(given, error, message):
    with pytest.raises(error, match=message):
        Budget(**given)


@pytest.mark.parametrize(
    ("designs", "message"),
    [
        ([6561], "6561 is outside 0 ... 6560"),
        ([-1], "-1 is outside"),
        (np.full((1, 8), 3), "digits 0, 1 and 2 only, got 3"),
        ([np.nan], "invalid designs"),
        (np.full((2, 8), np.nan), "must be whole numbers, got float64"),
        (np.full((2, 8), 1.0), "must be whole numbers, got float64"),
        (np.ones((2, 7), dtype=int), "got shape"),
        ([Design([1], shape=(1, 1, 1))], "1x1x1"),
        (np.ones((1, 3, 2, 2), dtype=int), "got shape"),
        (None, "invalid designs"),
        ([[0, 1], [2]], "invalid designs"),
    ],
    ids=str,
)
def test_what_are_no_designs_costs_nothing_and_is_refused(designs, message):
    oracle = Oracle(table, Budget(evaluations=9))
    with pytest.raises(SearcherError, match=message):
        oracle.evaluate(designs)
    assert oracle.evaluations == 0
    assert len(oracle.log.columns()["design"]) == 0


def test_a_noisy_environment_needs_a_generator():
    with pytest.raises(ValueError, match="rng must be given"):
        Oracle(measured, Budget(evaluations=9))


def test_noise_of_level_zero_is_none_and_duplicates_come_from_the_cache():
    oracle = Oracle(lambda n: FitnessNoise(table(n), sigma=0.0), Budget(evaluations=9))
    assert not oracle.noisy
    assert logged(oracle, [[BEST, BEST]])["cached"].tolist() == [False, True]


def test_under_noise_every_evaluation_is_a_fresh_draw_and_counts():
    oracle = Oracle(measured, Budget(evaluations=99), rng=generator())
    columns = logged(oracle, [[BEST, BEST, 5], [BEST]])
    assert oracle.noisy
    assert (oracle.evaluations, oracle.unique) == (4, 4)
    assert oracle.steps == tracks().steps[[BEST, BEST, 5, BEST]].sum()
    assert not columns["cached"].any()
    assert len(set(columns["fitness"])) == len(set(columns["noise_seed"])) == 4
    assert (columns["noise_seed"] >= 0).all()


def test_under_noise_a_budget_of_unique_designs_counts_every_evaluation():
    oracle = Oracle(measured, Budget(unique=5), rng=generator())
    assert len(oracle.evaluate([BEST] * 9).designs) == 5
    assert oracle.is_exhausted


@pytest.mark.parametrize("make_env", [measured, jakobi, lambda n: Resample(jakobi(n), n=3)])
def test_design_and_noise_seed_of_the_log_give_its_values_again(make_env):
    oracle = Oracle(make_env, Budget(evaluations=99), rng=generator())
    columns = logged(oracle, batches(2, [4, 3]))
    by_hand = make_env(1)
    for i in range(len(columns["design"])):
        by_hand.reset(seed=[int(columns["noise_seed"][i])])
        _, reward, _, _, info = by_hand.step(rows(columns["design"][i]))
        assert reward[0] == columns["fitness"][i]
        assert info["displacement"][0, 0] == columns["dx"][i]
        assert info["displacement"][0, 1] == columns["dy"][i]
        assert info["diverged"][0] == columns["diverged"][i]


def test_noisy_values_do_not_depend_on_how_the_designs_are_batched():
    designs = np.concatenate(batches(3, [12]))
    logs = [
        logged(Oracle(measured, Budget(evaluations=99), rng=generator()), parts)
        for parts in ([designs], [designs[:5], designs[5:]], designs[:, np.newaxis])
    ]
    assert len({digest(log) for log in logs}) == 1


def test_a_single_draw_has_no_standard_error():
    answer = Oracle(measured, Budget(evaluations=9), rng=generator()).evaluate([BEST, 5])
    assert np.isnan(answer.info["standard_error"]).all()


def test_resampled_values_come_with_their_standard_error():
    oracle = Oracle(lambda n: Resample(measured(n), n=4), Budget(evaluations=99), rng=generator())
    answer = oracle.evaluate([BEST, 5])
    assert (answer.info["standard_error"] > 0).all()
    assert (answer.info["standard_error"] < 0.6).all()


def test_a_batch_larger_than_the_largest_environment_is_evaluated_in_pieces():
    sizes = []

    def make_env(n):
        sizes.append(n)
        return table(n)

    oracle = Oracle(make_env, Budget(evaluations=6561))
    np.testing.assert_array_equal(oracle.evaluate(np.arange(6561)).values, FITNESS)
    assert max(sizes) == MOST_ENVS


class Diverges(VectorWrapper):
    """Design 5 diverges."""

    is_noisy = False

    def step(self, actions):
        observations, rewards, terminated, truncated, infos = self.env.step(actions)
        is_five = infos["design"] == 5
        infos["diverged"] = infos["diverged"] | is_five
        infos["displacement"] = np.where(is_five[:, np.newaxis], np.nan, infos["displacement"])
        return observations, np.where(is_five, 0.0, rewards), terminated, truncated, infos


def test_a_design_that_diverges_is_told_and_logged_as_such():
    oracle = Oracle(lambda n: Diverges(table(n)), Budget(evaluations=9))
    answer = oracle.evaluate([BEST, 5, 5])
    columns = oracle.log.columns()
    assert answer.info["diverged"].tolist() == columns["diverged"].tolist()
    assert columns["diverged"].tolist() == [False, True, True]
    assert np.isnan(columns["dx"]).tolist() == [False, True, True]
    assert answer.values[1:].tolist() == [0, 0]


def test_the_table_and_the_engine_give_the_same_log():
    designs = [np.arange(0, 6561, 61), [BEST, BEST, 4295, 6481, 6507]]
    table_log, engine_log = (
        logged(Oracle(make_env, Budget(evaluations=999)), designs) for make_env in (table, engine)
    )
    assert digest(table_log) == digest(engine_log)


def test_the_digest_of_a_log_is_that_of_its_bits():
    logs = [
        logged(Oracle(measured, Budget(evaluations=99), rng=generator(seed)), batches(0, [20]))
        for seed in (0, 0, 1)
    ]
    assert digest(logs[0]) == digest(logs[1]) != digest(logs[2])
    changed = {**logs[0], "dx": np.nextafter(logs[0]["dx"], np.inf)}
    assert digest(changed) != digest(logs[0])


def test_closing_an_oracle_closes_its_environments():
    made = []

    def make_env(n):
        made.append(table(n))
        return made[-1]

    oracle = Oracle(make_env, Budget(evaluations=9))
    oracle.evaluate([1, 2])
    oracle.close()
    assert len(made) == 2
    assert all(env.closed for env in made)


class SaysNothing(VectorWrapper):
    """Measures with errors of its own."""

    def step(self, actions):
        observations, rewards, *rest = self.env.step(actions)
        return observations, rewards + self.env.unwrapped.np_random[0].random(), *rest


class Unworthy(SaysNothing):
    """Rewards with NaN."""

    is_noisy = False

    def step(self, actions):
        observations, rewards, *rest = self.env.step(actions)
        return observations, rewards * np.nan, *rest


def test_a_wrapper_that_doesnt_say_whether_it_is_noisy_is_refused():
    def make(n):
        return SaysNothing(gym.make_vec(TABLE_ENV_ID, num_envs=n))

    with pytest.raises(ValueError, match="SaysNothing doesn't say whether"):
        Oracle(make, Budget(unique=5))
    assert Oracle(make, Budget(unique=5), noisy=True, rng=np.random.default_rng(0)).noisy


def test_a_vector_reward_is_refused():
    oracle = Oracle(lambda n: gym.make_vec(ENV_ID, n, objectives=["voxels"]), Budget(unique=5))
    with pytest.raises(ValueError, match=r"reward vectors.*without objectives"):
        oracle.evaluate([1])


def test_a_reward_of_nan_is_refused():
    oracle = Oracle(lambda n: Unworthy(gym.make_vec(TABLE_ENV_ID, num_envs=n)), Budget(unique=5))
    with pytest.raises(ValueError, match="a reward of NaN"):
        oracle.evaluate([1, 2, 3])


@pytest.mark.parametrize("kind", [list, np.array])
def test_the_digits_of_one_design_are_not_taken_for_eight_numbers(kind):
    with pytest.raises(SearcherError, match="digits"):
        checked(kind([0, 0, 0, 2, 1, 2, 2, 2]), SPACE)
    assert checked(kind([[0, 0, 0, 2, 1, 2, 2, 2]]), SPACE).tolist() == [[0, 0, 0, 2, 1, 2, 2, 2]]
    assert len(checked(kind([0, 0, 0, 2, 1, 2, 2, 3]), SPACE)) == 8
    assert len(checked([Design(1)] * 8, SPACE)) == 8


def test_what_is_checked_is_a_copy():
    given = rows(5, 6)
    made = checked(given, SPACE)
    given[:] = 2
    np.testing.assert_array_equal(made, rows(5, 6))


# Time


def work(seconds):
    begin = time.process_time()
    while time.process_time() - begin < seconds:
        pass


def test_seconds_of_processor_time_end_a_search_from_the_first_look_at_the_budget():
    oracle = Oracle(table, Budget(cpu_seconds=0.5))
    work(0.6)
    assert not oracle.is_exhausted  # here the clock starts
    oracle.evaluate([1, 2])
    assert not oracle.is_exhausted
    work(0.6)
    assert oracle.ended_by == "cpu_seconds"
    assert len(oracle.evaluate([3]).designs) == 0
    assert oracle.evaluations == 2


def test_one_batch_is_evaluated_however_short_the_time():
    oracle = Oracle(table, Budget(cpu_seconds=1e-9))
    assert not oracle.is_exhausted
    assert len(oracle.evaluate([1, 2]).designs) == 2
    assert oracle.is_exhausted


@pytest.mark.parametrize(
    ("budget", "plain", "noisy"),
    [
        (Budget(unique=5), 100, 5),
        (Budget(unique=5, evaluations=3), 3, 3),
        (Budget(evaluations=7), 7, 7),
        (Budget(cpu_seconds=1), None, None),
    ],
    ids=str,
)
def test_a_budget_says_how_many_evaluations_it_allows(budget, plain, noisy):
    assert budget.most_evaluations(noisy=False) == plain
    assert budget.most_evaluations(noisy=True) == noisy


def test_progress_is_told_in_what_the_budget_counts():
    told = []

    def tell(*progress):
        told.append(progress)

    for make_env, budget in (
        (table, Budget(unique=3)),
        (table, Budget(evaluations=3)),
        (measured, Budget(unique=3)),
        (table, Budget(cpu_seconds=9)),
    ):
        oracle = Oracle(make_env, budget, rng=generator(), progress=tell)
        oracle.evaluate([BEST, BEST])
    assert told == [(1, 3), (2, 3), (2, 3)]


# Other lattices


def small(n):
    physics = {"duration": 0.01, "settle_time": 0.001}
    return gym.make_vec("SoftVox3x3x3-v0", num_envs=n, physics=physics)


def test_on_another_lattice_the_cache_and_the_log_work_as_on_2x2x2():
    space = Lattice(3, 3, 3)
    numbers = np.array([space.n_designs - 1, 5, space.n_designs - 1])
    oracle = Oracle(small, Budget(evaluations=9))
    assert oracle.space == space
    columns = logged(oracle, [numbers, space.digits(numbers)])
    assert columns["design"].tolist() == [*numbers, *numbers]
    assert columns["cached"].tolist() == [False, False, True, True, True, True]
    assert columns["fitness"][0] == columns["fitness"][3] > 0
    with pytest.raises(SearcherError, match="invalid designs"):
        oracle.evaluate(np.zeros((1, 8), dtype=int))
