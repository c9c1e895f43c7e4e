"""HTML that is escaped by construction, and the blocks of pages that comparisons and stacks share."""

from __future__ import annotations

import base64
import html
import io
import json
import platform
import re
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from typing import TypeAlias, final

from geoprint.errors import InputError, how_many
from geoprint.model import frozen
from geoprint.reporting.values import PathDistances, Picture

# HTML that is escaped by construction: text becomes markup only through `element`.


# What can be put into JSON; arrays are encoded before.
Json: TypeAlias = "dict[str, Json] | list[Json] | str | int | float | bool | None"

# Packages whose version changes figures.
PACKAGES = (
    "geoprint", "numpy", "scipy", "numba", "trimesh", "pin", "toppra", "python-fcl", "scikit-image", "pydantic",
    "matplotlib",
)  # fmt: skip
VOID_TAGS = frozenset({"img", "input", "meta", "br"})
# Elements that hold text and no others.
TEXT_TAGS = frozenset({"title", "option", "style", "script"})
# What sentences quote of a command line.
_QUOTED, _CODE = re.compile(r"`([^`\n]+)`"), r"<code>\1</code>"


@final
class Markup(str):
    """Text that is HTML already and is not escaped again."""

    __slots__ = ()


def element(tag: str, *children: str, **attributes: str | int | bool) -> Markup:
    """Return an element; plain text among its children and all attribute values are escaped, `commands` set as such.

    Args:
        tag: its name.
        *children: text, or markup, which stays as it is.
        **attributes: a trailing underscore is dropped and others become dashes; True stands alone, False is left out.

    Returns:
        The element.

    Examples:
        >>> element("p", "2 < 3 ", element("b", "so"), class_="note", hidden=True)
        '<p class="note" hidden>2 &lt; 3 <b>so</b></p>'
    """
    words = [tag]
    for name, value in attributes.items():
        key = name.rstrip("_").replace("_", "-")
        if value is True:
            words.append(key)
        elif value is not False:
            words.append(f'{key}="{html.escape(str(value))}"')
    if tag in VOID_TAGS:
        return Markup(f"<{' '.join(words)}>")
    content = "".join(map(_escaped, children)) if tag in TEXT_TAGS else joined(*children)
    return Markup(f"<{' '.join(words)}>{content}</{tag}>")


def joined(*pieces: str) -> Markup:
    """Return pieces one after the other, plain text escaped, `commands` in it set as such, and 5 % in one line."""
    return Markup("".join(p if isinstance(p, Markup) else _QUOTED.sub(_CODE, _unbroken(p)) for p in pieces))


def _unbroken(text: str) -> str:
    return html.escape(text).replace(" %", "&nbsp;%")


def _escaped(piece: str) -> str:
    return piece if isinstance(piece, Markup) else html.escape(piece)


def script_data(value: Json) -> Markup:
    r"""Return JSON that can stand inside a script element whatever its strings hold.

    Examples:
        >>> script_data({"name": "</script>"})
        '{"name":"\\u003c/script\\u003e"}'
    """
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


# Blocks of the page as HTML that comparisons and stacks share: views, choices, pictures, facts and what is said.


MEDIA = {"webp": "image/webp", "svg": "image/svg+xml"}
# Of pictures in the page, in 100: lines stay crisp at a fifth of the size of a PNG.
PICTURE_QUALITY = 85


@final
@frozen
class Document:
    """What a page says of one part, in the order that every page has.

    Attributes:
        name: of the part, or of what else the page is on.
        verdict: sentences in plain words; the first one decides and is set large.
        cautions: what nobody may overlook: what was not checked, a placement that is not calibrated.
        shown: right below the first sentence: a scene, and what decides.
        blocks: heading and content of what stands further below; one without a heading goes on with what is above it.
        settings: (name, value), as asked for.
        inputs: (file, SHA-256).
    """

    name: str
    verdict: tuple[str, ...]
    cautions: tuple[str, ...]
    blocks: tuple[tuple[str, Markup], ...]
    settings: tuple[tuple[str, str], ...]
    inputs: tuple[tuple[str, str], ...]
    shown: Markup = Markup("")

    def __post_init__(self) -> None:
        if not self.verdict:
            raise InputError(f"the page of {self.name} needs a verdict.")

    def section(self, *, key: str, heading: str = "") -> Markup:
        """Return it as a section of a page.

        Args:
            key: makes the ids in the page unique.
            heading: stands above it; empty where the page's title says it already.
        """
        head = "h3" if heading else "h2"
        return element(
            "section",
            element("h2", heading) if heading else Markup(""),
            element("p", self.verdict[0], class_="verdict"),
            self.shown,
            said(self.verdict[1:], self.cautions),
            *(joined(element(head, title) if title else Markup(""), block) for title, block in self.blocks),
            how_made(self.settings, self.inputs, heading=head),
            id=key,
            class_="part",
            aria_label=self.name,
        )


def view(
    backdrop: Picture,
    *,
    key: str,
    place: int,
    name: str,
    title: str,
    figures: Sequence[tuple[str, str]],
    label: str,
    mark: tuple[str, str] | None,
) -> Markup:
    """Return the place of one 3D view: its name and deciding figures above, the still picture behind.

    Args:
        backdrop: the still picture.
        key: of the scene; makes the ids in the page unique.
        place: number of the view in it, from 0.
        name: what it shows.
        title: the same in a few words.
        figures: name and value of each.
        label: read out in place of the view.
        mark: a word on the view that is shown where there is room for one, and why; None on the others.
    """
    plot = element(
        "div", class_="plot", id=f"{key}-plot{place}", tabindex=0, role="application",
        aria_label=f"{label}. Arrow keys turn it, plus and minus zoom, Home resets.",
    )  # fmt: skip
    return element(
        "div",
        element("p", element("strong", name), element("em", mark[0], title=mark[1]) if mark else "",
                element("span", title), class_="view-head"),
        element("p", *(element("span", f"{what} ", element("b", value)) for what, value in figures),
                class_="view-head"),
        element("div", element("div", figure(backdrop), class_="still"), plot,
                element("output", class_="moving"), class_="stage"),
        class_="view best" if mark else "view",
    )  # fmt: skip


def choice(key: str, name: str, legend: str, options: Sequence[tuple[str, str]]) -> Markup:
    """Return radio buttons of which the first is on.

    Args:
        key: of the scene.
        name: of what is chosen.
        legend: the same for a reader.
        options: value and text of each.
    """
    labels = [
        element(
            "label", element("input", type="radio", name=f"{key}-{name}", value=value, checked=place == 0), f" {text}"
        )
        for place, (value, text) in enumerate(options)
    ]
    return element("fieldset", element("legend", legend), *labels)


def scene_block(
    key: str, views: Sequence[Markup], controls: Sequence[Markup], *, player: Markup | str = "", note: str = ""
) -> Markup:
    """Return views side by side, with what is pointed at, legend and controls below them.

    Args:
        key: of the scene.
        views: as `view` gives them.
        controls: of all of them.
        player: of the replay, above the controls.
        note: below the controls.
    """
    return element(
        "div",
        element("div", *views, class_="views"),
        element("p", class_="pointed note", aria_hidden="true"),
        element("div", class_="legend", aria_live="polite"),
        player,
        element("div", *controls, class_="controls"),
        element("p", note, class_="note") if note else "",
        element(
            "p", "A still picture, shown until the 3D view has loaded or where it cannot be drawn.",
            class_="status", role="status",
        ),
        class_="scene", data_part=key,
    )  # fmt: skip


def row_table(columns: Sequence[str], rows: Sequence[Sequence[str]], *, label: str) -> Markup:
    """Return a table that scrolls where it is wider than the page.

    Args:
        columns: their heads.
        rows: the first cell of each heads it.
        label: read out as its name.

    Raises:
        InputError: a row has not a cell for each column.
    """
    if any(len(row) != len(columns) for row in rows):
        raise InputError(f"a table of {', '.join(columns)} needs {how_many(len(columns), 'cell')} in every row.")
    head = element("tr", *(element("th", name, scope="col") for name in columns))
    body = [
        element("tr", element("th", row[0], scope="row"), *(element("td", cell) for cell in row[1:])) for row in rows
    ]
    table = element("table", element("thead", head), element("tbody", *body), class_="matrix layers")
    return scrollable(table, label=label)


def distance_matrix(distances: PathDistances, *, unit: str, form: str, label: str) -> Markup:
    """Return a table: Hausdorff distances above the diagonal, below it, shaded, their means.

    Args:
        distances: between sets of lines.
        unit: of them.
        form: of a figure.
        label: read out as the table's name.
    """
    names = distances.names
    rows: list[Markup] = []
    for i, name in enumerate(names):
        cells: list[Markup] = []
        for j in range(len(names)):
            value = "" if i == j else form.format((distances.hausdorff if i < j else distances.mean)[i, j])
            cells.append(element("td", value, class_="same" if i == j else "above" if i < j else "below"))
        rows.append(element("tr", element("th", name, scope="row"), *cells))
    head = element("tr", element("td", unit), *(element("th", name, scope="col") for name in names))
    table = element("table", element("thead", head), element("tbody", *rows), class_="matrix")
    return scrollable(table, label=label)


def figure(picture: Picture) -> Markup:
    """Return a picture with its caption; it stands in the page."""
    kind, content = ("webp", _webp(picture.content)) if picture.kind == "png" else (picture.kind, picture.content)
    data = base64.b64encode(content).decode("ascii")
    image = element("img", src=f"data:{MEDIA[kind]};base64,{data}", alt=picture.caption)
    return element("figure", image, element("figcaption", picture.caption))


def fact_table(title: str, facts: Sequence[tuple[str, str]]) -> Markup:
    """Return a table of names and values; nothing where there is none."""
    if not facts:
        return Markup("")
    rows = [element("tr", element("th", name, scope="row"), element("td", value)) for name, value in facts]
    return element("table", element("caption", title), element("tbody", *rows), class_="facts")


def how_made(settings: Sequence[tuple[str, str]], inputs: Sequence[tuple[str, str]], *, heading: str = "h2") -> Markup:
    """Return what a result was made of and with: names and values of settings, hashes of files, versions."""
    return joined(
        element(heading, "How it was made"),
        fact_table("Settings", settings),
        fact_table("Input, SHA-256", inputs),
        fact_table("Versions", made_with()),
    )


def made_with() -> tuple[tuple[str, str], ...]:
    """Return the names and versions of what figures depend on."""
    return (("Python", platform.python_version()), *((name, _installed_version(name)) for name in PACKAGES))


def _installed_version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def scrollable(table: Markup, *, label: str) -> Markup:
    """Return a table that scrolls where the page is narrower."""
    return element("div", table, class_="scrollable", tabindex=0, role="region", aria_label=label)


def said(sentences: Sequence[str], cautions: Sequence[str]) -> Markup:
    """Return what is said beside the verdict, what nobody may overlook in a box."""
    box = element("ul", *(element("li", caution) for caution in cautions), class_="cautions", aria_label="Mind")
    return joined(*(element("p", sentence) for sentence in sentences), box if cautions else Markup(""))


def _webp(png: bytes) -> bytes:
    from PIL import Image

    buffer = io.BytesIO()
    Image.open(io.BytesIO(png)).save(buffer, format="webp", quality=PICTURE_QUALITY)
    return buffer.getvalue()
