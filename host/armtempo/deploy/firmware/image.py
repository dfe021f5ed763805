"""A built firmware as a folder: the pieces of the flash, and what they are."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from armtempo.basics.errors import InputError

ABOUT = "firmware.json"


@dataclass(frozen=True)
class Piece:
    """A file that goes to one address of the flash."""

    file: str
    address: int


@dataclass(frozen=True)
class Image:
    """``machine``: what the firmware says it runs on. ``program_crc``: hash of the program in it."""

    board: str
    machine: str
    micropython: str
    compiler: str
    program_crc: int
    pieces: tuple[Piece, ...]


def about(image: Image) -> bytes:
    """The content of ABOUT."""
    content = asdict(image) | {"program_crc": f"{image.program_crc:08x}"}
    content["pieces"] = [{"file": piece.file, "address": f"{piece.address:#010x}"} for piece in image.pieces]
    return f"{json.dumps(content, indent=1)}\n".encode()


def read(folder: Path) -> Image:
    """The firmware in a folder; InputError where there is none, or not a whole one."""
    try:
        found: dict[str, Any] = json.loads((folder / ABOUT).read_text(encoding="utf-8"))
        pieces = tuple(
            Piece(Path(piece["file"]).name, int(piece["address"], 16)) for piece in found["pieces"]
        )
        image = Image(**found | {"program_crc": int(found["program_crc"], 16), "pieces": pieces})
    except FileNotFoundError:
        raise InputError(
            f"{folder} holds no firmware (no {ABOUT})", "make one with 'armtempo firmware'"
        ) from None
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{folder / ABOUT} cannot be read: {error}", "build the firmware anew") from None
    missing = [piece.file for piece in pieces if not (folder / piece.file).is_file()]
    if missing or not pieces:
        raise InputError(
            f"{folder} is not whole: {', '.join(missing) or 'no pieces'}", "build the firmware anew"
        )
    return image
