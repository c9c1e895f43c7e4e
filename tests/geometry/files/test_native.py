"""What is said of a worker that ends without a result: who is to blame for it."""

from __future__ import annotations

from pathlib import Path

import pytest

from geoprint.errors import InputError, UsageError
from geoprint.geometry.native import run_worker

MISSED = "libusb-1.0.so.0: cannot open shared object file: No such file or directory"


@pytest.mark.parametrize("error", [f"ImportError({MISSED!r})", f"OSError({MISSED!r})"])
def test_a_library_that_does_not_load_is_named_and_not_the_file_called_damaged(error: str, tmp_path: Path) -> None:
    script = tmp_path / "worker.py"
    script.write_text(f"def work(data):\n    raise {error}\n", encoding="utf-8")
    with pytest.raises(UsageError, match=r"`a\.ply` cannot be read: a library .* does not load .*libusb-1\.0\.so\.0"):
        run_worker(script, [], data=b"x", work="read", name="a.ply")


def test_what_a_worker_cannot_work_on_is_a_damaged_file(tmp_path: Path) -> None:
    script = tmp_path / "worker.py"
    script.write_text("def work(data):\n    raise ValueError('no points')\n", encoding="utf-8")
    with pytest.raises(InputError, match="damaged"):
        run_worker(script, [], data=b"x", work="read", name="a.ply")
