"""What the library toppra finds for the same path: a second solver of TOPP-RA, asked where it is installed."""

from __future__ import annotations

import importlib.util
import logging
import sys
import warnings
from importlib import import_module
from types import SimpleNamespace
from typing import TYPE_CHECKING, final

import numpy as np

from geoprint.errors import UsageError, VerificationError, percent
from geoprint.lazy import postponed
from geoprint.model import FloatArray, frozen
from geoprint.robot.timing.reachability import Problem

if TYPE_CHECKING:
    from types import ModuleType

    from toppra.constraint import ConstraintType


# By how much of the highest ceiling speeds may be above those that toppra finds, whose tolerances are absolute: on
# real paths the two mostly differ by 1e-6 of it.
AGREEMENT = 1e-3
# toppra gets a unit of time in which the highest ceiling is this speed [m/unit], and lengths in metres: in millimetres
# it often fails.
UNIT_SPEED = 0.1
# What a plan says of its speeds where no second solver confirms them.
UNCONFIRMED_SPEEDS = "the speeds, by a second library: toppra is not installed"


def is_installed() -> bool:
    """Say whether there is a second solver."""
    return importlib.util.find_spec("toppra") is not None


def unconfirmed_speeds() -> tuple[str, ...]:
    """Return what a plan is to say of its speeds where no second solver confirms them."""
    return () if is_installed() else (UNCONFIRMED_SPEEDS,)


def confirm(problem: Problem, speeds: FloatArray) -> bool:
    """Ask toppra about a problem, and compare its answer with (g,) speeds [m/s] wherever they are below their ceilings.

    Most of them must not be above it. Single ones may be: the largest speed at one point may leave next to none at the
    following one, and there the two solvers part by their rounding.

    Returns:
        Whether toppra found a motion; on rough paths it may find none, and has no say.

    Raises:
        VerificationError: toppra finds lower speeds.
        UsageError: toppra is installed and cannot be imported.
    """
    found = _speeds_of_toppra(problem)
    bounded = speeds < (1.0 - AGREEMENT) * problem.highest
    if found is None:
        return False
    above = float(np.median(speeds[bounded] - found[bounded])) / float(problem.highest.max()) if bounded.any() else 0.0
    if above > AGREEMENT:
        raise VerificationError(
            f"toppra finds a lower speed than geoprint where joints limit it, by {percent(above, 1)} of the largest. "
            "Please report it with the part and the cell file."
        )
    return True


def _speeds_of_toppra(problem: Problem) -> FloatArray | None:
    toppra = _toppra()
    unit = UNIT_SPEED / float(problem.highest.max())
    constraint = _Constraint(
        toppra.constraint.ConstraintType.CanonicalLinear,
        np.hstack([problem.pull, -problem.pull]),
        np.hstack([problem.square, -problem.square]),
        np.tile(problem.bounds, 2) * unit**2,
        (problem.highest * unit) ** 2,
    )
    found: FloatArray | None
    _, found, _ = toppra.algorithm.TOPPRA(
        [constraint], SimpleNamespace(path_interval=(problem.grid[0], problem.grid[-1])), gridpoints=problem.grid,
        solver_wrapper="seidel", parametrizer="ParametrizeConstAccel",
    ).compute_parameterization(problem.start * unit, problem.end * unit)  # fmt: skip
    return found / unit if found is not None and np.isfinite(found).all() else None


@final
@frozen
class _Constraint:
    """All limits of one leg in the form that TOPP-RA asks for: pull * u + square * x <= bounds, x <= highest."""

    constraint_type: ConstraintType
    pull: FloatArray
    square: FloatArray
    bounds: FloatArray
    highest: FloatArray
    identical: bool = True

    def get_constraint_type(self) -> ConstraintType:
        """Return the kind of the constraint: linear."""
        return self.constraint_type

    def compute_constraint_params(self, *_: object) -> tuple[FloatArray | None, ...]:
        """Return a, b, c, F, g, bounds of u, bounds of x, as `toppra.constraint.LinearConstraint` defines them."""
        offset = np.zeros_like(self.pull)
        squares = np.column_stack([np.zeros_like(self.highest), self.highest])
        return self.pull, self.square, offset, np.eye(self.bounds.size), self.bounds, None, squares


def _toppra() -> ModuleType:
    """Import toppra: late, without the pyplot that it never needs here; quiet, for its docstrings and log are not."""
    try:
        if "toppra" not in sys.modules:
            with warnings.catch_warnings(), postponed("matplotlib", "matplotlib.pyplot"):
                warnings.simplefilter("ignore")
                import_module("toppra")
    except ImportError as error:
        raise UsageError(
            f"toppra is installed but cannot be imported ({error}). Run 'pip install --force-reinstall toppra', or "
            "uninstall it: plans then state that their speeds are not confirmed."
        ) from error
    logging.getLogger("toppra").setLevel(logging.CRITICAL)
    return import_module("toppra")
