"""softvox trials check, merge, list and export: the folder of trials itself."""

from __future__ import annotations

import json
import math
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from softvox_gym.cli.reality import plain
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.cli.trials import (
    add_filters,
    add_folders,
    add_into,
    chosen,
    folders_of,
    read_chosen,
)
from softvox_gym.design import called
from softvox_gym.files import check_file, write_file
from softvox_gym.landscapes.section import Column, Section, counted
from softvox_gym.missing import missing
from softvox_gym.real_tracks import heading
from softvox_gym.trials.database import check, merge, read
from softvox_gym.trials.export import as_json_lines, as_parquet
from softvox_gym.trials.trial import Trial

CHECK = """\
List all faults in folders of trials, and between the folders, a line for each
(docs/trials-database.md). A warning is a line about something that may be
right. If there is a fault, the exit status is 1.
"""

MERGE = """\
Copy the trials of some folders into another. If two trials describe the same
run differently, both files are named and nothing is written. After an
interruption, the same command copies what is missing.
"""

LIST = """\
List trials. source is "measured", or the reality in which the trial was
simulated; distance is in voxel widths, heading in degrees from +x towards +y.
--json prints everything in the files but the tracks.
"""

EXPORT = """\
Write trials into one file for other tools: JSON Lines (.jsonl), with an object
per trial, or Parquet (.parquet, needs pyarrow), with a row per trial and its
track as lists. The same trials give the same bytes.
"""

#: Writers by the ending of the file.
FORMS = {".jsonl": as_json_lines, ".parquet": as_parquet}

#: The most characters of a text to show.
WIDE = 20


def add_parser(commands: Any) -> None:
    """Add the subcommands."""
    parser = commands.add_parser(
        "check",
        help="list all faults in folders of trials",
        description=CHECK,
        usage="softvox trials check [DIR ...] [--shipped]",
    )
    add_folders(parser)
    parser.set_defaults(run=run_check, parser=parser)

    parser = commands.add_parser(
        "merge",
        help="copy trials into another folder",
        description=MERGE,
        usage="softvox trials merge FROM ... [--into DIR]",
    )
    parser.add_argument("folders", type=Path, nargs="+", metavar="FROM", help="folders of trials")
    add_into(parser)
    parser.set_defaults(run=run_merge, parser=parser)

    parser = commands.add_parser(
        "list",
        help="list trials",
        description=LIST,
        usage="softvox trials list [DIR ...] [options]",
    )
    add_folders(parser)
    add_filters(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(run=run_list, parser=parser)

    parser = commands.add_parser(
        "export",
        help="write trials as Parquet or JSON Lines",
        description=EXPORT,
        usage="softvox trials export [DIR ...] --out FILE [options]",
    )
    add_folders(parser)
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="FILE",
        help=f"file to write; must end in {' or '.join(FORMS)}",
    )
    parser.add_argument("--force", action="store_true", help="replace FILE where it exists")
    add_filters(parser)
    parser.set_defaults(run=run_export, parser=parser)


def run_check(args: Namespace) -> int:
    """Print a line per fault, and the number of trials."""
    with bad_input():
        trials, faults, doubts = check(*folders_of(args))
    for line in (*faults, *(f"warning: {line}" for line in doubts)):
        print(line)
    print(f"{_told(trials)}, {counted(len(faults), 'fault')}, {counted(len(doubts), 'warning')}")
    return int(bool(faults))


def run_merge(args: Namespace) -> int:
    """Copy new trials, and print how many."""
    with bad_input():
        added = merge(args.into, *args.folders)
    known = f", {counted(len(added.known), 'known one')} left alone" if added.known else ""
    print(f"{counted(len(added.new), 'trial')} copied into {args.into}{known}")
    return 0


def run_list(args: Namespace) -> int:
    """Print the table."""
    with bad_input():
        every = read(*folders_of(args))
    trials = chosen(every, args)
    if args.json:
        print(json.dumps([_record(trial) for trial in trials], indent=2, ensure_ascii=False))
    elif trials:
        print(table_of(trials).text())
    else:
        print(f"none of {_told(every)}" if every else "no trials; softvox trials add adds some")
    return 0


def run_export(args: Namespace) -> int:
    """Write the file."""
    if args.out.suffix not in FORMS:
        raise BadInputError(f"--out {args.out} must end in {' or '.join(FORMS)}")
    with bad_input("--out"):
        check_file(args.out, force=args.force)
    trials = read_chosen(args)
    try:
        content = FORMS[args.out.suffix](trials)
    except ModuleNotFoundError as error:
        raise BadInputError(missing("--out FILE.parquet", error)) from error
    with bad_input("--out"):
        write_file(args.out, content, force=args.force)
    print(f"wrote {args.out}: {_told(trials)}")
    return 0


def table_of(trials: Sequence[Trial]) -> Section:
    """Return the table of trials."""
    columns = (
        *(Column("digest", "digest"), Column("design", "design"), Column("source", "source")),
        *(Column("surface", "surface"), Column("powder", "powder")),
        *(Column("cycles", "cycles", ".4g"), Column("frequency_hz", "Hz", ".4g")),
        *(Column("distance", "distance", ".2f"), Column("heading", "heading", ".0f")),
        *(Column("repetition", "rep."), Column("date", "date"), Column("who", "who")),
        Column("license", "licence"),
    )
    rows = []
    for trial in trials:
        facts = _record(trial)
        facts["digest"] = trial.digest[:8]
        facts["source"] = trial.reality or "measured"
        texts = {key: _short(value) for key, value in facts.items() if isinstance(value, str)}
        rows.append(tuple((facts | texts)[column.key] for column in columns))
    return Section(columns=columns, rows=rows, facts={"n": _told(trials)}, sentence="{n}")


def _record(trial: Trial) -> dict[str, Any]:
    """Return the content of a trial's file, with only the end of its track."""
    return {
        **{"digest": trial.digest, **trial.facts},
        **{"design": called(trial.design), "digits": trial.design.digits},
        "distance": math.hypot(*trial.displacement),
        "heading": plain(heading(trial.displacement)),
    }


def _short(text: str) -> str | None:
    return (text if len(text) <= WIDE else f"{text[: WIDE - 3]}...") or None


def _told(trials: Sequence[Trial]) -> str:
    measured = sum(trial.source == "measured" for trial in trials)
    kinds = f"{measured} measured, {len(trials) - measured} simulated"
    return counted(len(trials), "trial") + (f" ({kinds})" if trials else "")
