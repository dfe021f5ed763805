"""The archive of compiled modules of the board program, each deflated, for the board's ``archive.py``."""

from __future__ import annotations

import zlib
from collections.abc import Collection, Mapping

_WINDOW_BITS = 9
"""Window (0.5 KB) for modules imported with little memory; the decoder needs another 1.3 KB."""
_WIDE_BITS = 13
"""Window (8 KB) for modules imported with enough memory."""


def pack(files: Mapping[str, bytes], wide: Collection[str]) -> bytes:
    """The archive of files by their path from the library's folder on.

    ``wide``: imported while the heap is empty.
    """
    packed = {path: _deflated(data, path in wide) for path, data in files.items()}
    index = ""
    while True:  # as offsets grow in length with the index
        at = 2 + len(index)
        lines = []
        for path, data in packed.items():
            lines.append(f"\n{path.removeprefix('armtempo_').removesuffix('.mpy')} {at}")
            at += len(data)
        made = "".join(lines) + "\n"
        if len(made) == len(index):
            return len(made).to_bytes(2, "little") + made.encode() + b"".join(packed.values())
        index = made


def _deflated(data: bytes, is_wide: bool) -> bytes:
    """With zlib's header, which tells the board the window."""
    compressor = zlib.compressobj(9, zlib.DEFLATED, _WIDE_BITS if is_wide else _WINDOW_BITS, 9)
    return compressor.compress(data) + compressor.flush()
