"""`evaluate` in chunks on a cluster; here a client that does them at once, as if elsewhere.

tests/search/test_cluster.py has one of Dask.
"""

import pickle
from dataclasses import fields, is_dataclass
from itertools import pairwise

import numpy as np
import pytest

from softvox_gym import Lattice, Reality, cluster, evaluate
from softvox_gym.noise import Jakobi, MeasurementNoise

SHORT = {"preset": "published", "duration": 1.3}
DESIGNS = [6453, 0, 926, 6560, 13, 6453, 2117]
NOISE = [Jakobi(1.0), MeasurementNoise(0.1)]


class Client:
    """Does work in this process, on copies of its arguments."""

    def __init__(self):
        self.chunks = []

    def submit(self, function, *arguments, pure):
        assert not pure
        function, arguments = pickle.loads(pickle.dumps((function, arguments)))
        self.chunks.append(len(arguments[2]))
        return pickle.dumps(function(*arguments))

    def gather(self, futures):
        return [pickle.loads(future) for future in futures]


@pytest.fixture
def client(monkeypatch):
    monkeypatch.setattr(cluster, "CHUNK_WORK", 20_000)  # two or three designs
    return Client()


def assert_same_bits(one, other):
    assert type(one) is type(other)
    if isinstance(one, np.ndarray):
        assert (one.shape, one.dtype) == (other.shape, other.dtype)
        assert one.tobytes() == other.tobytes()
    elif type(one) is tuple:
        for each in zip(one, other, strict=True):
            assert_same_bits(*each)
    elif is_dataclass(one):
        for field in fields(one):
            assert_same_bits(getattr(one, field.name), getattr(other, field.name))
    else:
        assert one == other


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"trials": 3, "frames": 1000, "task": "directed"},
        {"perturbations": NOISE, "trials": 3, "seed": 5, "frames": 1000, "aggregate": "min"},
        {"seed": 3},
        {"perturbations": NOISE, "seed": 1, "objectives": ("energy", "straightness")},
        {"perturbations": NOISE, "trials": 2, "seed": 1, "shape": Lattice.of((2, 2, 2), phases=2)},
    ],
)
def test_the_bits_are_those_of_one_call(client, options):
    there = evaluate(DESIGNS, SHORT, client=client, **options)
    assert len(client.chunks) > 1
    assert_same_bits(there, evaluate(DESIGNS, SHORT, **options))


def test_generators_are_left_as_if_they_had_drawn_here(client):
    own, others = ([np.random.default_rng(i) for i in range(7)] for _ in range(2))
    for _ in range(2):
        there = evaluate(DESIGNS, SHORT, perturbations=NOISE, seed=own, client=client)
        here = evaluate(DESIGNS, SHORT, perturbations=NOISE, seed=others)
        assert_same_bits(there, here)


def test_without_a_seed_every_call_draws_anew(client):
    first, second = (
        evaluate(DESIGNS, SHORT, perturbations=NOISE, client=client).fitness for _ in range(2)
    )
    assert (first != second).any()
    assert len(set(first[[0, 5], 0])) == 2


def test_in_a_reality_of_its_own_the_bits_are_those_of_one_call(client):
    where = Reality("mine", SHORT, strain_error=0.2, resolution=3)
    there = evaluate(DESIGNS, where, client=client)
    assert_same_bits(there, evaluate(DESIGNS, where))


def test_a_chunk_has_as_much_work_as_another_and_designs_of_like_body_plans(client):
    evaluate(np.arange(60), SHORT, client=client)
    assert max(client.chunks) <= 60 / 4
    stack = np.random.default_rng(0).integers(0, 3, (200, 2, 2, 2)).astype(np.uint8)
    order, chunks = cluster._chunks(stack, Reality.of("published"), 1)
    assert sorted(order) == list(range(200))
    assert np.concatenate(chunks).tolist() == order.tolist()
    plans = [tuple(plan) for plan in (stack[order] > 0).reshape(200, -1)]
    assert len(set(plans)) == 1 + sum(a != b for a, b in pairwise(plans))


def test_no_more_chunks_than_a_scheduler_likes(monkeypatch):
    monkeypatch.setattr(cluster, "CHUNK_WORK", 1)
    monkeypatch.setattr(cluster, "MOST_CHUNKS", 3)
    client = Client()
    evaluate(DESIGNS, SHORT, client=client)
    assert len(client.chunks) == 3


def test_no_designs_need_no_cluster(client):
    assert len(evaluate(np.zeros((0, 2, 2, 2), int), client=client)) == 0
    assert client.chunks == []


def test_what_can_not_be_is_refused_before_anything_is_sent(client):
    with pytest.raises(TypeError, match=r"client must have submit and gather.*got 7"):
        evaluate(DESIGNS, client=7)
    shared = [np.random.default_rng(0)] * 7
    with pytest.raises(ValueError, match="seed must be a different generator for every"):
        evaluate(DESIGNS, perturbations=NOISE, seed=shared, client=client)
    with pytest.raises(ValueError, match="trials must be at least 1"):
        evaluate(DESIGNS, trials=0, client=client)
    assert client.chunks == []


def test_a_worker_of_other_bits_is_refused(client, monkeypatch):
    probes = iter(["here", "there"])
    monkeypatch.setattr(cluster, "_probe", lambda _: next(probes))
    with pytest.raises(RuntimeError, match="a worker's engine, or its NumPy, gives other bits"):
        evaluate([6453], SHORT, client=client)
