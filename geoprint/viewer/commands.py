"""The command that shows a result live in the browser."""

from __future__ import annotations

import sys
import webbrowser
from collections.abc import Callable, Mapping
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from geoprint.cli.ending import wrote
from geoprint.cli.options import OUTPUT, Keys, job_asked, takes
from geoprint.cli.terminal import say
from geoprint.errors import UsageError
from geoprint.viewer.page import PORT

if TYPE_CHECKING:
    import viser

    from geoprint.viewer.editor import EditView
    from geoprint.viewer.live import LiveView

Shown = Annotated[
    Path,
    typer.Argument(
        metavar="FOLDER|PART",
        help="Folder that `geoprint plan` or `compare` wrote; or a part or a job file (.toml) to draw on.",
        show_default=False,
    ),
]
Line = Annotated[
    int | None,
    typer.Option(metavar="NUMBER", help="Begin at the move on this line of the program.", show_default=False),
]
Port = Annotated[int, typer.Option(metavar="NUMBER", help="Port of the page on this machine; the next one if taken.")]
NoOpen = Annotated[bool, typer.Option("--no-open", help="Print the address instead of opening the browser.")]
Still = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Write a picture (.png) instead, without a window.", rich_help_panel=OUTPUT),
]
Film = Annotated[
    Path | None,
    typer.Option(
        "--record",
        metavar="FILE",
        help="Write a film of the replay (.mp4) instead, without a window.",
        rich_help_panel=OUTPUT,
    ),
]
Page = Annotated[
    Path | None,
    typer.Option(
        "--html",
        metavar="FILE",
        help="Write the scene as one page (.html) that opens offline instead.",
        rich_help_panel=OUTPUT,
    ),
]
WithRobot = Annotated[bool, typer.Option("--robot", help="Show the robot from the start.")]


@takes("unit", "spacing", "label", "cell")
def view(
    shown: Shown,
    *,
    keys: Keys,
    line: Line = None,
    with_robot: WithRobot = False,
    port: Port = PORT,
    no_open: NoOpen = False,
    still: Still = None,
    record: Film = None,
    html: Page = None,
) -> None:
    """Show a result live: turn it, replay the robot, colour the part, and ask what a point is.

    A part is drawn on: where distance begins, outlines, keep-outs and fibres, with paths that follow at once; all of
    it is kept in a job file. The page is served to this machine alone, until Ctrl-C.
    """
    from geoprint.viewer.capture import save_film, save_page, save_still
    from geoprint.viewer.live import LiveView
    from geoprint.viewer.page import address, served

    asked = {"--line": line, "--robot": with_robot, "--record": record}
    opened = _drawing(shown, keys, asked=asked) if shown.is_file() else _replay(shown, keys)
    with served(port, label=f"geoprint: {shown.name}") as server, closing(opened(server)) as page:
        if isinstance(page, LiveView) and line is not None:
            page.go_to_line(line)
        if isinstance(page, LiveView) and with_robot:
            page.show_robot()
        files = {still: partial(save_still, server), html: partial(save_page, server)}
        if isinstance(page, LiveView):
            files[record] = partial(save_film, page)
        named = {path: save for path, save in files.items() if path is not None}
        if named:
            page.complete()
            for path, save in named.items():
                save(path)
                wrote(path)
            return
        say(f"view: {address(server)} (Ctrl-C ends it)")
        if not no_open and sys.stderr.isatty():
            webbrowser.open(address(server))
        page.wait()


def _replay(folder: Path, keys: Keys) -> Callable[[viser.ViserServer], LiveView]:
    """Read a folder, and return what shows it."""
    from geoprint.viewer.live import LiveView
    from geoprint.viewer.loaded import load_viewed

    if keys:
        named = ", ".join(f"`--{name}`" for name in keys)
        raise UsageError(f"{named}: the plan in {folder} has its own; options of a part go with a part or a job file.")
    viewed = load_viewed(folder)
    return lambda server: LiveView(viewed, server)


def _drawing(file: Path, keys: Keys, *, asked: Mapping[str, object]) -> Callable[[viser.ViserServer], EditView]:
    """Read a part or a job, and return what it is drawn on with.

    Raises:
        UsageError: what only a plan has is asked for, or the job file of a part stands there already.
    """
    from geoprint.config import job_cell
    from geoprint.viewer.drawing import Drawing
    from geoprint.viewer.editor import EditView

    motion = [flag for flag, value in asked.items() if value]
    if motion:
        raise UsageError(f"`{motion[0]}` needs the folder of a plan, and {file} is a file: a part has no motion yet.")
    job = job_asked(file, keys)
    if file.suffix.lower() == ".toml":
        return lambda server: EditView(Drawing(job, file), server)
    kept = Path(f"{file.name.partition('.')[0]}.toml")
    if kept.exists():
        raise UsageError(f"{kept} exists, where this drawing is kept: `geoprint view {kept}` goes on with it.")
    if job.spacing is None:
        job = job.model_copy(update={"spacing": job_cell(job).tool.inner_diameter})
    # Of paths alone nobody has to say where the part stands.
    return lambda server: EditView(Drawing(job.model_copy(update={"robot": False}), kept), server)
