"""Options and arguments: those of the keys of a job, made from `Job`, and those that several commands share."""

from __future__ import annotations

import inspect
import operator
import types
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias, Union, cast, final, get_args, get_origin

import typer
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from geoprint.config.job import SHAPES, Job, SourceTable, source_named
from geoprint.config.job_file import Setting, job_named, setting
from geoprint.config.strict import Key, Place, key_at, keys_of, option_type, table_of
from geoprint.errors import UsageError

# Arguments and options that several commands share, besides those of a job's keys.


_PARTS = (
    "File of the part: STL, OBJ, PLY, OFF, 3MF, or a ZIP of one; with extras also STEP, IGES, label volumes and point "
    "clouds"
)
Part = Annotated[
    Path,
    typer.Argument(metavar="PART", help=f"{_PARTS}.", show_default=False),
]
_PART_OR_JOB = typer.Argument(
    metavar="PART",
    help=f"{_PARTS}; or a job file (.toml), which `geoprint init` writes: its keys count where no option is given "
    "here.",
    show_default=False,
)
PartOrJob = Annotated[Path, _PART_OR_JOB]
PartOrJobOrNone = Annotated[Path | None, _PART_OR_JOB]
PartsOrJobs = Annotated[
    list[Path],
    typer.Argument(
        metavar="PARTS",
        help="Files of parts, as `geoprint plan` takes them; or job files (.toml), whose keys count where no option is "
        "given here.",
        show_default=False,
    ),
]
# What stands above the options of a kind in help.
PART, PATHS, LAYERS, ROBOT, OUTPUT, OTHER = "Part", "Paths", "Layers", "Robot", "Output", "Options"
Out = Annotated[
    Path | None,
    typer.Option(metavar="FOLDER", help="Folder for the result; required.", show_default=False, rich_help_panel=OUTPUT),
]
ComparedBackends = Annotated[
    str | None,
    typer.Option(
        "--backend",
        metavar="NAME,...",
        help="Backends to compare: heat, fast-marching or lscm with commas between them, or all.",
        show_default="lscm,heat",
        rich_help_panel=PATHS,
    ),
]
OnCells = Annotated[
    str | None,
    typer.Option(
        "--cells",
        metavar="CELL,...",
        help="Instead of backends: cells to compare, files or names with commas between them.",
        show_default=False,
        rich_help_panel=PATHS,
    ),
]
Samples = Annotated[
    bool,
    typer.Option(
        "--samples",
        help="Also write spacing.csv for each backend: every measured spacing.",
        rich_help_panel=OUTPUT,
    ),
]
Figures = Annotated[
    bool,
    typer.Option("--figures", help="Also write figures for papers, as PNG and SVG.", rich_help_panel=OUTPUT),
]
MaxMemory = Annotated[
    float | None,
    typer.Option(metavar="GB", help="Stop with status 6 beyond this much memory.", rich_help_panel=OUTPUT),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an existing result.", rich_help_panel=OUTPUT)]
Verbose = Annotated[bool, typer.Option("--verbose", help="List all that was not checked.", rich_help_panel=OUTPUT)]
AsJson = Annotated[
    bool,
    typer.Option("--json", help="Print the result, or the error, as one JSON object instead.", rich_help_panel=OUTPUT),
]


def backends_of(text: str | None) -> list[str] | None:
    """Return the names in a comma-separated list; `all` stands for every backend, None where nothing is said."""
    from geoprint.distance import backend_names

    if text is None:
        return None
    return list(backend_names()) if text.strip() == "all" else [name.strip() for name in text.split(",")]


# Options of the keys of a job: made from the fields of `Job` for whichever command takes them.


# What the options of a command say of a job: values by the names of its keys, as `job_of` takes them.
Keys: TypeAlias = dict[str, object]
Command: TypeAlias = Callable[..., None]

# The parameter of a command that gets what its options say, and what in it `--set` says.
_TAKEN, SETTINGS = "keys", "settings"
# What stands above the options of the keys in a part of job.toml, in the order of help.
_PANELS = {
    "part": PART, "patches": PART, "spacing": PATHS, "paths": PATHS, "source": PATHS, "layers": LAYERS, "robot": ROBOT
}  # fmt: skip
# Types of values, as help shows them.
_SHAPES: dict[object, str] = {Path: "FILE", int: "N", str: "NAME"}


@final
@dataclass(frozen=True, slots=True)
class _Option:
    """One option of a key.

    Attributes:
        flag: on the command line.
        kind: of its value there.
        help: what it is.
        read: turns that value into the key's; raises a `GeoprintError` where it has no meaning.
        panel: of help in which it stands.
        default: what help names as such.
        shape: of its value, as help shows it; None of what has no value.
        rare: whether commands that take all keys leave it out.
    """

    flag: str
    kind: type
    help: str
    read: Callable[[Any], object]
    panel: str
    default: str = ""
    shape: str | None = None
    rare: bool = False

    def parameter(self, name: str) -> inspect.Parameter:
        """Return it as the parameter of a command; None or False where it is not given."""
        # Here, because typer puts what it is told of a default into brackets of its own.
        said = f"  [default: {self.default}]" if self.default else ""
        empty, kind = (False, bool) if self.kind is bool else (None, self.kind | None)
        default = typer.Option(
            empty, self.flag, help=f"{self.help}{said}", metavar=self.shape, rich_help_panel=self.panel,
            show_default=False,
        )  # fmt: skip
        return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)


_SET = _Option(
    "--set",
    cast("type", list[str]),
    "Any key of a job file, as max_tilt=5 or options.lscm.resolution=500; may be given several times. `geoprint init` "
    "writes a job file with all keys.",
    lambda texts: [setting(text) for text in texts],
    OTHER,
    shape="KEY=VALUE",
)


def takes(
    *names: str, but: Sequence[str] = (), rare: bool = False, model: type[BaseModel] = Job
) -> Callable[[Command], Command]:
    """Give a command the options of a job's keys.

    They stand where the command has the parameter `keys`, which gets a job's keys as far as they are given. Any other
    parameter that bears the name of a key is the option of that key alone.

    Args:
        names: keys that `keys` holds; if not given all, those that are rare by `--set`, which stands there as
            `settings`.
        but: keys that it does not hold.
        rare: whether keys that are rare have options too.
        model: whose fields the keys are.
    """
    offered = _options(model)

    def decorate(command: Command) -> Command:
        own = inspect.signature(command, eval_str=True).parameters
        single = {name for name in offered if name in own and own[name].kind is inspect.Parameter.KEYWORD_ONLY}
        held = [name for name in offered if name not in {*but, *own} and (not names or name in names)]
        each = {key: {name: one for name, one in offered[key].items() if rare or not one.rare} for key in held}
        options = {name: option for key in held for name, option in each[key].items()}
        shown = {**options, **({} if names else {SETTINGS: _SET})}
        spliced: list[inspect.Parameter] = []
        for name, parameter in own.items():
            if name == _TAKEN:
                spliced += [option.parameter(within) for within, option in shown.items()]
            else:
                spliced.append(offered[name][name].parameter(name) if name in single else parameter)

        def called(**given: object) -> None:
            if _TAKEN in own:
                values = {name: given.pop(name) for name in shown}
                keys = {name: said for key in held for name, said in _said(key, each[key], values).items()}
                settings = _SET.read(values.get(SETTINGS) or [])
                given[_TAKEN] = {**keys, SETTINGS: settings} if settings else keys
            command(**given)

        called.__name__, called.__doc__ = command.__name__, command.__doc__
        called.__annotations__ = {}
        called.__signature__ = inspect.Signature(spliced)  # pyright: ignore[reportFunctionMemberAccess]
        return called

    return decorate


def job_asked(surface: Path, keys: Mapping[str, object]) -> Job:
    """Return the job that options ask for; an error names the option that was typed, not the key of a job file."""
    if isinstance(folder := keys.get("source"), Path):
        raise UsageError(
            f"`--from {folder}` is a folder: `geoprint plan --from` one, without a part, plans its bundle again; here "
            f"give one of {SHAPES}."
        )
    given = {name: value for name, value in keys.items() if name != SETTINGS}
    return job_named({"surface": surface, **given}, named=_typed, settings=settings_of(keys))


def settings_of(keys: Mapping[str, object]) -> Sequence[Setting]:
    """Return what `--set` says."""
    return cast("Sequence[Setting]", keys.get(SETTINGS, ()))


def instead_of(flag: str) -> str:
    """Return what to type for an option that a command does not have; nothing where it is no key of a job.

    Args:
        flag: as it was typed.
    """
    for key, options in _options(Job).items():
        for name, option in options.items():
            if option.flag == flag and option.rare:
                return f"`--set {name if name == key else f'{key}.1.{name}'}=VALUE`"
    return ""


def _typed(place: Place) -> str:
    """Return the option of the key at a place, or nothing for what holds together several."""
    offered = _options(Job)
    names = [part for part in place if isinstance(part, str)]
    if not names or names == ["patches"]:
        return ""
    key, within = offered.get(names[0], {}), names[-1]
    option = key.get(within) or key.get(names[0])
    return f"`--set {key_at(place)}`" if option is None or option.rare else f"`{option.flag}`"


def _options(model: type[BaseModel]) -> dict[str, dict[str, _Option]]:
    """Return the options of each key by the names of their parameters: of a table's keys, or to say one key."""
    found: dict[str, dict[str, _Option]] = {}
    order = [*_PANELS, "options"]
    for name, key, field in sorted(keys_of(model), key=lambda each: order.index(each[1].group)):
        panel, table = _PANELS.get(key.group, OTHER), table_of(field)
        if table is not None:
            found[name] = {
                within: _option(within, one, inner, panel) for within, one, inner in keys_of(table) if one.option != ""
            }
        elif key.option != "":
            found[name] = {name: _option(name, key, field, panel)}
    return found


def _option(name: str, key: Key, field: FieldInfo, panel: str) -> _Option:
    """Return the option of one key; points are files there, and several numbers stand one behind another."""
    flag = f"--{key.option or name.replace('_', '-')}"
    kind, read, shape = option_type(field), _as_given, key.shape or choices(field)
    default = "" if field.default is None else str(field.default)
    if kind is bool:
        flag, read = (f"--no-{flag[2:]}", operator.not_) if field.default else (flag, _as_given)
        return _Option(flag, bool, key.help, read, panel, rare=key.rare)
    if isinstance(field.default, float):
        default = f"{field.default:g}"
    elif get_origin(kind) is tuple:
        read, shape = list[float], " ".join(["X", "Y", "Z"] * (len(get_args(kind)) // 3))
    elif kind is SourceTable:
        kind, read, default = str, _source, "border"
    elif get_origin(kind) is list:
        kind, read, default = Path, _curve, ""
    shape = shape or _SHAPES[kind]
    return _Option(flag, cast("type", kind), key.help, read, panel, default, shape, key.rare)


def choices(field: FieldInfo) -> str:
    """Return what a key can be, as help shows it; nothing where that is no closed set."""
    kinds = (
        get_args(field.annotation) if get_origin(field.annotation) in {Union, types.UnionType} else [field.annotation]
    )
    return "|".join(str(one) for kind in kinds if get_origin(kind) is Literal for one in get_args(kind))


def _said(key: str, options: Mapping[str, _Option], values: Mapping[str, object]) -> Keys:
    """Return a key with what its options say, or nothing where none is given."""
    given = {
        name: option.read(values[name])
        for name, option in options.items()
        if values[name] is not None and values[name] is not False
    }
    if not given:
        return {}
    return {key: given[key]} if key in options else {key: [given]}


def _as_given(value: object) -> object:
    return value


def _source(text: str) -> Path | dict[str, object]:
    """Return the keys of a source; a folder as it stands, because `geoprint plan` takes bundles by this option too."""
    return Path(text) if Path(text).is_dir() else source_named(text)


def _curve(path: Path) -> list[list[float]]:
    from geoprint.config import read_curve

    return read_curve(path)
