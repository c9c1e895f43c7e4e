"""A photograph as it is judged: grey values out of an image file, upright, and of a size that memory bears."""

from __future__ import annotations

import hashlib
import io
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, final

import numpy as np

from geoprint.errors import InputError, reason_of
from geoprint.model import FloatArray, freeze_arrays, frozen

if TYPE_CHECKING:
    from PIL.Image import Image


# What cameras and programs write; other readers of Pillow are not asked, because a file is not to be trusted.
FORMATS = ("JPEG", "PNG", "TIFF", "BMP")
# More take 8 bytes each, and a bead is no better seen [pixels].
MOST_PIXELS = 50_000_000
# Fewer a side hold no line and what lies beside it [pixels].
FEWEST_A_SIDE = 32
# No camera writes a larger file [bytes].
LARGEST_FILE = 400_000_000
# Grey values are a full scale of 8 or 16 bits.
_EIGHT, _SIXTEEN = 255.0, 65535.0
_WHAT_TO_GIVE = "give a photograph in grey or RGB as JPEG, PNG, TIFF or BMP"


@final
@frozen
class Photograph:
    """A photograph in grey.

    Pixels are named by (u, v), u to the right and v down, the centre of the first one at (0, 0).

    Attributes:
        name: of its file.
        grey: (h, w) 0 is black, 1 white.
        digest: SHA-256 of the file, in hexadecimal; empty where there is none.
        turned: whether the camera was held otherwise, and the picture has been turned upright.
    """

    name: str
    grey: FloatArray
    digest: str = ""
    turned: bool = False

    def __post_init__(self) -> None:
        sizes = freeze_arrays(self, grey="float: h w")
        check_size(self.name, width=sizes["w"], height=sizes["h"])
        low, high = float(self.grey.min()), float(self.grey.max())
        if low < 0.0 or high > 1.0:
            raise InputError(f"`{self.name}`: grey values are from {low:.3g} to {high:.3g}, allowed are 0 to 1.")

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [pixels]."""
        return self.grey.shape[1], self.grey.shape[0]


def read_photograph(path: Path | str) -> Photograph:
    """Read an image file; where the camera noted how it was held, the picture is turned upright.

    Colours become grey as [BT601] weighs them. Nothing is decoded before the size is known to be allowed.

    Raises:
        InputError: there is no such file, it is no image, cut short, too large or too small, or has colours of print.
    """
    path = Path(path)
    data = _content(path)
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            # Our own bound, below, is stricter than the one it warns of.
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data), formats=FORMATS) as image:
                check_size(path.name, width=image.width, height=image.height)
                _check_mode(path.name, image)
                image.load()
                upright = ImageOps.exif_transpose(image)
                grey = _grey(upright)
    except Image.DecompressionBombError as error:
        raise InputError(f"`{path.name}` is too large to be opened ({error}); scale it down.") from error
    except UnidentifiedImageError as error:
        raise InputError(f"`{path.name}` is not a readable image; {_WHAT_TO_GIVE}.") from error
    except InputError:
        raise
    except (OSError, SyntaxError, ValueError, TypeError, KeyError, EOFError, ArithmeticError) as error:
        raise InputError(
            f"`{path.name}` is cut short or damaged ({reason_of(error)}); copy it from the camera again."
        ) from error
    # A turn by any multiple of 90 degrees leaves the values and moves the first one, or swaps the sides.
    turned = _orientation(image) not in {0, 1}
    return Photograph(path.name, grey, hashlib.sha256(data).hexdigest(), turned)


def check_size(name: str, *, width: int, height: int) -> None:
    """Refuse a picture that is too large or too small to be judged.

    Args:
        name: of its file.
        width: [pixels]
        height: [pixels]

    Raises:
        InputError: it is.
    """
    if width * height > MOST_PIXELS:
        raise InputError(
            f"`{name}` has {width} x {height} pixels, at most {MOST_PIXELS / 1e6:.0f} million are judged; scale it "
            "down, or cut out the print.",
            pixels=width * height,
        )
    if min(width, height) < FEWEST_A_SIDE:
        raise InputError(
            f"`{name}` has {width} x {height} pixels, needed are at least {FEWEST_A_SIDE} a side; give the photograph "
            "as the camera wrote it.",
            pixels=width * height,
        )


def _content(path: Path) -> bytes:
    """Return the bytes of a file, if it is one and not too large."""
    try:
        if not path.is_file():
            raise InputError(f"there is no file `{path}`; check the name.")
        size = path.stat().st_size
        if size > LARGEST_FILE:
            raise InputError(
                f"`{path.name}` holds {size / 1e6:.0f} MB, a photograph at most {LARGEST_FILE / 1e6:.0f}; "
                f"{_WHAT_TO_GIVE}."
            )
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"`{path}` cannot be read ({error.strerror}); check its rights.") from error
    if not data:
        raise InputError(f"`{path.name}` is empty; copy it from the camera again.")
    return data


def _check_mode(name: str, image: Image) -> None:
    """Refuse what has no certain grey value."""
    if image.mode == "CMYK":
        raise InputError(f"`{name}` has the colours of print (CMYK), which no camera writes; save it as RGB.")
    if image.mode in {"I", "F", "LAB", "HSV", "YCbCr"}:
        raise InputError(
            f"`{name}` has values of the kind {image.mode}, without a stated black and white; {_WHAT_TO_GIVE}, of 8 "
            "or 16 bits."
        )


def _grey(image: Image) -> FloatArray:
    """Return (h, w) grey values from 0 to 1."""
    if image.mode.startswith("I;16"):
        return np.asarray(image, dtype=np.float64) / _SIXTEEN
    if image.mode in {"P", "PA"}:
        image = image.convert("RGBA")
    if image.mode in {"RGBA", "LA"} and image.getchannel("A").getextrema()[0] != _EIGHT:
        raise InputError("the image is partly transparent; save it without transparency.")
    return np.asarray(image.convert("L"), dtype=np.float64) / _EIGHT


def _orientation(image: Image) -> int:
    """Return how the camera was held, as EXIF counts it: 1 is upright, 0 where nothing is said."""
    orientation = 0x0112
    held = image.getexif().get(orientation, 0)
    return held if isinstance(held, int) else 0
