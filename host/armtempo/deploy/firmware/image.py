"""A built firmware: the pieces of the flash and what they are, in a folder or in a zip file of it."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from armtempo.basics import json_text
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


def find(here: Path) -> Path:
    """The only firmware in a folder, built or downloaded; InputError if there is none, or more than one."""
    found = [path.parent for path in here.glob(f"*/{ABOUT}")] + [*here.glob("armtempo-firmware-*.zip")]
    if len(found) == 1:
        return found[0]
    get = "build one with 'armtempo firmware'; 'armtempo help firmware' says how"
    if not found:
        raise InputError(
            "no firmware given, and none found here", f"{get}; then: 'armtempo flash --image FILE'"
        )
    raise InputError(
        f"{len(found)} firmwares found here: {', '.join(map(str, sorted(found)))}", "choose one with --image"
    )


@contextmanager
def unpacked(path: Path) -> Iterator[Path]:
    """The folder of a firmware; for a zip file one that goes with the context. InputError if it is no zip file."""
    if path.is_dir():
        yield path
        return
    with TemporaryDirectory(prefix="armtempo-firmware-") as name:
        try:
            with zipfile.ZipFile(path) as archive:
                archive.extractall(name)
        except FileNotFoundError:
            raise InputError(f"{path}: no such file or folder", "check the path") from None
        except (OSError, zipfile.BadZipFile) as error:
            raise InputError(f"{path} is not a complete zip file: {error}", "download it again") from None
        inner = [about.parent for about in Path(name).rglob(ABOUT)]
        yield inner[0] if inner else Path(name)


def read(folder: Path) -> Image:
    """The firmware in a folder; InputError if there is none, or not a whole one."""
    try:
        found: dict[str, Any] = json_text.loads((folder / ABOUT).read_text(encoding="utf-8"))
        pieces = tuple(
            Piece(Path(piece["file"]).name, int(piece["address"], 16)) for piece in found["pieces"]
        )
        image = Image(**found | {"program_crc": int(found["program_crc"], 16), "pieces": pieces})
    except FileNotFoundError:
        raise InputError(
            f"{folder} contains no firmware (no {ABOUT})", "make one with 'armtempo firmware'"
        ) from None
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{folder / ABOUT} cannot be read: {error}", "build the firmware anew") from None
    missing = [piece.file for piece in pieces if not (folder / piece.file).is_file()]
    if missing or not pieces:
        raise InputError(
            f"{folder} is incomplete: {', '.join(missing) or 'no pieces'}", "build the firmware anew"
        )
    return image
