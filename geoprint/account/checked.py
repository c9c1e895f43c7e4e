"""A bundle that was read back and checked, and what was found wrong with it."""

from __future__ import annotations

from pathlib import Path
from typing import final

from geoprint.account.records.plan import PlanRecord
from geoprint.export import Orders, Setup
from geoprint.export.rapid import Executed, Settings, Timeline
from geoprint.model import comparable, frozen


@final
@comparable
class Finding:
    """Something that is wrong: in which file and line (from 1), and why."""

    file: str
    line: int
    reason: str


@final
@frozen
class Checked:
    """A bundle that was checked.

    Attributes:
        folder: where it stands.
        findings: what is wrong; empty where it is as it was planned.
        told: the content of plan.json, or None where it cannot be read.
        setup: the cell, or None where it cannot be read.
        orders: the targets, or None where they cannot be read.
        settings: how the program is set to run, or None where the program is not the plan's.
        switching: what flows when, or None where the program is not the plan's.
        executed: what of the program was executed, or None where it does not run.
    """

    folder: Path
    findings: tuple[Finding, ...]
    told: PlanRecord | None
    setup: Setup | None
    orders: Orders | None
    settings: Settings | None
    switching: Timeline | None
    executed: Executed | None
