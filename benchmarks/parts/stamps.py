"""A word in a picture's file on what it was drawn from, so that a test notices when that has changed since."""

from __future__ import annotations

import hashlib
import zlib

# Of PNG [ISO 15948]: a signature, then chunks of length, name, content and check sum; the header is the first.
HEADER_END = 8 + 4 + 4 + 13 + 4
KEYWORD = b"Comment\0"


def stamp(figures: str) -> str:
    """Return what a picture says of the text of the figures that it was drawn with."""
    return f"figures {hashlib.sha256(figures.encode()).hexdigest()[:16]}"


def stamped(png: bytes, text: str) -> bytes:
    """Return a PNG with a comment behind its header."""
    chunk = b"tEXt" + KEYWORD + text.encode("latin-1")
    packed = (len(chunk) - 4).to_bytes(4, "big") + chunk + zlib.crc32(chunk).to_bytes(4, "big")
    return png[:HEADER_END] + packed + png[HEADER_END:]


def stamp_of(png: bytes) -> str | None:
    """Return the comment behind the header of a PNG, or None where there is none."""
    length, name = int.from_bytes(png[HEADER_END : HEADER_END + 4], "big"), png[HEADER_END + 4 : HEADER_END + 8]
    content = png[HEADER_END + 8 : HEADER_END + 8 + length]
    return content.removeprefix(KEYWORD).decode("latin-1") if name == b"tEXt" and content.startswith(KEYWORD) else None
