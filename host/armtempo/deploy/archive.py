"""The compiled modules of the board program as one file, each deflated: what the board's ``archive.py`` reads."""

from __future__ import annotations

import zlib
from collections.abc import Collection, Mapping

_WINDOW_BITS = 10
"""Memory that the board needs while it imports a module: 1 KB and 1.4 KB for the decoder."""


def pack(files: Mapping[str, bytes], plain: Collection[str]) -> bytes:
    """The archive of files by their path from the library's folder on; those of ``plain`` are not deflated."""
    packed = {path: data if path in plain else _deflated(data) for path, data in files.items()}
    index = ""
    while True:  # as offsets grow in length with the index
        at = 2 + len(index)
        lines = []
        for path, data in packed.items():
            name = path.removeprefix("armtempo_").removesuffix(".mpy")
            lines.append(f"\n{name} {-at if path in plain else at}")
            at += len(data)
        made = "".join(lines) + "\n"
        if len(made) == len(index):
            return len(made).to_bytes(2, "little") + made.encode() + b"".join(packed.values())
        index = made


def _deflated(data: bytes) -> bytes:
    compressor = zlib.compressobj(9, zlib.DEFLATED, -_WINDOW_BITS, 9)
    return compressor.compress(data) + compressor.flush()
