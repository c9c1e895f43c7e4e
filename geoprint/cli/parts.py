"""Commands about files: inspect a part, cut a patch from it, remesh it, check a bundle."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from geoprint.cli.bounds import (
    CHECKING,
    COMPARING,
    CUTTING,
    EXAMINING,
    READING,
    SMOOTHING,
    TRIAL,
    TRIANGULATING,
    limit_memory,
    planning_stages,
    watch,
)
from geoprint.cli.ending import error_object, wrote
from geoprint.cli.options import AsJson, Keys, MaxMemory, Overwrite, Part, PartOrJob, job_asked, takes
from geoprint.cli.terminal import columns, print_json, result, say, show
from geoprint.config.job import Job
from geoprint.errors import UsageError, VerificationError, how_many


@takes()
def inspect(
    surface: Part,
    *,
    unit: str | None = None,
    label: int | None = None,
    threshold: float | None = None,
    fill_holes: float | None = None,
    picture: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the findings into this PNG file.")] = None,
    max_memory: MaxMemory = None,
    as_json: AsJson = False,
) -> None:
    """Say what a mesh is, what is wrong with it, what preparing changes, where to plan on it, and with which backends.

    Of a label volume it lists the labels.
    """
    from geoprint.distance import backend_names
    from geoprint.reporting import inspection_summary, inspection_text
    from geoprint.results import VolumeInspection
    from geoprint.workflow import inspect_file

    limit_memory(max_memory)
    with watch(expected=[READING, EXAMINING, *[TRIAL] * len(backend_names())]) as observe:
        seen = inspect_file(
            surface, unit=unit, label=label, threshold=threshold, longest_hole=fill_holes, observe=observe
        )
    if picture is not None:
        if isinstance(seen, VolumeInspection):
            raise UsageError(f"{seen.name} gives no surface to draw; choose a label that does with `--label N`.")
        from geoprint.geometry.files import write_whole
        from geoprint.reporting import inspection_figure

        write_whole(picture, inspection_figure(seen.found, title=seen.name, landmarks=seen.landmarks))
    result(inspection_text(seen), lambda: inspection_summary(seen), as_json=as_json)


@takes("unit", "label", "threshold", "patches", rare=True)
def patch(
    body: PartOrJob,
    *,
    out: Annotated[Path, typer.Option(metavar="FILE", help="PLY file for the patch, in mm.", show_default=False)],
    keys: Keys,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Cut a patch out of a body, through its triangles, so that its rim is smooth; several of a job are numbered."""
    from geoprint.geometry.files import load_file, save_ply
    from geoprint.reporting import patch_summary, patch_text
    from geoprint.workflow import patches_of

    job = job_asked(body, keys)
    if not job.patches:
        raise UsageError("say where the patch lies: `--at X Y Z --radius R`, `--box`, `--curve` or `--region`.")
    several = len(job.patches) > 1
    paths = [out.with_stem(f"{out.stem}-{number}") if several else out for number in range(1, len(job.patches) + 1)]
    for path in paths:
        _check_ply(path, overwrite=overwrite)
    with watch(READING, expected=[READING, *[CUTTING] * len(job.patches)]) as observe:
        loaded = load_file(job.surface, unit=job.unit, label=job.label, threshold=job.threshold)
        cut = patches_of(job, loaded, observe=observe)
    for number, (one, path) in enumerate(zip(cut, paths, strict=True), start=1):
        save_ply(one.surface, path)
        if not as_json:
            show(f"{f'{number}: ' if several else ''}{patch_text(one)}")
        wrote(path)
    if as_json:
        print_json([patch_summary(one) for one in cut] if several else patch_summary(cut[0]))


@takes()
def remesh(
    surface: Part,
    *,
    out: Annotated[Path, typer.Option(metavar="FILE", help="PLY file for the new mesh, in mm.", show_default=False)],
    unit: str | None = None,
    label: int | None = None,
    thin: Annotated[
        bool,
        typer.Option("--thin", help="Take a label that is as thin as its voxels with their terraces, for `--smooth`."),
    ] = False,
    threshold: float | None = None,
    edge_length: Annotated[
        float | None,
        typer.Option(metavar="MM", help="Give it even triangles with edges of about so many mm, finer or coarser."),
    ] = None,
    faces: Annotated[
        int | None,
        typer.Option(metavar="N", help="Instead: take triangles away down to so many, where it changes least."),
    ] = None,
    smooth: Annotated[
        float | None,
        typer.Option(metavar="MM", help="First take away noise and ripples shorter than so many mm; holds creases."),
    ] = None,
    max_deviation: Annotated[
        float | None,
        typer.Option(
            metavar="MM", help="Refuse a result farther off than so many mm; by default 1/500 of the part's diagonal."
        ),
    ] = None,
    max_memory: MaxMemory = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Write the same part with another mesh, smoother, more even or smaller, and say how far the two lie apart."""
    from geoprint.geometry.files import save_ply
    from geoprint.reporting import remeshing_summary, remeshing_text
    from geoprint.workflow import remesh_file

    limit_memory(max_memory)
    _check_ply(out, overwrite=overwrite)
    steps = [SMOOTHING] * (smooth is not None) + [TRIANGULATING] * (edge_length is not None or faces is not None)
    with watch(expected=[READING, *steps, COMPARING]) as observe:
        found = remesh_file(
            surface, unit=unit, label=label, thin=thin, threshold=threshold, wavelength=smooth,
            edge_length=edge_length, faces=faces, max_deviation=max_deviation, observe=observe,
        )  # fmt: skip
    save_ply(found.after, out)
    result(remeshing_text(found), lambda: remeshing_summary(found), as_json=as_json)
    wrote(out)


def check(
    bundle: Annotated[Path, typer.Argument(help="Folder that `geoprint plan` or `compare` wrote.", show_default=False)],
    *,
    full: Annotated[
        bool, typer.Option("--full", help="Also repeat the collision check, and measure evenness again.")
    ] = False,
    record: Annotated[
        str | None,
        typer.Option(
            metavar="loaded|dry|printed",
            help="Record what you saw its program do: loaded (on a virtual controller), dry or printed.",
        ),
    ] = None,
    note: Annotated[str, typer.Option(metavar="TEXT", help="With `--record`: what you saw, in your words.")] = "",
    controller: Annotated[
        str | None, typer.Option(metavar="TEXT", help="With `--record`: the controller's name and RobotWare release.")
    ] = None,
    max_memory: MaxMemory = None,
    as_json: AsJson = False,
) -> None:
    """Read a bundle back, whoever has edited it since, compare it with its plan and print the run sheet."""
    from geoprint.reporting import also_seen, check_summary, check_text
    from geoprint.workflow import check_folder, record_seen

    if record is None and (note or controller):
        raise UsageError("`--note` and `--controller` belong to what you saw: add `--record loaded`, dry or printed.")
    limit_memory(max_memory)
    with watch(CHECKING, expected=[CHECKING, *planning_stages([Job(surface=bundle)])] if full else []) as observe:
        checked = check_folder(bundle, full=full, observe=observe)
    if record is not None:
        checked = also_seen(checked, record_seen(checked, record, note=note, controller=controller))
    found = VerificationError(
        f"{bundle} is not the plan that was made: {how_many(len(checked.findings), 'finding')}, listed above. Do not "
        "run its program; write it again with `geoprint plan`."
    )
    result(
        check_text(checked, width=columns()),
        lambda: check_summary(checked) | (error_object(found, found.exit_status) if checked.findings else {}),
        as_json=as_json,
    )
    if checked.findings:
        say(f"geoprint: {found}")
        raise typer.Exit(found.exit_status)


def _check_ply(out: Path, *, overwrite: bool) -> None:
    """Refuse a name for a result that is taken, or not that of a PLY file."""
    if out.exists() and not overwrite:
        raise UsageError(f"{out} exists; choose another name, or replace it with --overwrite.")
    if out.suffix.lower() != ".ply":
        raise UsageError(f"the result is written as PLY, but `{out.name}` ends otherwise; name it `{out.stem}.ply`.")
