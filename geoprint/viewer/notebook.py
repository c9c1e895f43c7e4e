"""The scene of the live view within a notebook."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

from geoprint.reporting.notebook import NotebookView
from geoprint.viewer.loaded import load_viewed


def notebook_scene(folder: Path | str) -> NotebookView:
    """Return the scene that `geoprint view FOLDER` shows first as a page within a notebook, to be turned.

    It needs no server, and so has no panel.

    Args:
        folder: that `geoprint plan` or `compare` wrote.

    Raises:
        GeoprintError: as `load_viewed`; `UsageError` where viser is not installed.
    """
    from geoprint.viewer.live import LiveView
    from geoprint.viewer.page import PORT, served

    viewed = load_viewed(folder)
    with served(PORT, label=viewed.name) as server, closing(LiveView(viewed, server)) as view:
        view.complete()
        return NotebookView(server.scene.as_html().encode())
