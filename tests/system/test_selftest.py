"""``armtempo selftest`` on virtual boards; nothing in it may move a motor."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo import connect
from armtempo.basics.errors import LinkError
from armtempo.records import encode
from armtempo.simulator import LaunchOptions, edgelog, launch

from tests import interpreters
from tests.system import boards, commandline

INTERPRETER = interpreters.starter("micropython" if "micropython" in interpreters.AVAILABLE else "cpython")
ENABLE, STEPS = "E12", ("A15", "A1", "B10")


@contextmanager
def board(folder: Path, **options: Any) -> Iterator[str]:
    """The port of a virtual board that is set up for the paper's arm; its edges go to ``folder/edges``."""
    flash = folder / "flash" / "armtempo"
    flash.mkdir(parents=True)
    (flash / "arm.ata").write_bytes(encode.arm_record(boards.ARM))
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


def is_enabled(folder: Path) -> bool:
    """Whether the drivers ever were on; ENABLE of the paper's arm is active low."""
    return any(
        bool(np.any(session.pins[ENABLE][1] == 0))
        for session in edgelog.read(folder / "edges")
        if ENABLE in session.pins
    )


def selftest(port: str, folder: Path) -> tuple[int, dict[str, Any]]:
    """Exit code and JSON document of the command."""
    done = commandline.run("selftest", "--port", port, "--json", folder=folder)
    return done.exit_code, json.loads(done.output)


def words(found: dict[str, Any], verdict: str) -> list[str]:
    """The lines with that verdict."""
    return [f"{one['part']}: {one['what']}" for one in found["lines"] if one["verdict"] == verdict]


def test_a_sound_board_passes(tmp_path: Path) -> None:
    with board(tmp_path) as port:
        code, found = selftest(port, tmp_path)
    assert (code, words(found, "wrong")) == (0, []), found
    assert found["simulated"]
    assert {one["part"] for one in found["lines"]} >= {"drivers", "board", "cycles", "memory", "link"}
    assert not is_enabled(tmp_path)


def test_with_drivers_on_nothing_is_done(tmp_path: Path) -> None:
    """The drivers hold a homed arm: it is refused, and the arm is held and homed as before."""
    with board(tmp_path) as port, connect(port) as used:
        used.home(boards.ARM)
        used.goto(np.array(boards.ARM.home_deg) + 1.0)
        steps = used.status().positions
        with pytest.raises(LinkError, match="drivers are on"):
            used.selftest()
        assert (used.status().state, used.status().positions) == ("idle", steps)
