"""Measured figures: every number in the README comes out of a script here. Public API only."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[1]
DATA = ROOT / "data"
