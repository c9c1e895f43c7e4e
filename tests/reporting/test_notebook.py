"""In a notebook results draw themselves: a picture, five figures, and a page that turns without a server."""

from __future__ import annotations

import html
import re
from pathlib import Path

import numpy as np
import pytest

import geoprint
from geoprint.geometry.files import save_ply
from geoprint.reporting.notebook import NotebookView, notebook_html
from geoprint.results import Measurement, Plan
from tests.meshes import spherical_cap
from tests.reporting.browser import Page
from tests.shared_plans import SharedPlans

FIGURES = ["thickness CV", "printed CV", "once", "gap", "overlap"]


@pytest.fixture(scope="module")
def planned(shared_plans: SharedPlans) -> Plan:
    return shared_plans.plan(spherical_cap(rings=6), spacing=3.0, robot=False)


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Measurement:
    """Rows two millimetres apart on a square, under a name that is HTML."""
    folder = tmp_path_factory.mktemp("measured")
    flat = np.array([[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [20.0, 20.0, 0.0], [0.0, 20.0, 0.0]])
    save_ply(geoprint.Surface(flat, np.array([[0, 1, 2], [0, 2, 3]])), folder / "flat.ply")
    rows = [f"{x},{y},0,{y}" for y in range(1, 20, 2) for x in (0, 20)]
    (folder / "<b>rows.csv").write_text("\n".join(["x,y,z,run", *rows]), encoding="utf-8")
    job = geoprint.job_of(surface=folder / "flat.ply", unit="mm", spacing=2.0)
    return geoprint.measure_files(job, [folder / "<b>rows.csv"])


def shown(result: Plan | Measurement) -> tuple[list[str], list[list[str]], str]:
    """Return heads and rows of the table that a notebook shows, and all of it."""
    text = notebook_html(result)
    assert vars(type(result))["_repr_html_"](result) == text
    assert text.count("<img") == text.count('src="data:image/') == 1
    assert "http" not in text
    text = text.replace("&nbsp;", " ")
    heads = re.findall(r'<th scope="col">(.*?)</th>', text)
    rows = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in re.findall(r"<tr>(.*?)</tr>", text)[1:]]
    return heads, rows, text


def frame(view: NotebookView) -> str:
    return view._repr_html_()  # pyright: ignore[reportPrivateUsage]  (what a notebook calls)


def test_a_plan_shows_its_paths_and_five_figures(planned: Plan) -> None:
    heads, ((name, thickness, printed, once, *_),), _ = shown(planned)
    assert heads == ["backend", *FIGURES]
    assert name == "heat"
    assert thickness == f"{100 * planned.evenness.thickness.cv:.2f} %"
    assert once == f"{100 * planned.evenness.covered_once:.2f} %"
    assert re.fullmatch(r"\d+\.\d % \(\d+\.\d-\d+\.\d\)", printed)


def test_a_measurement_shows_a_row_each_file_and_runs_nothing_of_its_name(measured: Measurement) -> None:
    _, rows, text = shown(measured)
    assert [row[0] for row in rows] == ["&lt;b&gt;rows.csv"]
    assert "<b>" not in text
    # Straight rows one spacing apart, half a one from the rim.
    assert rows[0][3:] == ["100.00 %", "0.00 %", "0.00 %"]


def test_the_view_is_the_report_in_a_frame_of_its_own(measured: Measurement) -> None:
    view = measured.view()
    assert view.page.startswith(b"<!DOCTYPE html>")
    (source,) = re.findall(r'<iframe srcdoc="([^"]*)" sandbox="allow-scripts"', frame(view))
    assert html.unescape(source) == view.page.decode("utf-8")


def test_the_view_turns_in_three_dimensions(planned: Plan, browser: Page, tmp_path: Path) -> None:
    notebook = tmp_path / "notebook.html"
    notebook.write_text(f"<!DOCTYPE html><meta charset=utf-8>{frame(planned.view())}", encoding="utf-8")
    browser.resize(width=1000)
    browser.open(notebook)
    browser.driver.switch_to.frame(0)
    browser.wait_until("document.querySelector('.scene').classList.contains('live')")
    browser.driver.switch_to.default_content()
    assert browser.errors() == []
    assert all(address.startswith("file://") for address in browser.requests())
