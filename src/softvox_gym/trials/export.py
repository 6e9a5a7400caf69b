"""Export of trials to JSON Lines and Parquet; the same bytes for the same trials."""

from __future__ import annotations

import io
import json
from collections.abc import Iterable
from typing import Any

from softvox_gym.trials.trial import KEYS, PROVENANCE, PROVENANCE_NUMBERS, Trial

#: The columns of a point of a track.
TRACK = ("cycle", "x_cm", "y_cm")


def as_json_lines(trials: Iterable[Trial]) -> bytes:
    """Return one line of JSON per trial: its digest, then everything in its file."""
    lines = (json.dumps(_record(trial), ensure_ascii=False) for trial in trials)
    return "".join(f"{line}\n" for line in lines).encode()


def as_parquet(trials: Iterable[Trial]) -> bytes:
    """Return a table with one row per trial, as in JSON Lines; ImportError without pyarrow.

    The lists cycle, x_cm and y_cm replace the track.
    """
    import pyarrow as pa
    from pyarrow import parquet

    rows = []
    for trial in trials:
        row = _record(trial)
        columns = zip(*row.pop("track"), strict=True)
        rows.append({**row, **dict(zip(TRACK, map(list, columns), strict=True))})
    number, whole = pa.float64(), pa.int32()
    types = {
        **dict.fromkeys(("version", "phases", "repetition"), whole),
        **dict.fromkeys(("pressure_kpa", "frequency_hz", "cycles", "voxel_cm"), number),
        **dict.fromkeys(TRACK, pa.list_(number)),
        "shape": pa.list_(whole),
        "provenance": pa.struct(
            [(name, number if name in PROVENANCE_NUMBERS else pa.string()) for name in PROVENANCE]
        ),
    }
    names = ["digest", *KEYS[:-1], *TRACK]
    schema = pa.schema([(name, types.get(name, pa.string())) for name in names])
    content = io.BytesIO()
    parquet.write_table(pa.Table.from_pylist(rows, schema=schema), content, compression="zstd")
    return content.getvalue()


def _record(trial: Trial) -> dict[str, Any]:
    return {"digest": trial.digest, **trial.facts, "track": trial.track}
