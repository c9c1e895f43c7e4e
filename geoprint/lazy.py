"""What is imported when it is first used: names of a package of ours, modules that a library of others imports."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from types import MappingProxyType, ModuleType
from typing import Any, TypeAlias

Getter: TypeAlias = Callable[[str], object]
Lister: TypeAlias = Callable[[], list[str]]


def attached(package: str, *, modules: str, names: Mapping[str, str] = MappingProxyType({})) -> tuple[Getter, Lister]:
    """Return `__getattr__` and `__dir__` of a package; where it has `__all__`, only that and its modules are listed.

    Args:
        package: its name.
        modules: names of modules that are attributes of it without anybody importing them, with spaces between.
        names: by module of the package, what else is; `one=other` where it is called `other` there.
    """
    own, others = modules.split(), dict[str, tuple[str, str]]()
    for module, held in names.items():
        for each in held.split():
            name, _, there = each.partition("=")
            others[name] = module, there or name

    def get(name: str) -> object:
        if name in own:
            return import_module(f"{package}.{name}")
        if name not in others:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        module, there = others[name]
        return getattr(import_module(f"{package}.{module}"), there)

    def listed() -> list[str]:
        bound = vars(sys.modules[package]).keys() - {"__getattr__", "__dir__"}
        return sorted({*own, *others, *(name for name in bound if "__all__" not in bound or name.startswith("__"))})

    return get, listed


def above(module: str, name: str) -> Any:
    """Return a function of a module that stands above what asks for it, and is imported when that happens.

    A result answers what people ask of it, how it looks and how it is written, by what is made of results.
    """
    return getattr(import_module(module), name)


@contextmanager
def postponed(package: str, *modules: str) -> Generator[None]:
    """Let what is imported meanwhile find stand-ins, which import the modules when they are first asked for a name.

    toppra imports pyplot to draw what nobody asks it to draw. Behind this, whoever imports the modules gets them.

    Args:
        package: of the modules; where it is missing, or somebody has imported it, nothing changes.
        *modules: of it, by their whole names.
    """
    if package in sys.modules or find_spec(package) is None:
        yield
        return
    standing = dict[str, ModuleType]()
    standing |= {name: _stand_in(name, standing) for name in (package, *modules)}
    for name in modules:
        setattr(standing[package], name.removeprefix(f"{package}."), standing[name])
    sys.modules.update(standing)
    try:
        yield
    finally:
        _step_aside(standing)


def _stand_in(name: str, standing: Mapping[str, ModuleType]) -> ModuleType:
    """Return what stands for a module, one of several that step aside together."""
    module = ModuleType(name)

    def get(attribute: str) -> object:
        if attribute.startswith("__"):
            # The machinery of imports asks for these, and does without.
            raise AttributeError(f"module '{name}' has no attribute '{attribute}' yet")
        _step_aside(standing)
        return getattr(import_module(name), attribute)

    setattr(module, "__getattr__", get)  # noqa: B010  (to the type checker a module has no such attribute)
    return module


def _step_aside(standing: Mapping[str, ModuleType]) -> None:
    for name, module in standing.items():
        if sys.modules.get(name) is module:
            del sys.modules[name]
