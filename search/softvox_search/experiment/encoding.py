"""A run's record as bytes, and as rows of the table of evaluations."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import pyarrow as pa

from softvox_search.experiment.job import Columns, Record
from softvox_search.log import NO_SEED

#: Of the table of evaluations.
SCHEMA = pa.schema(
    [
        ("run", pa.int32()),
        ("sequence", pa.int32()),
        ("unique_sequence", pa.int32()),
        ("design", pa.int16()),
        ("dx", pa.float64()),
        ("dy", pa.float64()),
        ("fitness", pa.float64()),
        ("status", pa.dictionary(pa.int8(), pa.string())),
        ("noise_seed", pa.int64()),
        ("cached", pa.bool_()),
    ]
)

_STATUS = ("diverged", "ok")
_LENGTH = struct.Struct("<Q")


def evaluations(run: int, columns: Columns) -> pa.Table:
    """Return a run's log as rows of the table; a noise seed is null where there was none."""
    seeds = columns["noise_seed"]
    is_ok = (columns["status"] == "ok").astype(np.int8)
    arrays = {
        "run": np.full(len(seeds), run, dtype=np.int32),
        **{name: columns[name] for name in ("sequence", "unique_sequence", "design")},
        **{name: columns[name] for name in ("dx", "dy", "fitness", "cached")},
        "status": pa.DictionaryArray.from_arrays(pa.array(is_ok), pa.array(_STATUS)),
        "noise_seed": pa.array(seeds, mask=seeds == NO_SEED),
    }
    return pa.table([pa.array(arrays[name]) for name in SCHEMA.names], schema=SCHEMA)


def encode(record: Record) -> bytes:
    """Return a record as bytes: three parts, each with its length before it."""
    facts = {"summary": record.summary, "seconds": record.seconds}
    found = {name: column.tolist() for name, column in record.improvements.items()}
    table = evaluations(record.summary["run"], record.columns)
    parts = (json.dumps(facts).encode(), json.dumps(found).encode(), _packed(table))
    return b"".join(_LENGTH.pack(len(part)) + part for part in parts)


class Decoded:
    """A record read back; each part when it is asked for.

    Parameters
    ----------
    content : bytes
        As `encode` returns it.
    """

    def __init__(self, content: bytes) -> None:
        parts, offset = [], 0
        while offset < len(content):
            (length,) = _LENGTH.unpack_from(content, offset)
            offset += _LENGTH.size
            parts.append(memoryview(content)[offset : offset + length])
            offset += length
        self._facts, self._found, self._table = parts

    def facts(self) -> dict[str, Any]:
        """Return summary and seconds."""
        facts: dict[str, Any] = json.loads(bytes(self._facts))
        return facts

    def improvements(self) -> dict[str, list[Any]]:
        """Return the columns of the improvements."""
        found: dict[str, list[Any]] = json.loads(bytes(self._found))
        return found

    def evaluations(self) -> pa.Table:
        """Return the rows of the table of evaluations."""
        with pa.ipc.open_stream(self._table) as stream:
            return stream.read_all()


def _packed(table: pa.Table) -> bytes:
    sink = pa.BufferOutputStream()
    options = pa.ipc.IpcWriteOptions(compression="lz4")
    with pa.ipc.new_stream(sink, table.schema, options=options) as stream:
        stream.write_table(table)
    content: bytes = sink.getvalue().to_pybytes()
    return content
