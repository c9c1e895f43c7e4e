"""The commands that run a study and that tell results apart."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from geoprint.cli.bounds import watch
from geoprint.cli.ending import wrote
from geoprint.cli.options import OUTPUT, AsJson, MaxMemory
from geoprint.cli.terminal import result, say
from geoprint.errors import UsageError, how_many

StudyArgument = Annotated[
    Path,
    typer.Argument(metavar="STUDY", help="Study file (.toml); `geoprint guide sweep` shows one.", show_default=False),
]
_RESULT = "Folder of a plan, a comparison or a study."
FirstResult = Annotated[Path, typer.Argument(metavar="FIRST", help=_RESULT, show_default=False)]
SecondResult = Annotated[Path, typer.Argument(metavar="SECOND", help=_RESULT, show_default=False)]
OutFolder = Annotated[
    Path | None,
    typer.Option(metavar="FOLDER", help="Folder for the cells; required.", show_default=False, rich_help_panel=OUTPUT),
]
Shard = Annotated[
    str | None,
    typer.Option(metavar="K/N", help="Plan every N-th cell, from the K-th on, and nothing else.", show_default=False),
]
Workers = Annotated[
    int | None,
    typer.Option(
        min=1, metavar="N", help="Processes on this machine; by default one for each processor.", show_default=False
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS", help="Scheduler of dask.distributed, whose workers plan instead.", show_default=False
    ),
]
MaxTime = Annotated[
    float | None,
    typer.Option(
        min=1.0, metavar="S", help="End a cell that takes longer.", show_default=False, rich_help_panel=OUTPUT
    ),
]
Retry = Annotated[bool, typer.Option("--retry", help="Plan cells again that were refused or failed.")]


def sweep(
    study: StudyArgument,
    *,
    out: OutFolder = None,
    shard: Shard = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    max_time: MaxTime = None,
    max_memory: MaxMemory = None,
    retry: Retry = False,
) -> None:
    """Plan every part of a study in every way, each into a folder of its own, and write one table and one page of all.

    What stands in the folder already is not planned again: a study that was stopped goes on where it was.
    """
    from geoprint.sweep.report import save_study_page, save_study_table
    from geoprint.sweep.running import Limits, outcomes, run_study
    from geoprint.sweep.study import read_study

    if out is None:
        raise UsageError(f"`--out` is missing: name a folder for the cells, as `--out {study.stem}`.")
    if scheduler is not None and (workers or max_time or max_memory):
        raise UsageError(
            "`--workers`, `--max-time` and `--max-memory` are of this machine: omit them, or `--scheduler`."
        )
    asked = read_study(study)
    cells = asked.cells if shard is None else asked.shard(*_shard(shard))
    with watch() as observe:
        run_study(
            asked, out, cells=cells, workers=workers, limits=Limits(max_time, max_memory), scheduler=scheduler,
            retry=retry, observe=observe,
        )  # fmt: skip
    if shard is not None:
        say(f"{how_many(len(cells), 'cell')} of {len(asked.cells)} planned; the table comes without `--shard`.")
        return
    found = list(outcomes(asked, out))
    counts = Counter(outcome.status for outcome in found)
    say(", ".join(f"{count} {status}" for status, count in sorted(counts.items())))
    wrote(save_study_table(found, out))
    wrote(save_study_page(found, out, name=study.name))


def diff(first: FirstResult, second: SecondResult, *, as_json: AsJson = False) -> None:
    """Say what differs between two plans, comparisons or studies: settings, figures, and how far paths lie apart."""
    from geoprint.reporting import as_json as json_of
    from geoprint.sweep.difference import difference, difference_text

    found = difference(first, second)
    result(difference_text(found), lambda: json_of(found), as_json=as_json)


def _shard(text: str) -> tuple[int, int]:
    """Return number and count of a share.

    Raises:
        UsageError: it is none.
    """
    match = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text)
    if match is None or not 1 <= int(match[1]) <= int(match[2]):
        raise UsageError(f"`--shard {text}`: give a share as 3/200, the third of 200, counted from 1.")
    return int(match[1]), int(match[2])
