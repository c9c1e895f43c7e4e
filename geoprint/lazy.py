"""Names that a package imports when they are first used, so that importing the package itself takes no time."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from types import MappingProxyType
from typing import TypeAlias

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
