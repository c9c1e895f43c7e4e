"""The project's own code base, whose many files are read once in a run of the tests."""

from __future__ import annotations

from benchmarks.code_base import CodeBase
from tests.shared_plans import SharedPlans


def whole_code_base(shared_plans: SharedPlans) -> CodeBase:
    """Return the code base with its modules."""
    return shared_plans.value("code base", _read)


def _read() -> CodeBase:
    code_base = CodeBase()
    # They are kept with it once they were asked for.
    assert code_base.modules
    return code_base
