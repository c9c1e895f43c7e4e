"""What can be chosen by name: built in, made known by a script, or named by a feature or an installed package.

An option of an entry is a keyword-only argument of its constructor: its name, its type and its default stand there
and nowhere else.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar, final

from pydantic import ConfigDict, TypeAdapter, ValidationError

from geoprint.errors import UsageError
from geoprint.features import loaded, named_points, origin_of
from geoprint.model import OptionValue

MadeT_co = TypeVar("MadeT_co", covariant=True)
# Commas part names, and a dot parts a name from its option.
_NAME = re.compile(r"[a-z][a-z0-9-]*")
_STRICT = ConfigDict(strict=True, allow_inf_nan=False, arbitrary_types_allowed=True)


class Factory(Protocol[MadeT_co]):
    """What every entry is: a class that says what it is, and builds something."""

    @property
    def title(self) -> str:
        """A few words that stand beside its name; a `ClassVar` of a class."""
        ...

    def __call__(self, *_: Any, **options: Any) -> MadeT_co:
        """Build it with some of its options; the others have their defaults."""
        ...


FactoryT = TypeVar("FactoryT", bound="Factory[object]")
FactoryT_co = TypeVar("FactoryT_co", bound="Factory[object]", covariant=True)
FactT = TypeVar("FactT")


@final
@dataclass(frozen=True, slots=True, eq=False)
class Entry(Generic[FactoryT_co]):
    """One entry of a registry.

    Attributes:
        name: that it is chosen by.
        factory: its class.
        origin: where it comes from, in words.
    """

    name: str
    factory: FactoryT_co
    origin: str

    @property
    def summary(self) -> str:
        """One sentence about it; its title where it states none."""
        return self.fact("summary", self.factory.title)

    def fact(self, name: str, default: FactT) -> FactT:
        """Return what the class states under a name, or the default where it does not have to and says nothing.

        Raises:
            UsageError: it states something of another type.
        """
        stated: object = getattr(self.factory, name, default)
        if not isinstance(stated, type(default)):
            raise UsageError(f"`{name}` of {self.origin} is {stated!r}; it must be of the same kind as {default!r}.")
        return stated

    @property
    def options(self) -> tuple[str, ...]:
        """The names of its options."""
        return tuple(self._parameters())

    def checked(self, given: Mapping[str, OptionValue]) -> dict[str, OptionValue]:
        """Return options as its constructor takes them.

        Raises:
            UsageError: it has no option of a name, or one of another type, or one that it needs is missing.
        """
        parameters = self._parameters()
        takes = ", ".join(f"{name} ({_type_of(parameter)})" for name, parameter in parameters.items()) or "no option"
        for name, value in given.items():
            if name not in parameters:
                raise UsageError(f"{self.name} has no option '{name}'; it takes {takes}.")
            try:
                TypeAdapter[object](parameters[name].annotation, config=_STRICT).validate_python(value)
            except ValidationError as error:
                said = error.errors()[0]["msg"]
                raise UsageError(
                    f"`{self.name}.{name}`: {said[0].lower()}{said[1:]}, found {value!r}; {self.name} takes {takes}."
                ) from error
        for name, parameter in parameters.items():
            if parameter.default is parameter.empty and name not in given:
                raise UsageError(
                    f"{self.name} needs its option '{name}': give `--set options.{self.name}.{name}=VALUE`."
                )
        return dict(given)

    def _parameters(self) -> dict[str, inspect.Parameter]:
        try:
            parameters = inspect.signature(self.factory, eval_str=True).parameters.values()
        except (NameError, TypeError, ValueError) as error:
            raise UsageError(
                f"the options of {self.origin} cannot be read ({error}): give them plain types."
            ) from error
        return {one.name: one for one in parameters if one.kind is one.KEYWORD_ONLY}


@final
class Registry(Generic[FactoryT]):
    """All entries of one seam; packages of others are asked when a name is, not before.

    Args:
        noun: what an entry is called in messages.
        group: of entry points.
        built_in: by name.
        members: attributes that a class must have to be an entry.

    Examples:
        >>> class Disc:
        ...     title = "a disc"
        ...
        ...     def __init__(self, *, radius: float = 1.0) -> None:
        ...         self.radius = radius
        >>> shapes = Registry("shape", group="nobody.shapes", built_in={}, members=("title",))
        >>> shapes.register("disc", Disc)
        >>> shapes.names, shapes.find("disc").options
        (('disc',), ('radius',))
        >>> shapes.find("disc").factory(radius=2.0).radius
        2.0
    """

    def __init__(self, noun: str, *, group: str, built_in: Mapping[str, FactoryT], members: tuple[str, ...]) -> None:
        self._noun = noun
        self._group = group
        self._members = members
        self._own = {name: self._entry(name, factory, f"the {noun} '{name}'") for name, factory in built_in.items()}

    @property
    def own(self) -> tuple[Entry[FactoryT], ...]:
        """What is built in, and what scripts have made known."""
        return tuple(self._own.values())

    @property
    def names(self) -> tuple[str, ...]:
        """All names: built in, of scripts, of installed packages."""
        return tuple(dict.fromkeys([*self._own, *sorted(point.name for point in named_points(self._group))]))

    def register(self, name: str, factory: FactoryT) -> None:
        """Make an entry known for as long as the program runs.

        Raises:
            UsageError: the name is taken or no name, or what is given cannot be an entry.
        """
        if name in self._own:
            raise UsageError(f"a {self._noun} named '{name}' exists already: choose another name.")
        self._own[name] = self._entry(name, factory, f"the {self._noun} '{name}' that was registered")

    def find(self, name: str) -> Entry[FactoryT]:
        """Return an entry by its name.

        Raises:
            UsageError: there is none of that name, or more than one, or a package's cannot be loaded; the sentence
                names package and entry point.
        """
        own = self._own.get(name)
        points = tuple(named_points(self._group).select(name=name))
        if len(points) + (own is not None) > 1:
            claims = [*(["geoprint itself"] if own is not None else []), *map(origin_of, points)]
            raise UsageError(f"the {self._noun} '{name}' is named more than once, by {' and '.join(claims)}: keep one.")
        if own is not None:
            return own
        if not points:
            raise UsageError(f"there is no {self._noun} named '{name}'; choose one of: {', '.join(self.names)}.")
        (point,) = points
        return self._entry(name, loaded(point, self._noun), f"the {self._noun} '{name}' from {origin_of(point)}")

    def _entry(self, name: str, factory: FactoryT, origin: str) -> Entry[FactoryT]:
        if not _NAME.fullmatch(name) or name == "all":
            raise UsageError(f"{origin} needs a name of small letters, digits and hyphens, other than 'all'.")
        lacking = [member for member in self._members if member not in dir(factory)]
        if not isinstance(factory, type) or lacking:
            found = f"its class lacks {', '.join(lacking)}" if isinstance(factory, type) else f"it is {factory!r}"
            raise UsageError(
                f"{origin} cannot be used: {found}; a {self._noun} is a class with {', '.join(self._members)}."
            )
        return Entry(name, factory, origin)


def _type_of(parameter: inspect.Parameter) -> str:
    return inspect.formatannotation(parameter.annotation)
