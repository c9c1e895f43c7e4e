"""What a picture of the guide was made from, kept in its file, so that a test notices when that has changed since.

A picture keeps a hash of its inputs: the statements that draw it, followed from name to name through the benchmarks,
the files that those name, and the blocks of pages that they take. Comments, docstrings and imports do not count, and
what the package does with the inputs does not either: for that a picture keeps the figures that its caption says.
"""

from __future__ import annotations

import ast
import hashlib
import io
import re
import tomllib
import zlib
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import final

from PIL import Image

from benchmarks import DATA
from geoprint.config import PACKAGED_CELLS, TILTING_CELL, UR_CELL, packaged_cell_text
from geoprint.guide import page_named

# Of PNG [ISO 15948]: a signature, then chunks of length, name, content and check sum; the header is the first.
HEADER_END = 8 + 4 + 4 + 13 + 4
MADE_FROM, FIGURES = "geoprint made from", "geoprint figures"
# Packages whose statements are followed.
FOLLOWED = ("benchmarks", "tests")
# What is longer is no name of a file.
LONGEST_NAME = 60
# A number that is no part of a name, as in potpourri3d.
FIGURE = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?!\w)")


def figures_in(text: str) -> list[str]:
    """Return the figures of a caption in their order."""
    return FIGURE.findall(text)


def with_figures(png: bytes, figures: Sequence[str]) -> bytes:
    """Return a picture that keeps the figures which its caption says, in their order."""
    return stamped(png, FIGURES, " ".join(figures))


def figures_of(png: bytes) -> list[str]:
    """Return the figures that a picture keeps; none where it keeps none."""
    return texts_of(png).get(FIGURES, "").split()


def stamped(png: bytes, keyword: str, text: str) -> bytes:
    """Return a PNG with a text behind its header."""
    chunk = b"tEXt" + f"{keyword}\0{text}".encode("latin-1")
    packed = (len(chunk) - 4).to_bytes(4, "big") + chunk + zlib.crc32(chunk).to_bytes(4, "big")
    return png[:HEADER_END] + packed + png[HEADER_END:]


def texts_of(png: bytes) -> Mapping[str, str]:
    """Return the texts that a PNG keeps, by their keywords."""
    return {str(name): str(text) for name, text in Image.open(io.BytesIO(png)).info.items() if isinstance(text, str)}


def made_from(drawing: Callable[..., object]) -> str:
    """Return a hash of what a drawing is made from."""
    inputs = Inputs()
    inputs.follow(drawing.__module__, drawing.__name__)
    return inputs.hash()


@final
class Inputs:
    """The statements, files and blocks that something at the top of a module is made from.

    Attributes:
        texts: of statements by module and name, of blocks by page.
        files: that they name.
    """

    def __init__(self) -> None:
        self.texts: dict[str, str] = {}
        self.files: set[Path] = set()

    def hash(self) -> str:
        """Return what differs where any of it does."""
        whole = hashlib.sha256()
        for name, text in sorted(self.texts.items()):
            whole.update(f"{name}\n{text}\n".encode())
        for path in sorted(self.files, key=lambda path: path.name):
            whole.update(path.name.encode() + path.read_bytes())
        return whole.hexdigest()[:16]

    def follow(self, module: str, name: str) -> None:
        """Take what a name at the top of a module stands for, and what the names in that stand for."""
        statement = _statements(source_of(module)).get(name)
        if isinstance(statement, ast.ImportFrom):
            self._follow_import(statement, [alias for alias in statement.names if name in {alias.name, alias.asname}])
        elif statement is not None and f"{module}.{name}" not in self.texts:
            self.texts[f"{module}.{name}"] = _text(module, statement)
            value = getattr(import_module(module), name)
            if isinstance(value, Path) and value.is_file():
                self.files.add(value)
            own = _names_of_its_own(statement)
            for node in ast.walk(statement):
                self._take(module, node, own)

    def _follow_import(self, statement: ast.ImportFrom, names: Sequence[ast.alias]) -> None:
        if statement.module is not None and statement.module.partition(".")[0] in FOLLOWED:
            for alias in names:
                self.follow(statement.module, alias.name)

    def _take(self, module: str, node: ast.AST, own: Collection[str]) -> None:
        """Take what a part of a statement names, but for arguments and variables of its own."""
        match node:
            case ast.Name(id="load_cell" | "packaged_cell_text"):
                cells = (*PACKAGED_CELLS, TILTING_CELL)
                self.texts["cells"] = repr([tomllib.loads(packaged_cell_text(name)) for name in cells])
            case ast.Name(id="UR_CELL"):
                self.texts["cell of another arm"] = repr(tomllib.loads(packaged_cell_text(UR_CELL)))
            case ast.Name(id=name, ctx=ast.Load()) if name not in own:
                self.follow(module, name)
            case ast.Attribute(value=ast.Name(id=owner), attr=name):
                held = getattr(import_module(module), owner, None)
                if isinstance(held, ModuleType) and held.__name__.partition(".")[0] in FOLLOWED:
                    self.follow(held.__name__, name)
            case ast.ImportFrom():
                self._follow_import(node, node.names)
            case ast.Call(func=ast.Name(id="page_named"), args=[ast.Constant(value=str(name))]):
                blocks = [each for each in page_named(name).blocks if each.language != "output"]
                self.texts[f"page {name}"] = repr([(each.language, each.word, each.text) for each in blocks])
            case ast.Constant(value=str(text)) if text and len(text) < LONGEST_NAME and (DATA / text).is_file():
                self.files.add(DATA / text)
            case _:
                pass


@cache
def _statements(source: str) -> Mapping[str, ast.stmt]:
    """Return the statements at the top of a module by the names that they define."""
    found: dict[str, ast.stmt] = {}
    for statement in ast.parse(source).body:
        match statement:
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                found[name] = statement
            case ast.ImportFrom():
                found |= {alias.asname or alias.name: statement for alias in statement.names}
            case ast.Assign() | ast.AnnAssign():
                targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
                names = (node.id for target in targets for node in ast.walk(target) if isinstance(node, ast.Name))
                found |= dict.fromkeys(names, statement)
            case _:
                pass
    return found


def _names_of_its_own(statement: ast.stmt) -> set[str]:
    """Return the arguments and the variables of a function."""
    if not isinstance(statement, ast.FunctionDef):
        return set()
    nodes = list(ast.walk(statement))
    variables = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    return variables | {node.arg for node in nodes if isinstance(node, ast.arg)}


def _text(module: str, statement: ast.stmt) -> str:
    """Return a statement as it is written, without docstrings and lines of comment."""
    lines = dict(enumerate(source_of(module).splitlines(), start=1))
    documented = (
        node.body[0] for node in ast.walk(statement) if isinstance(node, ast.FunctionDef | ast.ClassDef)
        and ast.get_docstring(node) is not None
    )  # fmt: skip
    left_out = {number for each in documented for number in range(each.lineno, (each.end_lineno or 0) + 1)}
    numbers = range(statement.lineno, (statement.end_lineno or 0) + 1)
    kept = [lines[number] for number in numbers if number not in left_out]
    return "\n".join(line for line in kept if not line.lstrip().startswith("#"))


def source_of(module: str) -> str:
    """Return the text of a module."""
    return Path(import_module(module).__file__ or "").read_text(encoding="utf-8")
