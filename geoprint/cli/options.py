"""Options and arguments: those of the keys of a job, made from `Job`, and those that several commands share."""

from __future__ import annotations

import inspect
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeAlias, cast, final, get_args, get_origin

import typer
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from geoprint.config.job import SHAPES, Job, SourceTable, source_named
from geoprint.config.job_file import job_named
from geoprint.config.strict import Key, Place, key_at, keys_of, option_type, table_of
from geoprint.errors import UsageError

# Arguments and options that several commands share, besides those of a job's keys.


_PARTS = (
    "File of the part: STL, OBJ, PLY, OFF or 3MF, or one of these in a ZIP; with the extras also STEP, IGES, label "
    "volumes and point clouds"
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
Out = Annotated[Path, typer.Option(metavar="FOLDER", help="Folder for the result.", show_default=False)]
Samples = Annotated[
    bool, typer.Option("--samples", help="Also write spacing.csv for each backend: every measured spacing.")
]
Figures = Annotated[bool, typer.Option("--figures", help="Also write figures for papers, as PNG and SVG.")]
MaxMemory = Annotated[float | None, typer.Option(help="Stop with status 6 beyond this much memory in GB.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an existing result.")]
Verbose = Annotated[bool, typer.Option("--verbose", help="List all that was not checked.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result, or the error, as one object on stdout.")]


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

# The parameter of a command that gets what its options say.
_TAKEN = "keys"


@final
@dataclass(frozen=True, slots=True)
class _Option:
    """One option of a key.

    Attributes:
        flag: on the command line.
        kind: of its value there.
        help: what it is.
        read: turns that value into the key's; raises a `GeoprintError` where it has no meaning.
        default: what help names as such.
        shape: of its value, as help shows it; by its kind if not given.
    """

    flag: str
    kind: type
    help: str
    read: Callable[[Any], object]
    default: str = ""
    shape: str | None = None

    def parameter(self, name: str) -> inspect.Parameter:
        """Return it as the parameter of a command; None where it is not given."""
        # Here, because typer puts what it is told of a default into brackets of its own.
        said = f"  [default: {self.default}]" if self.default else ""
        default = typer.Option(None, self.flag, help=f"{self.help}{said}", metavar=self.shape)
        return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=self.kind | None)


def takes(*names: str, but: Sequence[str] = (), model: type[BaseModel] = Job) -> Callable[[Command], Command]:
    """Give a command the options of a job's keys.

    They stand where the command has the parameter `keys`, which gets a job's keys as far as they are given. Any other
    parameter that bears the name of a key is the option of that key alone.

    Args:
        names: keys that `keys` holds; all if not given.
        but: keys that it does not hold.
        model: whose fields the keys are.
    """
    offered = _options(model)

    def decorate(command: Command) -> Command:
        own = inspect.signature(command, eval_str=True).parameters
        single = {name for name in offered if name in own and own[name].kind is inspect.Parameter.KEYWORD_ONLY}
        held = [name for name in offered if name not in {*but, *own} and (not names or name in names)]
        options = {name: option for key in held for name, option in offered[key].items()}
        spliced: list[inspect.Parameter] = []
        for name, parameter in own.items():
            if name == _TAKEN:
                spliced += [option.parameter(within) for within, option in options.items()]
            else:
                spliced.append(offered[name][name].parameter(name) if name in single else parameter)

        def called(**given: object) -> None:
            if _TAKEN in own:
                values = {name: given.pop(name) for name in options}
                given[_TAKEN] = {name: said for key in held for name, said in _said(key, offered[key], values).items()}
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
    return job_named({"surface": surface, **keys}, named=_typed)


def _typed(place: Place) -> str:
    """Return the option of the key at a place, or nothing for what holds together several."""
    offered = _options(Job)
    names = [part for part in place if isinstance(part, str)]
    if not names or names == ["patches"]:
        return ""
    key, within = offered.get(names[0], {}), names[-1]
    option = key.get(within) or key.get(names[0])
    return f"`{option.flag.partition('/')[0]}`" if option is not None else key_at(place)


def _options(model: type[BaseModel]) -> dict[str, dict[str, _Option]]:
    """Return the options of each key by the names of their parameters: of a table's keys, or to say one key."""
    found: dict[str, dict[str, _Option]] = {}
    for name, key, field in keys_of(model):
        table = table_of(field)
        if table is not None:
            found[name] = {within: option for one in _options(table).values() for within, option in one.items()}
        elif key.option != "":
            found[name] = {name: _option(name, key, field), **_OTHERS.get(name, {})}
    return found


def _option(name: str, key: Key, field: FieldInfo) -> _Option:
    """Return the option of one key; points are files there, and several numbers stand one behind another."""
    flag = f"--{key.option or name.replace('_', '-')}"
    kind, read, shape = option_type(field), _as_given, None
    default = "" if field.default is None else str(field.default)
    if kind is bool:
        opposite = f"--no-{flag[2:]}"
        default = (flag if field.default else opposite)[2:]
        flag = f"{flag}/{opposite}"
    elif isinstance(field.default, float):
        default = f"{field.default:g}"
    elif get_origin(kind) is tuple:
        read, shape = list[float], " ".join(["X", "Y", "Z"] * (len(get_args(kind)) // 3))
    elif get_origin(kind) is dict:
        kind, read, default, shape = list[str], _options_by_owner, "", "NAME[.KEY=VALUE]"
    elif kind is SourceTable:
        kind, read, shape, default = str, _source, "SOURCE", "border"
    elif kind == list[str]:
        kind, read, shape = str, _parted, f"{name.upper()[:-1]},..."
    elif get_origin(kind) is list:
        kind, read, default = Path, _curve, ""
    return _Option(flag, cast("type", kind), key.help, read, default, shape)


def _said(key: str, options: Mapping[str, _Option], values: Mapping[str, object]) -> Keys:
    """Return a key with what its options say, or nothing where none is given."""
    given = {name: option.read(values[name]) for name, option in options.items() if values[name] not in (None, [])}
    if not given:
        return {}
    if key not in options:
        return {key: [given]}
    if len(given) > 1:
        flags = " or ".join(f"`{options[name].flag}`" for name in given)
        raise UsageError(f"give either {flags}, not both: each says the same.")
    return {key: next(iter(given.values()))}


def _as_given(value: object) -> object:
    return value


def _source(text: str) -> Path | dict[str, object]:
    """Return the keys of a source; a folder as it stands, because `geoprint plan` takes bundles by this option too."""
    return Path(text) if Path(text).is_dir() else source_named(text)


def _parted(text: str) -> list[str]:
    return [part.strip() for part in text.split(",")]


def _curve(path: Path) -> list[list[float]]:
    from geoprint.config import read_curve

    return read_curve(path)


def _rounds(step: str) -> int:
    """Turn the paper's step of the normalised distance into rounds."""
    top, _, bottom = step.partition("/")
    try:
        value = float(top) / float(bottom or 1)
        count = round(1.0 / value)
    except (ValueError, ZeroDivisionError, OverflowError):
        count, value = 0, 0.0
    if count < 1 or abs(count * value - 1.0) > 1e-6:
        raise UsageError(f"`--step {step}` does not divide the distance into whole rounds; write 0.05 or 1/20.")
    return count


def _options_by_owner(texts: Sequence[str]) -> dict[str, dict[str, object]]:
    """Return what texts such as lscm.resolution=500 say: values by name, by whose they are; a name alone gives none."""
    found: dict[str, dict[str, object]] = {}
    for text in texts:
        named, equals, value = text.partition("=")
        owner, dot, name = named.partition(".")
        if owner.strip() and not dot and not equals:
            found.setdefault(owner.strip(), {})
            continue
        if not (equals and owner.strip() and name.strip()):
            lacking = "a dot between whose option it is and its name" if equals else "a '=' and a value"
            raise UsageError(f"`--option {text}` lacks {lacking}; write it as lscm.resolution=500.")
        found.setdefault(owner.strip(), {})[name.strip()] = _scalar(value.strip())
    return found


def _scalar(text: str) -> object:
    """Return a value of TOML, or a bare word as it stands."""
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    value = parsed["value"]
    if len(parsed) > 1 or not isinstance(value, bool | int | float | str):
        raise UsageError(f"the value `{text}` of an option is no number, true, false or text.")
    return value


# Other options that set a key.
_OTHERS = {
    "rounds": {"step": _Option("--step", str, "Step of the normalised distance, 0.05 or 1/20 for 20 rounds.", _rounds)}
}
