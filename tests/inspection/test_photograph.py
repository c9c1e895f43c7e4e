"""Hostile image files are refused in one sentence, and honest ones of every kind read alike."""

from __future__ import annotations

import io
import struct
import tracemalloc
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from geoprint.errors import InputError
from geoprint.inspection import Photograph, read_photograph
from tests.shared_data import shared

RAMP = np.linspace(0, 255, 48 * 40).reshape(40, 48).astype(np.uint8)


def saved(path: Path, image: Image.Image, **options: object) -> Path:
    image.save(path, **options)  # pyright: ignore[reportArgumentType]
    return path


@pytest.mark.parametrize("name", ["ramp.png", "ramp.tiff", "ramp.bmp"])
def test_lossless_files_have_the_values_that_were_written(tmp_path: Path, name: str) -> None:
    found = read_photograph(saved(tmp_path / name, Image.fromarray(RAMP)))
    assert np.array_equal(found.grey, RAMP / 255.0)
    assert (found.size, found.turned, found.name) == ((48, 40), False, name)


def test_sixteen_bits_are_read_with_all_of_them(tmp_path: Path) -> None:
    fine = (np.linspace(0, 65535, 48 * 40).reshape(40, 48)).astype(np.uint16)
    found = read_photograph(saved(tmp_path / "fine.png", Image.fromarray(fine)))
    assert np.abs(found.grey - fine / 65535.0).max() < 1e-9


def test_colours_become_grey_and_palettes_too(tmp_path: Path) -> None:
    colours = np.stack([RAMP, RAMP // 2, 255 - RAMP], axis=2)
    image = Image.fromarray(colours)
    expected = colours @ [0.299, 0.587, 0.114] / 255.0
    assert np.abs(read_photograph(saved(tmp_path / "c.png", image)).grey - expected).max() < 0.01
    assert np.abs(read_photograph(saved(tmp_path / "p.png", image.quantize(255))).grey - expected).max() < 0.08


@pytest.mark.parametrize(
    ("orientation", "upright"),
    [(1, RAMP), (3, RAMP[::-1, ::-1]), (6, np.rot90(RAMP, -1)), (8, np.rot90(RAMP, 1)), (2, RAMP[:, ::-1])],
)
def test_a_camera_that_was_held_otherwise_is_turned_upright(
    tmp_path: Path, orientation: int, upright: np.ndarray[tuple[int, ...], np.dtype[np.uint8]]
) -> None:
    exif = Image.Exif()
    exif[0x0112] = orientation
    found = read_photograph(saved(tmp_path / "turned.png", Image.fromarray(RAMP), exif=exif))
    assert np.array_equal(found.grey, upright / 255.0)
    assert found.turned == (orientation != 1)


def bytes_of(image: Image.Image, kind: str) -> bytes:
    written = io.BytesIO()
    image.save(written, format=kind)
    return written.getvalue()


def huge_png(width: int, height: int) -> bytes:
    """A PNG of a few bytes that claims to hold many pixels."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    packed = zlib.compress(b"\0" * 1000)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", packed) + chunk(b"IEND", b"")


JPEG = bytes_of(Image.fromarray(np.tile(RAMP, (4, 4))), "JPEG")
PNG = bytes_of(Image.fromarray(np.random.default_rng(1).integers(0, 255, (90, 90)).astype(np.uint8)), "PNG")


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"", "`bad.jpg` is empty"),
        (b"GIF89a" + b"\0" * 50, "is not a readable image"),
        (b"solid part\n", "is not a readable image"),
        (JPEG[: len(JPEG) // 2], "cut short or damaged"),
        (JPEG[:30], "is not a readable image|cut short or damaged"),
        (PNG[: len(PNG) // 2], "cut short or damaged"),
        (PNG[:60] + b"\xff" * 40 + PNG[100:], "cut short or damaged"),
        (bytes_of(Image.new("CMYK", (64, 64)), "JPEG"), r"colours of print \(CMYK\)"),
        (bytes_of(Image.new("F", (64, 64)), "TIFF"), "values of the kind F"),
        (bytes_of(Image.new("RGBA", (64, 64), (9, 9, 9, 7)), "PNG"), "partly transparent"),
        (bytes_of(Image.new("L", (64, 8)), "PNG"), "has 64 x 8 pixels, needed are at least 32 a side"),
        (huge_png(10_000, 10_000), "has 10000 x 10000 pixels, at most 50 million"),
        (huge_png(60_000, 60_000), "too large|at most 50 million"),
    ],
)
def test_what_is_no_photograph_is_refused(tmp_path: Path, content: bytes, complaint: str) -> None:
    path = tmp_path / "bad.jpg"
    path.write_bytes(content)
    with pytest.raises(InputError, match=complaint):
        read_photograph(path)


def test_a_hundred_million_pixels_are_refused_before_they_take_memory(tmp_path: Path) -> None:
    path = tmp_path / "large.png"
    path.write_bytes(huge_png(10_000, 10_000))
    tracemalloc.start()
    try:
        with pytest.raises(InputError):
            read_photograph(path)
        assert tracemalloc.get_traced_memory()[1] < 5_000_000
    finally:
        tracemalloc.stop()


def test_folders_and_names_that_are_not_there_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no file"):
        read_photograph(tmp_path)
    with pytest.raises(InputError, match="there is no file"):
        read_photograph(tmp_path / "nowhere.jpg")


def test_values_beyond_black_and_white_are_refused() -> None:
    with pytest.raises(InputError, match="allowed are 0 to 1"):
        Photograph("x", np.full((40, 40), 1.2))


@pytest.mark.parametrize("name", ["fdmpore_sample_1_raw.jpg", "fdmpore_sample_2_annotated.jpg"])
def test_other_photographs_are_read(name: str) -> None:
    assert read_photograph(shared(f"images/{name}")).size == (640, 640)
