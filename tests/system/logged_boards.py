"""Virtual boards whose edges are logged: which pins have moved, and whether the drivers ever were on."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from armtempo.basics.errors import ArmtempoError
from armtempo.encoding import encode
from armtempo.model.arm import Arm
from armtempo.simulator import LaunchOptions, edgelog, launch

from tests import interpreters
from tests.system import commandline

INTERPRETER = interpreters.starter("micropython" if "micropython" in interpreters.AVAILABLE else "cpython")
ENABLE = "E12"


@contextmanager
def board(folder: Path, record: Arm = commandline.ARM, **options: Any) -> Iterator[str]:
    """The port of a virtual board that is set up for an arm, the paper's; its edges go to ``folder/edges``."""
    flash = folder / "flash" / "armtempo"
    flash.mkdir(parents=True)
    (flash / "arm.ata").write_bytes(encode.arm_record(record))
    with launch(
        LaunchOptions(flash.parent, interpreter=INTERPRETER, edge_log=folder / "edges", **options)
    ) as process:
        yield process.port


def rises(folder: Path, pin: str) -> int:
    """Rising edges of a pin since power-up, over all resets."""
    return sum(
        int(np.sum(session.pins[pin][1] == 1))
        for session in edgelog.read(folder / "edges")
        if pin in session.pins
    )


def starts(folder: Path) -> int:
    """How often the board has started; 0 while a record is being written."""
    with suppress(ValueError, OSError, ArmtempoError):
        return len(edgelog.read(folder / "edges"))
    return 0


def is_enabled(folder: Path) -> bool:
    """Whether the drivers ever were on; ENABLE of the paper's arm is active low."""
    return any(
        bool(np.any(session.pins[ENABLE][1] == 0))
        for session in edgelog.read(folder / "edges")
        if ENABLE in session.pins
    )
