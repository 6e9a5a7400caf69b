"""What others carried from a simulator into reality: the paper's Table I."""

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
    Table I: keys, years and counts. Authors, titles and venues are ours.

    Examples
    --------
    >>> max(transfers(), key=lambda row: row.morphologies).title
    'Scalable sim-to-real transfer of soft robot designs'
    """
    return tuple(map(_transfer, records("transfers.csv")))


def _transfer(row: dict[str, str]) -> Transfer:
    year, controllers, morphologies = (int(row[name]) for name in Transfer._fields[1:4])
    return Transfer(
        row["key"], year, controllers, morphologies, row["authors"], row["title"], row["venue"]
    )
