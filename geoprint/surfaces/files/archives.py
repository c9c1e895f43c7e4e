"""Reading single entries of ZIP archives without trusting what the archive says of itself.

Nothing is unpacked to disk. An entry is read only if it is not huge, not packed so tightly that it can only be a bomb,
not encrypted, and stands under a name that stays inside the archive.
"""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Collection
from io import BytesIO
from pathlib import PurePosixPath

from geoprint.errors import InputError

# Largest entry that is unpacked [bytes]: 20 million triangles of a binary STL.
LARGEST_ENTRY = 1 << 30
# Text meshes pack 3 to 20 times; a file of zeros packs 1000 times.
LARGEST_RATIO = 100
# A mesh has one entry, a 3MF package some dozens.
MOST_ENTRIES = 1000


def open_archive(data: bytes, *, name: str) -> zipfile.ZipFile:
    """Open an archive held in memory.

    Raises:
        InputError: it is damaged, has very many entries, or one whose name leads out of it.
    """
    try:
        archive = zipfile.ZipFile(BytesIO(data))
    except (zipfile.BadZipFile, ValueError, OSError, NotImplementedError) as error:
        raise InputError(
            f"`{name}` is not a ZIP archive that can be opened ({error}); copy or pack it again."
        ) from error
    entries = archive.infolist()
    if len(entries) > MOST_ENTRIES:
        raise InputError(
            f"`{name}` is an archive of {len(entries)} entries, at most {MOST_ENTRIES} are allowed; pack the mesh "
            "alone."
        )
    for entry in entries:
        path = PurePosixPath(entry.filename.replace("\\", "/"))
        if path.is_absolute() or ".." in path.parts or not entry.filename.isprintable() or ":" in entry.filename:
            raise InputError(
                f"`{name}` has an entry {entry.filename!r}, whose name leads out of the archive or cannot be printed; "
                "do not use this archive."
            )
    return archive


def read_entry(archive: zipfile.ZipFile, entry: str, *, name: str) -> bytes:
    """Unpack one entry in memory.

    Args:
        archive: from `open_archive`.
        entry: its name in the archive.
        name: of the archive, for messages.

    Raises:
        InputError: it is missing, encrypted, damaged, larger than LARGEST_ENTRY, or packed tighter than LARGEST_RATIO.
    """
    try:
        info = archive.getinfo(entry)
    except KeyError as error:
        raise InputError(f"`{name}` refers to `{entry}`, which is not in it; export it again.") from error
    if info.file_size > LARGEST_ENTRY or info.file_size > LARGEST_RATIO * max(info.compress_size, 1):
        raise InputError(
            f"`{name}`: `{entry}` would unpack from {info.compress_size} to {info.file_size} bytes; at most "
            f"{LARGEST_RATIO} times its packed size and {LARGEST_ENTRY >> 20} MiB are allowed, so unpack it yourself "
            "if you trust it.",
            packed=info.compress_size,
            unpacked=info.file_size,
        )
    try:
        # zipfile reads no more than the size that was checked above, and then compares the checksum.
        return archive.read(info)
    except (zipfile.BadZipFile, zlib.error, RuntimeError, NotImplementedError, OSError, EOFError, ValueError) as error:
        raise InputError(f"`{name}`: `{entry}` cannot be unpacked ({error}); copy or pack it again.") from error


def only_mesh(data: bytes, *, suffixes: Collection[str], name: str) -> tuple[str, bytes]:
    """Return the one mesh of an archive.

    Args:
        data: content of the archive.
        suffixes: in lower case, of files that are meshes; an archive in the archive is none.
        name: of the archive.

    Returns:
        Suffix and content of its mesh.

    Raises:
        InputError: as `open_archive` and `read_entry`; or it holds no mesh, or several.
    """
    archive = open_archive(data, name=name)
    # macOS packs a second file of attributes beside each, of the same name.
    entries = [entry for entry in archive.namelist() if not entry.startswith("__MACOSX/")]
    meshes = [entry for entry in entries if PurePosixPath(entry).suffix.lower() in suffixes]
    if len(meshes) != 1:
        found = f"{len(meshes)} meshes ({', '.join(meshes[:3])})" if meshes else "no mesh"
        raise InputError(
            f"`{name}` holds {found}; an archive must hold one of {', '.join(suffixes)}, so unpack it and give the "
            "file."
        )
    return PurePosixPath(meshes[0]).suffix.lower(), read_entry(archive, meshes[0], name=name)
