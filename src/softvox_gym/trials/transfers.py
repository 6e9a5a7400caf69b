"""How many robots earlier works transferred from simulation to reality: the paper's Table I."""

from __future__ import annotations

from typing import NamedTuple

from softvox_gym.data import records


class Transfer(NamedTuple):
    """One row: how many controllers and morphologies a work tried in reality."""

    key: str  #: as in the paper's bibliography
    year: int
    controllers: int
    morphologies: int
    authors: str
    title: str
    venue: str


def transfers() -> tuple[Transfer, ...]:
    """Return the 25 works of the table, the paper itself last, in the paper's order.

    Source: Kriegman et al., "Scalable sim-to-real transfer of soft robot designs", RoboSoft 2020,
    Table I: keys, years and counts. Authors, titles and venues were added here.

    Examples
    --------
    >>> max(transfers(), key=lambda row: row.morphologies).title
    'Scalable sim-to-real transfer of soft robot designs'
    """
    rows = (row.values() for row in records("transfers.csv"))
    return tuple(
        Transfer(key, int(year), int(controllers), int(morphologies), *source)
        for key, year, controllers, morphologies, *source in rows
    )
