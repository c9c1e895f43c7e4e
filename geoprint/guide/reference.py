"""Pages of the guide that are made from what the code says of itself: commands, keys, file formats, figures, names."""

from __future__ import annotations

import ast
import inspect
import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import import_module, resources
from types import MappingProxyType, ModuleType
from typing import Any, cast

_EXAMPLES = resources.files("geoprint.guide") / "examples"
# What stands before the generated part of each page.
JOB_KEYS = """\
`geoprint init` writes `job.toml` with these keys and their comments, and `geoprint plan job.toml --out DIR` reads it.
`--set KEY=VALUE` gives any of them on the command line; `patches.N` is patch N, from 1. Lengths are mm, angles degrees.
"""
FIELD_FILE = """\
What `field` names, as `geoprint init` writes it.
"""
CELL_KEYS = """\
`geoprint init` writes the cells that come along. This is the default one, table by table; what is commented out may be
added. `geoprint plan --cell FILE` reads a cell.
"""
METRICS = """\
*CV* is the coefficient of variation: standard deviation over mean, 0 % is perfectly even. Files hold shares and CVs of
1, tables show per cent. Coverings are ranked by coverage first, then by thickness.
"""
GALLERY = """\
Scripts to copy. Each runs from the folder that holds `data/`, and draws the picture above it.
"""
FILES = """\
Lengths are mm and times s; angles are degrees in JSON files and rad in tables. Another unit stands in the name, or in
brackets. A key of a JSON file stands behind those around it; `[]` is each item of a list, `*` each name.
`python -m geoprint.reporting.json_schemas FOLDER` writes JSON Schemas.
"""


def commands_text() -> str:
    """Return the Markdown: a section a command, with what it takes panel by panel, as its help has it."""
    from geoprint.cli.application import documented

    parts = ["Options of `plan` and `compare` are keys of [a job file](job-keys.md) too, which has more of them.\n"]
    for name, said, panels in documented():
        parts.append(f"## geoprint {name}\n\n{_escaped(said)}\n")
        for panel, rows in panels.items():
            parts.append(_table((panel, ""), [(_code(first), _escaped(each)) for first, each in rows]))
    return "\n".join(parts)


def job_keys_text() -> str:
    """Return the Markdown: the keys of a job file, group by group, and a field file as `init` writes it."""
    from geoprint.config.field_file import FIELD_EXAMPLE
    from geoprint.config.job import GROUPS, Job
    from geoprint.config.strict import keys_of, part_of, table_of

    parts = [JOB_KEYS]
    for group, heading in GROUPS.items():
        rows: list[Sequence[str]] = []
        blocks: list[str] = []
        for name, key, field in keys_of(Job):
            if key.group != group:
                continue
            if (table := table_of(field) or part_of(field)) is not None:
                before = f"{name}.N" if table_of(field) else name
                rows += [_key(f"{before}.{within}", one, deep) for within, one, deep in keys_of(table)]
            elif "\n" in key.example:
                blocks.append(f"```toml\n{key.example}\n```\n")
            else:
                rows.append(_key(name, key, field))
        parts += [f"## {group.capitalize()}\n", *([f"{heading}\n"] if heading else []), *blocks]
        parts += [_table(("key", "such as", "meaning"), rows)] if rows else []
    return "\n".join([*parts, f"## The field file\n\n{FIELD_FILE}\n```toml\n{FIELD_EXAMPLE}```\n"])


def _key(name: str, key: Any, field: Any) -> Sequence[str]:
    """Return the row of a key of a job file."""
    value = key.example.partition("# ")[0].strip() or json.dumps(field.default)
    return _code(name), _code(value), _escaped(key.meaning)


def cell_keys_text() -> str:
    """Return the Markdown: every table of the cell file that comes along, with its comments."""
    from geoprint.config.cells import PACKAGED_CELLS, packaged_cell_text

    parts = [CELL_KEYS]
    for paragraph in packaged_cell_text(PACKAGED_CELLS[0]).split("\n\n"):
        named = re.search(r"^(?:# )?\[{1,2}(\w+)\]", paragraph, re.MULTILINE)
        parts += [f"## `[{named[1]}]`\n"] if named else []
        parts.append(f"```toml\n{paragraph.strip()}\n```\n")
    return "\n".join(parts)


def metrics_text() -> str:
    """Return the Markdown: a row a figure of evenness, from the catalogue."""
    from geoprint.reporting.metrics import CATALOGUE

    better = {True: "lower", False: "higher", None: "neither"}
    rows = [
        (each.label, each.column, _escaped(each.meaning), better[each.lower_is_better], _code(each.key))
        for each in CATALOGUE
    ]
    return f"{METRICS}\n{_table(('figure', 'in tables', 'meaning', 'better', 'in files'), rows)}"


def files_text() -> str:
    """Return the Markdown: what the CSV and JSON files hold, every column and every key with meaning and unit."""
    from geoprint.metrics.evenness import SPACING_COLUMNS, Uniformity
    from geoprint.postprocessor import tables
    from geoprint.postprocessor.orders import Orders
    from geoprint.reporting.json_schemas import RECORDS

    parts = [FILES]
    for name, columns, described in (
        ("poses.csv", tables.POSES_COLUMNS, tables.PosesTable),
        ("trajectory.csv", tables.TRAJECTORY_COLUMNS, tables.TrajectoryTable),
        ("targets.csv", tables.TARGETS_COLUMNS, Orders),
        ("spacing.csv", SPACING_COLUMNS, Uniformity.table),
    ):
        sections = _sections(inspect.getdoc(described) or "")
        # What has a value a row has the shape of the first one.
        items = _items(sections.get("Attributes", []))
        rows = [f"- {item}" for item in items if item.partition(": (")[2][:1] == items[0].partition(": (")[2][:1]]
        said = "\n".join(rows or sections["more"])
        parts.append(f"## {name}\n\nColumns: `{', '.join(columns)}`.\n\n{said}\n")
    for name, record in RECORDS.items():
        schema = record.model_json_schema()
        keys = [(_code(path), kind, _escaped(said)) for path, kind, said in _leaves(schema, schema.get("$defs", {}))]
        first, _, _ = (inspect.getdoc(record) or "").partition("\n\n")
        file = f"{name}.json"
        parts.append(f"## {file if file in first else name}\n\n{first}\n\n{_table(('key', 'type', 'meaning'), keys)}")
    return "\n".join(parts)


def sources_text() -> str:
    """Return the Markdown: what is cited, by its key."""
    text = (resources.files(_TOP) / "BIBLIOGRAPHY.md").read_text(encoding="utf-8")
    return text.partition("\n\n")[2]


def gallery_text() -> str:
    """Return the Markdown: each script of the gallery, what it is for, and what it draws."""
    parts = [GALLERY]
    for script in sorted(_EXAMPLES.iterdir(), key=lambda file: file.name):
        if script.name.endswith(".py"):
            text = script.read_text(encoding="utf-8")
            said = ast.get_docstring(ast.parse(text)) or ""
            title, _, rest = said.partition("\n")
            picture = f"![{title.rstrip('.')}](../../examples/{script.name.removesuffix('.py')}.png)"
            code = text.partition('"""')[2].partition('"""')[2].strip()
            parts += [
                f"## {title.rstrip('.')}\n\n{rest.strip()}\n\n{picture}\n",
                f"```python {script.name}\n{code}\n```\n",
            ]
    return "\n".join(parts)


def _leaves(
    node: Mapping[str, Any], kinds: Mapping[str, Any], path: str = "", within: tuple[str, ...] = ()
) -> Iterator[tuple[str, str, str]]:
    """Yield key, type and meaning of what a schema holds; what holds itself is listed once."""
    if "$ref" in node:
        name = node["$ref"].rpartition("/")[2]
        if name in within:
            yield path, "object", "as the one that it stands in"
            return
        node, within = {**kinds[name], "description": "", **node}, (*within, name)
    if "properties" in node:
        for name, inner in node["properties"].items():
            yield from _leaves(inner, kinds, f"{path}.{name}" if path else name, within)
    elif isinstance(node.get("items"), dict):
        yield from _leaves({"description": node.get("description", ""), **node["items"]}, kinds, f"{path}[]", within)
    elif isinstance(node.get("additionalProperties"), dict):
        inner = {"description": node.get("description", ""), **node["additionalProperties"]}
        yield from _leaves(inner, kinds, f"{path}.*", within)
    elif one := [each for each in node.get("anyOf", []) if each.get("type") != "null"]:
        yield from _leaves({"description": node.get("description", ""), **one[0]}, kinds, path, within)
    else:
        kind = node.get("type") or ("one of these" if "enum" in node else "any")
        choices = f" ({', '.join(map(str, node['enum']))})" if "enum" in node else ""
        yield path, str(kind), f"{node.get('description', '')}{choices}"


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table of Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _code(text: str) -> str:
    """Return what is typed as a cell of a table."""
    return f"`{text}`".replace("|", r"\|")


def _escaped(text: str) -> str:
    """Return plain words as Markdown shows them, in one line; what stands between backticks is code."""
    parts = " ".join(text.split()).split("`")
    return "`".join(part if at % 2 else re.sub(r"([*])", r"\\\1", part) for at, part in enumerate(parts)).replace(
        "|", r"\|"
    )


# The public names, with signature, shapes and units from their docstrings.
# Packages in the order in which data passes them, with what one looks for there.
_TOP = "geoprint"
STAGES = {
    _TOP: "The whole at once",
    "geoprint.config": "Jobs and cells",
    "geoprint.geometry.files": "Files",
    "geoprint.geometry": "Surfaces, their defects and repair, other triangles",
    "geoprint.distance": "Distance and contours",
    "geoprint.fibers": "Direction fields",
    "geoprint.layers": "Layers",
    "geoprint.toolpath": "Patterns and paths",
    "geoprint.metrics": "Evenness",
    "geoprint.inspection": "Photographs of the print",
    "geoprint.simulation": "A simulated print",
    "geoprint.toolpath_files": "Toolpaths of any program",
    "geoprint.process": "Material",
    "geoprint.process_fitting": "Process settings from measurements",
    "geoprint.positioner": "Tables that move the part",
    "geoprint.robot.placing": "Where the part stands",
    "geoprint.robot.arm": "The arm",
    "geoprint.robot.reach": "Reach",
    "geoprint.robot.timing": "Timing",
    "geoprint.robot.controller": "The controller",
    "geoprint.robot.collision": "Collision",
    "geoprint.postprocessor": "Tables and bundle",
    "geoprint.workflow": "Where the stages meet",
    "geoprint.sweep": "Studies of many parts",
    "geoprint.results": "Results",
    "geoprint.reporting": "What is said of a result",
    "geoprint.model": "Values",
    "geoprint.errors": "Refusals",
}
# The sections of a docstring that are shown line by line, and what stands before each.
_SECTIONS = {"Attributes": "", "Args": "", "Returns": "returns: "}
# Defaults that are shown as they are written.
_PLAIN = (bool, int, float, str, type(None))
_BEFORE = """\
Every stage is a function from frozen values to a new one, and what each of these packages names is public.
Lengths are mm, times s, angles rad; letters in brackets are the shapes of arrays.
"""
# Letters of a line of code.
WIDEST = 80
_HEADING = re.compile(r"^(\w+):$")


def api_text() -> str:
    """Return the Markdown: a section a package, an entry a name."""
    parts = [_BEFORE]
    for name, heading in STAGES.items():
        package = import_module(name)
        first = inspect.getdoc(package) or ""
        parts.append(f"## {heading}: `{name}`\n\n{first.partition(chr(10) * 2)[0]}\n")
        whole = name != _TOP
        parts += [_entry(each, getattr(package, each), whole=whole) for each in public_names(package)]
    return "\n".join(parts)


def public_names(package: ModuleType) -> Sequence[str]:
    """Return what a package passes on: functions, classes, and tables of what is chosen by name.

    They stand in the package's own order where it has one, else from a to z.
    """
    named: Sequence[str] | None = getattr(package, "__all__", None)
    return [
        name
        for name in named or sorted(vars(package), key=str.lower)
        if not name.startswith("_") and _is_shown(getattr(package, name), package.__name__)
    ]


def _is_shown(value: object, package: str) -> bool:
    """Return whether a name is a function, a class or a table of geoprint, at home at or below its package."""
    if isinstance(value, MappingProxyType):
        return True
    return (inspect.isfunction(value) or inspect.isclass(value)) and (
        package == _TOP or value.__module__.startswith(package)
    )


def _entry(name: str, value: object, *, whole: bool) -> str:
    """Return what is said of one name; of those at the top, which stand below again, the first sentence alone."""
    if isinstance(value, MappingProxyType):
        return f"### `{name}`\n\n{''.join(_known(cast('Mapping[str, type]', value)))}"
    sections = _sections(inspect.getdoc(value) or "")
    first = f"### `{name}`\n\n{_signature(name, value)}{' '.join(sections[''])}\n"
    if not whole:
        return first
    lines = [f"- {before}{each}\n" for title, before in _SECTIONS.items() for each in _items(sections.get(title, []))]
    raised = re.findall(r"^    (\w+): ", "\n".join(sections.get("Raises", [])), re.MULTILINE)
    if raised:
        lines.append(f"- raises: {', '.join(f'`{each}`' for each in raised)}\n")
    return f"{first}\n{''.join(lines)}"


def _known(entries: Mapping[str, type]) -> Iterator[str]:
    """Yield a line for each backend or pattern, with what it says of itself and its options."""
    for name, entry in entries.items():
        said = str(getattr(entry, "summary", getattr(entry, "title", ""))).rstrip(".")
        parameters = inspect.signature(entry).parameters.values()
        options = ", ".join(f"`{name}.{one.name}`" for one in parameters if one.kind is one.KEYWORD_ONLY)
        yield f"- `{name}`: {said}.{f' Options: {options}.' if options else ''}\n"


def _signature(name: str, value: object) -> str:
    """Return the arguments of a function as they are written; nothing for a class, whose attributes are listed."""
    if not inspect.isfunction(value):
        return ""
    whole = inspect.signature(value)
    plain = [
        one if one.default is one.empty or isinstance(one.default, _PLAIN) else one.replace(default=...)
        for one in whole.parameters.values()
    ]
    text = f"{name}{whole.replace(parameters=plain)}".replace("'", "").replace("Ellipsis", "...")
    if len(text) > WIDEST:
        # An argument a line, as it is written where it does not fit one; the star before those that are named.
        inner = re.split(r", (?=\*|\w+(?:: | ?=))", text[len(name) + 1 : text.rindex(")")])
        text = f"{name}(\n" + "".join(f"    {each},\n" for each in inner) + text[text.rindex(")") :]
    return f"```python\n{text}\n```\n\n"


def _sections(text: str) -> Mapping[str, list[str]]:
    """Return the lines of a docstring by the heading that they stand under; the first line alone under none."""
    found: dict[str, list[str]] = {"": []}
    under = ""
    for line in text.splitlines():
        if heading := _HEADING.match(line):
            under = heading[1]
        elif under:
            found.setdefault(under, []).append(line)
        elif line.strip():
            found[""].append(line.strip())
        else:
            under = "more"
    return found


def _items(lines: Sequence[str]) -> Sequence[str]:
    """Return the entries of a section, each in one line: what is indented more goes on with the entry above it."""
    items: list[str] = []
    for line in filter(str.strip, lines):
        if line.startswith("     ") and items:
            items[-1] += f" {line.strip()}"
        else:
            items.append(line.strip())
    return [re.sub(r"^(\*{0,2}\w+)(?=: )", r"`\1`", item) for item in items]


# Part, order, name, title, summary and what writes the text of each page that is made from the code.
GENERATED: Sequence[tuple[str, int, str, str, str, Callable[[], str]]] = (
    ("tutorials", 500, "gallery", "Gallery of scripts", "Short scripts with what they draw, to copy.", gallery_text),
    ("reference", 510, "commands", "Commands and options", "Every command with all that it takes.", commands_text),
    ("reference", 520, "job-keys", "Keys of a job file", "What a job file and a field file may say.", job_keys_text),
    (
        "reference",
        530,
        "cell-keys",
        "Keys of a cell file",
        "What a cell says of robot, tool and place.",
        cell_keys_text,
    ),
    ("reference", 540, "files", "File formats", "Columns and keys of what geoprint writes, with units.", files_text),
    ("reference", 550, "metrics", "Metrics of evenness", "Every figure, and which way is better.", metrics_text),
    ("reference", 560, "api", "API: the public names", "All names of the library, with shapes and units.", api_text),
    ("reference", 570, "sources", "Sources", "What docstrings and pages cite, by its key.", sources_text),
)
