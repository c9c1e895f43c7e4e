"""Work shared with processes beside this one: the same is found, arrays stay read-only, and ends are told."""

from __future__ import annotations

import os
from collections.abc import Generator
from pathlib import Path

import numpy as np
import pytest

from geoprint.config import job_of
from geoprint.errors import InputError, ResourceError
from geoprint.geometry.files import save_ply
from geoprint.model import FloatArray
from geoprint.results import Comparison
from geoprint.workflow import compare_parts, save_comparisons
from geoprint.workflow.processes import OtherProcesses, beside
from tests.meshes import spherical_cap


def squares(number: int) -> FloatArray:
    values = np.array([number * number, os.getpid()], dtype=np.float64)
    values.flags.writeable = False
    return values


def ended(number: int) -> int:
    if number:
        os._exit(1)
    return number


def refused(number: int) -> int:
    if number:
        raise InputError(f"{number} is refused", number=number)
    return number


@pytest.fixture(scope="module")
def helper() -> Generator[OtherProcesses]:
    """A process beside this one, for all tests that do not end it."""
    with beside(1) as helper:
        assert helper is not None
        yield helper


def test_work_is_shared_in_turn_and_what_is_found_stays_read_only(helper: OtherProcesses) -> None:
    found = helper.shared(squares, [3, 4, 5], here=squares)

    assert [value[0] for value in found] == [9.0, 16.0, 25.0]
    here = [value[1] == os.getpid() for value in found]
    assert here == [True, False, True]
    assert not any(value.flags.writeable for value in found)


def test_without_processes_beside_there_is_no_helper() -> None:
    with beside(0) as helper:
        assert helper is None


def test_a_process_that_is_ended_from_outside_is_told_as_want_of_memory() -> None:
    with beside(1) as helper:
        assert helper is not None
        with pytest.raises(ResourceError, match="out of memory"):
            helper.shared(ended, [0, 1], here=ended)


def test_a_refusal_beside_keeps_its_sentence_and_its_details(helper: OtherProcesses) -> None:
    with pytest.raises(InputError, match="1 is refused") as caught:
        helper.shared(refused, [0, 1], here=refused)
    assert caught.value.details["number"] == 1


def test_backends_that_are_planned_in_two_processes_give_the_same_bytes(helper: OtherProcesses, tmp_path: Path) -> None:
    save_ply(spherical_cap(radius=30.0, angle=0.15, rings=3), tmp_path / "cap.ply")
    job = job_of(surface=tmp_path / "cap.ply", unit="mm", spacing=3.0, place="demo")
    files: list[dict[str, bytes]] = []
    for asked in (None, helper):
        folder = tmp_path / ("one" if asked is None else "two")
        compared = compare_parts([job], backends=["fast-marching", "heat"], helper=asked)
        (one,) = compared
        assert isinstance(one, Comparison)
        assert all(outcome.not_printable is None for _, outcome in one.planned)
        save_comparisons(compared, folder, helper=asked)
        files.append({
            path.relative_to(folder).as_posix(): path.read_bytes()
            for path in folder.rglob("*")
            if path.is_file() and path.name != "timings.json"
        })  # fmt: skip

    assert len(files[0]) > 10
    assert files[0] == files[1]
