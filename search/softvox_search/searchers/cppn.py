"""Evolution of compositional pattern-producing networks (CPPNs), which draw robots."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Design, Lattice
from softvox_gym.design import PASSIVE
from softvox_gym.simulation import check_count
from softvox_search.evolution import Individual, check_share
from softvox_search.searchers.afpo import Afpo

Array = NDArray[np.float64]

#: x, y, z, the distance from the centre, and a bias.
INPUTS = 5

#: Squares are capped here, so that squares of squares don't overflow.
MOST = 1e6

#: Most networks tried to find one whose design was not proposed yet.
TRIES = 50

#: Functions of a node's summed inputs. Only arithmetic and roots, which give the same bits on every
#: machine: a triangle wave for the sine, rational bells and sigmoids for exponentials.
FUNCTIONS: dict[str, Callable[[Array], Array]] = {
    "sum": lambda x: x,
    "absolute": np.abs,
    "square": lambda x: np.minimum(x * x, MOST),
    "root": lambda x: np.sqrt(np.abs(x)),
    "sigmoid": lambda x: x / (1 + np.abs(x)),
    "bell": lambda x: 1 / (1 + x * x),
    "wave": lambda x: 4 * np.abs(x / 2 - np.rint(x / 2)) - 1,
}

NAMES = tuple(FUNCTIONS)


@dataclass(frozen=True)
class Network:
    """A network without loops: nodes in order, the `INPUTS` first, and links to later nodes.

    Attributes
    ----------
    functions : tuple of str
        Functions of the nodes after the inputs; the outputs, the last ones, have "sum".
    links : dict of (int, int) to float
        The weight of each link, by the indices of its two nodes.
    outputs : int
    """

    functions: tuple[str, ...]
    links: dict[tuple[int, int], float]
    outputs: int

    @classmethod
    def random(cls, outputs: int) -> Network:
        """Return a network that links every input to every output, with random weights."""
        ends = range(INPUTS, INPUTS + outputs)
        links = {(a, b): random.uniform(-1, 1) for b in ends for a in range(INPUTS)}
        return cls(("sum",) * outputs, links, outputs)

    @property
    def hidden(self) -> range:
        """The indices of the nodes that are neither inputs nor outputs."""
        return range(INPUTS, INPUTS + len(self.functions) - self.outputs)

    def __call__(self, inputs: Array) -> Array:
        """Return the outputs, shape (outputs, n), for inputs of shape (INPUTS, n)."""
        values = list(inputs)
        for place, name in enumerate(self.functions, start=INPUTS):
            total = np.zeros(inputs.shape[1])
            for (source, target), weight in self.links.items():
                if target == place:
                    total += weight * values[source]
            values.append(FUNCTIONS[name](total))
        return np.array(values[-self.outputs :])

    def mutated(self, structure: float) -> Network:
        """Return a copy with one change, drawn from Python's global `random`.

        With a probability of `structure` a node or a link is added or, half as often, removed;
        otherwise a weight or a node's function changes. Without anything to change, the copy is
        equal.
        """
        changes = [_weigh, _weigh, _choose_function]
        if random.random() < structure:
            changes = 2 * [_add_node, _add_link] + [_remove_node, _remove_link]
        try:
            return random.choice(changes)(self)
        except IndexError:  # from a choice among none
            return self


def _add_node(network: Network) -> Network:
    """Split a link by a node, as NEAT does: the link in has weight 1, the link out the old one."""
    source, target = random.choice(list(network.links))
    place = max(source + 1, INPUTS)
    links = dict(network.links)
    weight = links.pop((source, target))
    links = {(a + (a >= place), b + (b >= place)): w for (a, b), w in links.items()}
    links |= {(source, place): 1.0, (place, target + 1): weight}
    return _with_function(replace(network, links=links), place, place, (random.choice(NAMES),))


def _remove_node(network: Network) -> Network:
    place = random.choice(network.hidden)
    left = [(key, weight) for key, weight in network.links.items() if place not in key]
    links = {(a - (a > place), b - (b > place)): weight for (a, b), weight in left}
    return _with_function(replace(network, links=links), place, place + 1, ())


def _choose_function(network: Network) -> Network:
    place = random.choice(network.hidden)
    return _with_function(network, place, place + 1, (random.choice(NAMES),))


def _with_function(network: Network, begin: int, end: int, names: tuple[str, ...]) -> Network:
    """Return a copy with the functions of the nodes from begin to end replaced."""
    functions = network.functions
    own = functions[: begin - INPUTS] + names + functions[end - INPUTS :]
    return replace(network, functions=own)


def _add_link(network: Network) -> Network:
    source = random.randrange(network.hidden.stop)
    target = random.randrange(max(source + 1, INPUTS), INPUTS + len(network.functions))
    return replace(network, links=network.links | {(source, target): random.uniform(-1, 1)})


def _remove_link(network: Network) -> Network:
    gone = random.choice(list(network.links))
    return replace(network, links={key: w for key, w in network.links.items() if key != gone})


def _weigh(network: Network) -> Network:
    key = random.choice(list(network.links))
    weight = network.links[key] + random.uniform(-1, 1)
    return replace(network, links=network.links | {key: weight})


def coordinates(space: Lattice) -> Array:
    """Return the inputs of a network for every site, shape (INPUTS, sites).

    x, y and z from -1 to 1 (0 if the lattice is one voxel thick), the distance from the centre in
    the same unit, and 1.
    """
    axes = [(2.0 * np.arange(side) - (side - 1)) / max(side - 1, 1) for side in space]
    x, y, z = (space.to_rows(axis) for axis in np.meshgrid(*axes, indexing="ij"))
    return np.array([x, y, z, np.sqrt(x * x + y * y + z * z), np.ones(space.sites)])


def drawn(network: Network, inputs: Array, space: Lattice) -> list[int]:
    """Return the digits of the robot that a network draws.

    A site has a voxel if the first output is above 0; the largest of the other outputs decides its
    kind. If there are several pieces, only the largest stays, or the one with the first site.
    """
    presence, *kinds = network(inputs)
    digits = np.where(presence > 0, 1 + np.argmax(kinds, axis=0), 0)
    made = np.zeros_like(digits)
    if digits.any():
        pieces = Design(np.minimum(digits, PASSIVE), shape=space).components
        largest = max(pieces, key=len)
        made[list(largest)] = digits[list(largest)]
    return [int(digit) for digit in made]


class Drawn(Individual):
    """The digits of a design, and the network that draws them."""

    network: Network

    def clone(self) -> Drawn:
        """Return an independent copy, not yet evaluated."""
        made = Drawn(self, type(self.fitness)(), self.age)
        made.network = self.network
        return made


class Cppn(Afpo):
    """Age-fitness Pareto optimisation of networks (CPPNs) that map each site to a voxel.

    A network gets a site's x, y and z, its distance from the centre, and a bias. Its first output
    decides whether a voxel is there, the others of which kind: the largest wins. So a design has
    the regularities of functions of position, such as symmetry and stripes, and the same network
    draws it on any lattice. Only the largest piece is kept.

    The first networks link all inputs to all outputs and are mutated a few times. A mutation adds
    or removes a node or a link, or changes a weight or a node's function. Most mutations leave the
    design unchanged, so a child is mutated until its design is not empty and was not proposed
    before, at most fifty times. Selection is that of `afpo`.

    Parameters
    ----------
    population : int
        Number of survivors in every generation.
    structure : float
        Probability that a mutation adds or removes a node or link instead of changing one.
    start : int
        Number of mutations of each of the first networks, all of which add or remove something.

    Notes
    -----
    As in the papers, with three exceptions: no crossover and no species, because selection by age
    keeps diversity; only functions that are sums, products, roots and roundings, which give the
    same bits on every machine; and active or passive voxels instead of several materials.

    Source
    ------
    N. Cheney, R. MacCurdy, J. Clune, H. Lipson, *Unshackling evolution: evolving soft robots with
    multiple materials and a powerful generative encoding*, GECCO 2013; K. O. Stanley,
    *Compositional pattern producing networks: a novel abstraction of development*, Genetic
    Programming and Evolvable Machines 8(2), 2007; with selection by age: N. Cheney, J. Bongard,
    V. SunSpiral, H. Lipson, *Scalable co-optimization of morphology and control in embodied
    machines*, Journal of the Royal Society Interface 15, 2018.
    """

    def __init__(
        self,
        space: Lattice,
        rng: np.random.Generator,
        *,
        population: int = 30,
        structure: float = 0.5,
        start: int = 10,
    ) -> None:
        super().__init__(space, rng, population=population)
        check_share("structure", structure)
        check_count("start", start, least=0)
        self._structure = structure
        self._start = start
        self._inputs = coordinates(space)
        self._proposed: set[bytes] = set()
        self.toolbox.register("clone", Drawn.clone)
        self.toolbox.register("mutate", self._mutate)

    def random(self, n: int) -> list[Individual]:
        """Return n individuals of random networks."""
        return [self._newcomer() for _ in range(n)]

    def _newcomer(self) -> Drawn:
        made = Drawn((), self.fitness())
        for _ in range(TRIES):
            # Presence, and one per kind of voxel: as many as the states of a site, absent included.
            made.network = Network.random(self.space.states)
            for _ in range(self._start):
                made.network = made.network.mutated(1.0)
            made[:] = drawn(made.network, self._inputs, self.space)
            if self._is_new(made):
                break
        return made

    def _mutate(self, child: Drawn) -> tuple[Drawn]:
        """Mutate a network until its design is new, in place; start again if it becomes empty."""
        parent = child.network
        for _ in range(TRIES):
            child.network = (child.network if any(child) else parent).mutated(self._structure)
            child[:] = drawn(child.network, self._inputs, self.space)
            if self._is_new(child):
                break
        return (child,)

    def _is_new(self, digits: list[int]) -> bool:
        """Return whether a design is not empty and was not proposed before, and record it."""
        before = len(self._proposed)
        self._proposed.add(bytes(digits))
        return any(digits) and len(self._proposed) > before
