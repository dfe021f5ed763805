"""The hash by which host and board compare their programs."""

import os
from binascii import crc32

_PIECE = 512


def program_crc(board: str, shared: str) -> int:
    """The hash of the program, from the files of its two packages; a deployed program has another function."""
    board, shared = [path[: path.rindex("/")] for path in (board, shared)]
    return sources_crc(board, shared)


def sources_crc(board: str, shared: str) -> int:
    """crc32 over paths and contents of the Python files in and below both folders, in order of their paths."""
    crc = 0
    for folder in (board, shared):
        for path in sorted(_sources(folder)):
            crc = _file_crc(folder + path, crc32(path.encode(), crc))
    return crc


def _sources(folder: str) -> "list[str]":
    """Paths of the Python files, relative to the folder; a name without a dot is a folder."""
    found = []
    for name in os.listdir(folder):
        if name.endswith(".py"):
            found.append("/" + name)
        elif "." not in name:
            found += ["/" + name + path for path in _sources(folder + "/" + name)]
    return found


def _file_crc(path: str, crc: int) -> int:
    with open(path, "rb") as file:
        piece = file.read(_PIECE)
        while piece:
            crc = crc32(piece, crc)
            piece = file.read(_PIECE)
    return crc
