"""The command that shows a result live in the browser."""

from __future__ import annotations

import sys
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from geoprint.cli.ending import wrote
from geoprint.cli.options import OUTPUT
from geoprint.cli.terminal import say

PORT = 8080

ViewedFolder = Annotated[
    Path,
    typer.Argument(
        metavar="FOLDER", help="Folder that `geoprint plan` or `geoprint compare` wrote.", show_default=False
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


def view(
    folder: ViewedFolder,
    *,
    line: Line = None,
    robot: WithRobot = False,
    port: Port = PORT,
    no_open: NoOpen = False,
    still: Still = None,
    record: Film = None,
    html: Page = None,
) -> None:
    """Show a result live: turn it, replay the robot, colour the part, and ask what a point is.

    The page is served to this machine alone, until Ctrl-C.
    """
    from geoprint.viewer.capture import save_film, save_page, save_still
    from geoprint.viewer.live import LiveView
    from geoprint.viewer.loaded import load_viewed

    shown = LiveView(load_viewed(folder), port=port)
    try:
        if line is not None:
            shown.go_to_line(line)
        if robot:
            shown.show_robot()
        for path, save in ((still, save_still), (record, save_film), (html, save_page)):
            if path is not None:
                save(shown, path)
                wrote(path)
        if still or record or html:
            return
        say(f"view: {shown.url} (Ctrl-C ends it)")
        if not no_open and sys.stderr.isatty():
            webbrowser.open(shown.url)
        shown.wait()
    finally:
        shown.close()
