"""The hash by which host and board compare the program that each has."""

import os
from binascii import crc32

STAMP = "program.txt"
"""File in the board package, written last by a deployment: the hash of the sources, 8 hex digits.

Where it is missing the hash is taken from the source files that are there."""
_PIECE = 512


def program_crc(board: str, shared: str) -> int:
    """The hash of the program in two package folders; that of the stamp where there is one."""
    try:
        with open(board + "/" + STAMP) as file:
            return int(file.read().strip(), 16)
    except (OSError, ValueError):
        return sources_crc(board, shared)


def sources_crc(board: str, shared: str) -> int:
    """crc32 over names and contents of the Python files in both folders, in order of their names."""
    crc = 0
    for folder in (board, shared):
        for name in sorted(os.listdir(folder)):
            if name.endswith(".py"):
                crc = _file_crc(folder + "/" + name, crc32(name.encode(), crc))
    return crc


def _file_crc(path: str, crc: int) -> int:
    with open(path, "rb") as file:
        piece = file.read(_PIECE)
        while piece:
            crc = crc32(piece, crc)
            piece = file.read(_PIECE)
    return crc
