"""Commands that plan: demo, plan, compare, place."""

from __future__ import annotations

import os
import sys
import webbrowser
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Annotated

import typer

from geoprint.cli.bounds import COVERING, PREPARING, SEARCH, WITH_ROBOT, limit_memory, planning_stages, watch
from geoprint.cli.ending import wrote
from geoprint.cli.options import (
    SETTINGS,
    AsJson,
    ComparedBackends,
    Figures,
    Keys,
    MaxMemory,
    OnCells,
    Out,
    Overwrite,
    PartOrJob,
    PartOrJobOrNone,
    PartsOrJobs,
    Samples,
    Verbose,
    backends_of,
    job_asked,
    settings_of,
    takes,
)
from geoprint.cli.terminal import columns, result, say
from geoprint.config.job import Job
from geoprint.config.strict import key_at
from geoprint.errors import UsageError

# Backends are compared with the robot in two processes: each takes up to a gigabyte. Without it all is done before
# another process has started.
PROCESSES = 2
# What the demonstration plans: in a checkout a link to its file in data/, which stands in the wheel as a file.
DEMO_PART, DEMO_FOLDER = "heart_apex_patch.ply", Path("geoprint-demo")


def demo() -> None:
    """Compare both ways of planning on the tip of a heart and open the report: `geoprint compare`, nothing to give.

    The result stands in ./geoprint-demo and replaces that of an earlier demonstration alone.
    """
    from geoprint.cli.application import run

    with resources.as_file(resources.files("geoprint.cli") / DEMO_PART) as part:
        placed = ["--unit", "mm", "--spacing", "1", "--place", "demo"]
        run(["compare", str(part), *placed, "--out", str(DEMO_FOLDER), "--overwrite"])
    report = DEMO_FOLDER.resolve() / "report.html"
    if not _opened(report):
        say(f"open in a browser: {report}")
    say("your own part: `geoprint guide your-part`; all pages: `geoprint guide`")


def _opened(page: Path) -> bool:
    """Open a page in a browser where somebody sits before one, and say whether that was possible."""
    windows = sys.platform in {"darwin", "win32"} or any(os.environ.get(key) for key in ("DISPLAY", "WAYLAND_DISPLAY"))
    return sys.stderr.isatty() and windows and webbrowser.open(page.as_uri())


@takes()
def plan(
    surface: PartOrJobOrNone = None,
    *,
    keys: Keys,
    out: Out = None,
    max_memory: MaxMemory = None,
    overwrite: Overwrite = False,
    verbose: Verbose = False,
    as_json: AsJson = False,
) -> None:
    """Plan one part with one backend and write the program, the tables, plan.json and report.html."""
    source = keys.get("source")
    again = source if isinstance(source, Path) else None
    if (surface is None) is (again is None):
        raise UsageError("give a part or a job file, or `--from` a bundle that shall be planned again: one of them.")
    # Before the imports, which take longer than all else until a part is read: what is mistyped is named at once.
    asked = None if surface is None else job_asked(surface, keys)
    from geoprint.postprocessor import check_writable
    from geoprint.reporting import as_json as json_of, outcome_text, record_timings, replanned_text
    from geoprint.reporting.prints import next_appraisal
    from geoprint.workflow import best_placed, job_file_of, plan as run, precompiled, save_plan, written_bundle

    bundle = None if again is None else written_bundle(again)
    changed = {name: value for name, value in keys.items() if name != "source"}
    job = asked or job_asked(job_file_of(again or Path()), changed)
    limit_memory(max_memory)
    out = _stated([job], out, command="plan")
    check_writable(out, overwrite=overwrite)
    if job.divided:
        _plan_in_turn([job], out, overwrite=overwrite, verbose=verbose, as_json=as_json)
        return
    with watch(expected=planning_stages([job])) as observe, precompiled():
        planned = run(best_placed(job, observe=observe), observe=observe)
        observe("writing")
        record = save_plan(planned, out, overwrite=overwrite, report=True)
    text = outcome_text(record, verbose=verbose)
    result(text, lambda: json_of(record) | json_of(record_timings(planned)), as_json=as_json)
    wrote(out, "written and verified")
    if bundle is not None:
        differing = bundle.differing(out)
        say(replanned_text(str(bundle.folder), written_by=bundle.version, differing=differing, changed=_named(changed)))
    if record.feedback is not None:
        say(next_appraisal(str(out)))


def _stated(jobs: Sequence[Job], out: Path | None, *, command: str) -> Path:
    """Return the folder of a result, once nothing that jobs leave open is missing.

    Raises:
        UsageError: something is; one sentence names all of it.
        InputError: a part cannot be planned on anyhow.
    """
    from geoprint.workflow import check_stated

    proposed = Path(f"{jobs[0].surface.stem}-{command}")
    with watch("reading"):
        for job in jobs:
            check_stated(job, proposed_folder=None if out is not None else str(proposed))
    return out or proposed


def _named(keys: Keys) -> list[str]:
    """Return the names of keys that were given, those of `--set` too."""
    return [*(name for name in keys if name != SETTINGS), *(key_at(place) for place, _ in settings_of(keys))]


@takes(but=("backend", "feedback"))
def compare(
    surfaces: PartsOrJobs,
    *,
    backends: ComparedBackends = None,
    cells: OnCells = None,
    keys: Keys,
    out: Out = None,
    max_memory: MaxMemory = None,
    samples: Samples = False,
    figures: Figures = False,
    overwrite: Overwrite = False,
    verbose: Verbose = False,
    as_json: AsJson = False,
) -> None:
    """Plan parts with several backends and show which covers them more evenly, and whether they can be printed."""
    jobs = [job_asked(surface, keys) for surface in surfaces]
    from geoprint.distance import compared_backends
    from geoprint.postprocessor import check_writable
    from geoprint.reporting import as_json as json_of, comparison_table
    from geoprint.workflow import beside, best_placed, compare_parts, precompiled, save_comparisons

    limit_memory(max_memory)
    if cells is not None:
        _compare_cells(jobs, out, cells=cells, backends=backends_of(backends), overwrite=overwrite, as_json=as_json)
        return
    out = _stated(jobs, out, command="compare")
    check_writable(out, overwrite=overwrite)
    if any(job.divided for job in jobs):
        if samples or figures:
            raise UsageError("`--samples` and `--figures` are of single layers: name one with `--layer`.")
        compared = backends_of(backends) or compared_backends()
        _plan_in_turn(jobs, out, compared=compared, overwrite=overwrite, verbose=verbose, as_json=as_json)
        return
    names = backends_of(backends)
    expected = planning_stages(jobs, backends=-(-len(names or compared_backends()) // PROCESSES))
    helpers = PROCESSES - 1 if any(job.robot for job in jobs) else 0
    with watch(expected=expected) as observe, precompiled(), beside(helpers) as helper:
        jobs = [best_placed(job, observe=observe) for job in jobs]
        compared = compare_parts(jobs, backends=names, observe=observe, helper=helper)
        observe("writing")
        record = save_comparisons(compared, out, samples=samples, figures=figures, overwrite=overwrite, helper=helper)
    text = comparison_table(record, width=columns(), verbose=verbose)
    result(text, lambda: json_of(record.record), as_json=as_json)
    wrote(out, "written and verified")


def _compare_cells(
    jobs: list[Job], out: Path | None, *, cells: str, backends: list[str] | None, overwrite: bool, as_json: bool
) -> None:
    """Compare cells over one part, with one backend."""
    from geoprint.postprocessor import check_writable
    from geoprint.reporting import as_json as json_of
    from geoprint.reporting.cell_comparison import cells_text, record_cells
    from geoprint.workflow import precompiled, save
    from geoprint.workflow.backend_choice import with_backend
    from geoprint.workflow.cell_comparison import compare_cells

    paths = [Path(name) for name in cells.split(",") if name]
    if len(jobs) > 1 or len(backends or [""]) > 1 or not paths or jobs[0].cell is not None:
        raise UsageError(
            "`--cells` compares one part with one backend on the cells that it names: give one part, one `--backend` "
            "at most, and no `--cell`."
        )
    job = jobs[0] if backends is None else with_backend(jobs[0], backends[0])
    out = _stated([job.model_copy(update={"cell": paths[0]})], out, command="cells")
    check_writable(out, overwrite=overwrite)
    with watch() as observe, precompiled():
        found = compare_cells(job, paths, observe=observe)
        observe("writing")
        save(found, out, overwrite=overwrite)
    record = record_cells(found)
    result(cells_text(record, width=columns()), lambda: json_of(record), as_json=as_json)
    wrote(out, "written and verified")


def _plan_in_turn(
    jobs: Sequence[Job], out: Path, *, compared: Sequence[str] = (), overwrite: bool, verbose: bool, as_json: bool
) -> None:
    """Plan all that a job prints in turn, with its backend or with those that are compared."""
    from geoprint.reporting import as_json as json_of
    from geoprint.reporting.divisions import division_of
    from geoprint.workflow import best_placed

    if len(jobs) > 1:
        raise UsageError(
            f"whole stacks are compared over one part at a time, {len(jobs)} are given: compare them one by one, or "
            "one `--layer` of all."
        )
    division = division_of(jobs[0])
    assert division is not None  # noqa: S101  # The job is of several workpieces.
    with watch() as observe:
        placed = best_placed(jobs[0], observe=observe)
        record = division.plan(placed, out, compared=compared, overwrite=overwrite, observe=observe)
    text = division.text(record, width=columns(), verbose=verbose)
    result(text, lambda: json_of(record), as_json=as_json)
    wrote(out, "written and verified")


@takes(but=("place", "robot", "feedback"))
def place(
    surface: PartOrJob,
    *,
    keys: Keys,
    height: Annotated[
        float | None, typer.Option(metavar="MM", help="Height of the part's centroid; any if not given.")
    ] = None,
    tilt: Annotated[float, typer.Option(metavar="DEG", help="How far from upright the part may be tilted.")] = 0.0,
    verbose: Verbose = False,
    as_json: AsJson = False,
) -> None:
    """Look for the place at which the arm prints a part farthest from its limits; writes nothing."""
    from geoprint.reporting import proposal_summary, proposal_text
    from geoprint.workflow import propose_placement

    job = job_asked(surface, {**keys, "place": "demo"})
    with watch(expected=[*PREPARING, *COVERING, SEARCH, *WITH_ROBOT]) as observe:
        proposal = propose_placement(job, height=height, tilt_deg=tilt, observe=observe)
    result(proposal_text(proposal, verbose=verbose), lambda: proposal_summary(proposal), as_json=as_json)
