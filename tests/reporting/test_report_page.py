"""report.html is one file that asks for nothing, escapes everything and says what it was given."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

from geoprint.model import FloatArray
from geoprint.reporting import Picture, html_report
from geoprint.reporting.cautions import said_once
from geoprint.reporting.figures import colour_range
from geoprint.reporting.histogram import BINS, histograms, ratio_axis, spacing_shares
from geoprint.reporting.html import Markup, element, joined, script_data
from geoprint.reporting.scene import MOST_SAMPLES, NOT_A_NUMBER, scene_data
from geoprint.reporting.tables import marked_lines
from tests.reporting.report_cases import backend, circles, dome, part, replay

HOSTILE = "</script><script>window.hacked=1</script><img src=x onerror='window.hacked=2'>\"&%{x}<b>"


class Reader(HTMLParser):
    """Collects elements, and the text that a person sees."""

    def __init__(self, page: bytes) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[str] = []
        self.text = ""
        self._inside = ""
        self.feed(page.decode("utf-8"))
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        self._inside = tag
        if tag == "script":
            self.scripts.append("")

    def handle_endtag(self, tag: str) -> None:  # noqa: ARG002 - the base class says so
        self._inside = ""

    def handle_data(self, data: str) -> None:
        if self._inside == "script":
            self.scripts[-1] += data
        elif self._inside != "style":
            self.text += data.replace("\N{NO-BREAK SPACE}", " ")

    def values(self, name: str) -> list[str]:
        return [value for _, attributes in self.elements if (value := attributes.get(name)) is not None]


@pytest.fixture(scope="module")
def page() -> bytes:
    return html_report([part()], title="A title")


@pytest.fixture(scope="module")
def read(page: bytes) -> Reader:
    return Reader(page)


def test_nothing_in_the_page_refers_outside_it(read: Reader) -> None:
    assert not [tag for tag, _ in read.elements if tag in {"iframe", "object", "embed", "base", "form"}]
    for name in ("src", "href", "srcset", "action", "data"):
        assert all(value.startswith(("data:", "#")) for value in read.values(name))


def test_the_policy_lets_only_the_pages_own_scripts_run(read: Reader) -> None:
    policy = next(value for value in read.values("content") if "default-src" in value)
    assert policy.startswith("default-src 'none'")
    assert "unsafe-inline" not in policy.split("style-src")[0]
    assert "unsafe-eval" not in policy
    code = [script for script in read.scripts if not script.startswith("{")]
    assert len(code) == 2
    for script in code:
        assert base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() in policy


def test_the_page_says_its_language_title_and_width(page: bytes, read: Reader) -> None:
    assert page.startswith(b'<!DOCTYPE html>\n<html lang="en">')
    assert b"<title>A title</title>" in page
    assert "width=device-width, initial-scale=1" in read.values("content")


def test_a_number_and_its_per_cent_stay_in_one_line() -> None:
    assert element("p", "5 % of `a 5 %` < 6 %") == "<p>5&nbsp;% of <code>a 5&nbsp;%</code> &lt; 6&nbsp;%</p>"


def test_the_page_says_what_it_was_given(read: Reader) -> None:
    whole = part()
    given = [*whole.verdict, *whole.cautions, "third", "the surface has no border.", "spacing CV", "0 % is even"]
    given += ["0.200", "0.100", "the chart", "2 mm", 64 * "0", "first, in words", "print time [s]"]
    for text in given:
        assert text in read.text


def test_ids_are_unique_and_every_control_has_a_label() -> None:
    read = Reader(html_report([part(), part("other.ply")], title="Two"))
    names = read.values("id")
    assert len(names) == len(set(names))
    labelled = re.findall(r"<label>[^<]*<(?:input|select)", html_report([part()], title="One").decode())
    assert len(labelled) + 1 == sum(
        tag in {"input", "select"} for tag, _ in Reader(html_report([part()], title="")).elements
    )


def test_several_parts_are_listed_first_with_links() -> None:
    read = Reader(html_report([part("a.ply"), part("b.ply")], title="Two"))
    assert {"#part0", "#part1"} <= set(read.values("href"))
    assert read.text.index("most even") < read.text.index("PLACEMENT")
    assert not Reader(html_report([part("a.ply")], title="One")).values("href")[1:]


def test_hostile_names_stay_text_everywhere() -> None:
    shown = part(HOSTILE, names=(HOSTILE, "second"))
    shown = replace(
        shown, verdict=(HOSTILE,), cautions=(HOSTILE,), refused=((HOSTILE, HOSTILE),), settings=((HOSTILE, HOSTILE),),
        pictures=(Picture(HOSTILE, "svg", f"<svg>{HOSTILE}</svg>".encode()),), overview=((HOSTILE, HOSTILE),),
    )  # fmt: skip
    read = Reader(html_report([shown, shown], title=HOSTILE))
    assert read.text.count(HOSTILE) > 10
    assert len(read.scripts) == 4
    assert not read.values("onerror")
    assert [json.loads(script)["backends"][0]["name"] for script in read.scripts[:2]] == [HOSTILE, HOSTILE]


def test_the_same_input_gives_the_same_bytes(page: bytes) -> None:
    assert html_report([part()], title="A title") == page


def test_the_page_itself_takes_less_than_two_megabytes_and_names_the_licence_of_its_library(page: bytes) -> None:
    assert len(page) < 2e6
    assert b"Licensed under the MIT license" in page


def test_what_decides_is_said_of_each_backend_where_it_is_seen(read: Reader) -> None:
    assert read.values("class").count("view") == 1
    assert read.values("class").count("view best") == 1
    assert read.text.count("spacing CV") == 2 + 2
    assert read.text.count("print time [s]") == 1


def test_the_largest_part_with_three_backends_stays_below_10_megabytes() -> None:
    surface = dome(rings=129)
    assert 99_000 < len(surface.faces) <= 100_000
    places, offsets = circles(list(np.linspace(1.0, 19.0, 99)), points=MOST_SAMPLES // 99)
    noise, png = np.random.default_rng(0).integers(0, 256, size=(500, 500, 3), dtype=np.uint8), io.BytesIO()
    Image.fromarray(noise).save(png, format="png")
    assert len(png.getvalue()) > 700_000
    views = tuple(
        replace(
            backend(name, surface=surface, error=0.1), places=places, offsets=offsets, ratios=np.ones(len(places)),
            widths=np.full(len(places), 0.2),
            replay=replace(
                replay(frames=600), bead=places, bead_offsets=offsets, bead_times=np.linspace(0.0, 40.0, len(places))
            ),
            still=Picture("still", "png", png.getvalue()),
        )
        for name in ("one", "two", "three")
    )  # fmt: skip
    whole = replace(part(surface=surface, names=("one", "two", "three")), backends=views)
    assert len(html_report([whole], title="Large")) < 10e6


def decoded(array: object) -> FloatArray:
    assert isinstance(array, dict)
    values = np.frombuffer(base64.b64decode(str(array["bdata"])), dtype=str(array["dtype"]))  # pyright: ignore[reportUnknownArgumentType]
    if "step" not in array:
        return values
    return np.where(values == NOT_A_NUMBER, np.nan, float(array["low"]) + values * float(array["step"]))  # pyright: ignore[reportUnknownArgumentType]


def test_the_scene_is_upright_and_around_its_middle_wherever_the_part_lies() -> None:
    turn = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    plain = part()
    away = replace(
        plain,
        surface=replace(plain.surface, vertices=plain.surface.vertices @ turn + [1000.0, 200.0, -3000.0]),
        R_view_work=turn,
    )
    here, there = scene_data(plain), scene_data(away)
    assert isinstance(here, dict)
    assert isinstance(there, dict)
    vertices = decoded(here["vertices"]).reshape(3, -1)
    np.testing.assert_allclose(vertices.max(axis=1) + vertices.min(axis=1), 0.0, atol=2e-3)
    np.testing.assert_allclose(decoded(there["vertices"]), decoded(here["vertices"]), atol=2e-3)


def test_paths_break_off_between_stretches_and_long_ones_are_thinned() -> None:
    places, offsets = circles(list(np.linspace(1.0, 19.0, 50)), points=MOST_SAMPLES // 20)
    view = replace(
        backend("long", surface=dome(), error=0.0), places=places, offsets=offsets, ratios=np.ones(len(places)),
        widths=np.full(len(places), 2.0),
    )  # fmt: skip
    data = scene_data(replace(part(names=("long",)), backends=(view,)))
    assert isinstance(data, dict)
    assert isinstance(data["backends"], list)
    assert isinstance(data["backends"][0], dict)
    path = decoded(data["backends"][0]["path"]).reshape(3, -1)
    assert np.isnan(path[0]).sum() == 49
    assert MOST_SAMPLES / 3 < path.shape[1] <= MOST_SAMPLES + 100
    # Every circle is still closed.
    breaks = np.flatnonzero(np.isnan(path[0]))
    np.testing.assert_allclose(path[:, breaks[:-1] + 1], path[:, breaks[1:] - 1], atol=2e-3)
    # The bead of each sample that is drawn is as wide as it was given.
    half = decoded(data["backends"][0]["half"]).reshape(3, -1)
    assert np.array_equal(np.isnan(half[0]), np.isnan(path[0]))
    np.testing.assert_allclose(np.linalg.norm(half[:, ~np.isnan(half[0])], axis=0), 1.0, atol=1e-3)


def test_shares_of_a_histogram_count_what_lies_beyond_its_ends() -> None:
    shares = spacing_shares(np.array([0.05, 0.999, 1.001, 9.0, np.nan]))
    assert shares.size == BINS
    np.testing.assert_allclose(shares[[0, BINS // 2, -1]], [0.25, 0.5, 0.25])
    assert spacing_shares(np.array([np.nan])).sum() == 0.0


def test_markup_is_escaped_once() -> None:
    assert joined("<", Markup("<b>"), "&") == "&lt;<b>&amp;"
    assert element("p", element("i", "a&b"), title='"') == '<p title="&quot;"><i>a&amp;b</i></p>'


def test_commands_that_sentences_quote_are_set_as_such_but_where_an_element_holds_text_alone() -> None:
    assert element("p", "run `a < b` or `c`") == "<p>run <code>a &lt; b</code> or <code>c</code></p>"
    assert element("p", "one ` alone", "`two\nlines`") == "<p>one ` alone`two\nlines`</p>"
    assert element("title", "a `b` & c") == "<title>a `b` &amp; c</title>"
    assert json.loads(script_data({"a": "<!-- & \u2028"})) == {"a": "<!-- & \u2028"}
    assert "<" not in script_data("<!--")


def test_scales_cover_what_is_there_and_even_paths_keep_the_narrow_ones() -> None:
    even, wide = np.linspace(0.95, 1.15, 200), np.append(np.ones(97), [1.6, 1.7, 1.83])
    assert colour_range([even]) == (0.8, 1.2)
    assert ratio_axis([even]).ticks == (0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3)
    # One scale for all that are compared: 0.7 off asks for four times 0.2 and three times 0.305.
    assert colour_range([even, wide]) == (0.2, 1.8)
    assert ratio_axis([even, wide]).ticks == (0.1, 0.4, 0.7, 1.0, 1.3, 1.6, 1.9)
    # A single one of thousands widens nothing, and nothing is no ratio.
    assert colour_range([np.append(np.ones(5000), 9.0), np.array([np.nan])]) == (0.8, 1.2)
    # A scale of ratios ends at 0.
    assert colour_range([np.array([9.0, 1.0])]) == (0.0, 2.0)
    assert "all between 1.000 and 1.830" in histograms([("a", wide)], of="path", axis="x")


# What a person should mind stands in the order of its weight, each thing once and marked by a word.


def test_warnings_come_before_notes_and_what_was_not_checked_is_counted_until_asked_for() -> None:
    def said(*, verbose: bool) -> list[str]:
        return marked_lines(
            warnings=["act", "act", "soon"], notes=["know"], not_checked=["lamp", "cables", "lamp"], verbose=verbose
        )

    first = ["warning: act", "warning: soon", "note: know"]
    assert said(verbose=False) == [*first, "not checked: 2 things; `--verbose` lists them"]
    assert said(verbose=True) == [*first, "not checked: lamp", "not checked: cables"]
    assert marked_lines(not_checked=["lamp"]) == ["not checked: 1 thing; `--verbose` lists them"]
    assert marked_lines() == []


def test_what_holds_for_every_backend_is_said_once_and_the_rest_names_whose_it_is() -> None:
    said = {"heat": ["dry only", "slow"], "lscm": ["dry only"], "other": ["dry only", "slow"]}
    assert said_once(said) == ["dry only", "heat, other: slow"]
    assert said_once({"heat": ["slow"]}) == ["slow"]
