"""The real mpremote against a virtual board whose program is running."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import LinkError
from armtempo.encoding import encode, encoded_plan
from armtempo.link import Client, open_board
from armtempo.planning import point_to_point
from armtempo.robot import arm_state
from armtempo.simulator import LaunchOptions, edgelog, launch
from mpremote.transport import TransportError
from mpremote.transport_serial import SerialTransport

from tests import interpreters
from tests.system import commandline

INTERPRETER = interpreters.starter("micropython" if "micropython" in interpreters.AVAILABLE else "cpython")
HOME_DEG = np.array(commandline.ARM.home_deg)
AWAY_DEG = HOME_DEG + np.array([40.0, -10.0, 15.0])
REPLAY = "import armtempo_board; armtempo_board.replay('go')"


@pytest.fixture
def flash(tmp_path: Path) -> Path:
    """A flash with the shipped arm and the motion ``go`` from home to AWAY_DEG."""
    folder = tmp_path / "flash" / "armtempo"
    folder.mkdir(parents=True)
    (folder / "arm.ata").write_bytes(encode.arm_record(commandline.ARM))
    (folder / "go.atm").write_bytes(
        encoded_plan.of_trajectory(
            point_to_point.straight("go", HOME_DEG, AWAY_DEG, commandline.ARM), commandline.ARM
        ).data
    )
    return tmp_path / "flash"


def mpremote(port: str, *arguments: str) -> str:
    """What mpremote prints."""
    done = commandline.python("-m", "mpremote", "connect", port, *arguments)
    assert done.returncode == 0, (done.stdout, done.stderr)
    return done.stdout


def steps(angles_deg: np.ndarray) -> list[int]:
    """Of postures, degrees to steps."""
    return [
        round(angle * joint.steps_per_deg)
        for angle, joint in zip(angles_deg, commandline.ARM.driven, strict=True)
    ]


def state(port: str) -> str:
    """Of the board, or why nothing answers for it."""
    try:
        with open_board(port) as board:
            return board.status().state
    except LinkError as error:
        return str(error)


def test_replay_from_the_prompt(flash: Path, tmp_path: Path) -> None:
    """A soft reset comes first, so the posture is taken for the start; ``resume`` does without, and knows it."""
    log = tmp_path / "edges"
    with launch(LaunchOptions(flash, interpreter=INTERPRETER, edge_log=log)) as process:
        with open_board(process.port) as board:
            arm_state.home(board, commandline.ARM)
        said = mpremote(process.port, "resume", "exec", REPLAY)
        assert said.splitlines() == [f"done at steps {steps(AWAY_DEG)}"]
        assert mpremote(process.port, "resume", "exec", REPLAY).startswith("refused: wrong_start joint 1")
        said = mpremote(process.port, "exec", REPLAY)
        assert said.splitlines()[0] == "taking the posture of the arm as the start of go"
        assert said.splitlines()[1] == f"done at steps {steps(AWAY_DEG)}"
        mpremote(process.port, "reset")
        commandline.wait_for(lambda: state(process.port) == "unhomed", "the program")
    session = edgelog.read(log)[0]
    rises = [int(np.sum(session.pins[pin][1] == 1)) for pin in ("A15", "A1", "B10")]
    assert rises == [
        2 * abs(there - here) for there, here in zip(steps(AWAY_DEG), steps(HOME_DEG), strict=True)
    ]


def test_files_while_the_program_runs(flash: Path) -> None:
    with launch(LaunchOptions(flash, interpreter=INTERPRETER)) as process:
        assert state(process.port) == "unhomed"
        assert "go.atm" in mpremote(process.port, "ls", "armtempo")
        assert mpremote(process.port, "exec", "print(6 * 7)") == "42\n"
        assert "runs MicroPython" in state(process.port)
        mpremote(process.port, "reset")
        commandline.wait_for(lambda: state(process.port) == "unhomed", "the program")


def test_while_it_moves_nobody_gets_in(flash: Path) -> None:
    """mpremote gives up; the motion comes to its end, if it should; then mpremote is let in."""
    with launch(
        LaunchOptions(flash, interpreter=INTERPRETER, virtual_time=False, instant_flash=True)
    ) as process:
        with open_board(process.port) as board:
            arm_state.home(board, commandline.ARM)
            run, duration_s = _start(board)
            begun_s = time.monotonic()
        # A pseudo terminal: without one its read waits for ever
        port = SerialTransport(process.port, timeout=0.05)
        with pytest.raises(TransportError, match="could not enter raw repl"):
            port.enter_raw_repl(timeout_overall=duration_s / 2)
        port.close()
        with open_board(process.port) as board:
            still_moving = time.monotonic() - begun_s < duration_s - 0.2
            assert board.status().moving or not still_moving
            commandline.wait_for(lambda: not board.status().moving, "the end of the motion")
            status = board.status()
        assert (status.state, status.run, list(status.positions.commanded_steps)) == (
            "idle",
            run,
            steps(AWAY_DEG),
        )
        assert mpremote(process.port, "resume", "exec", "print('in')") == "in\n"


def _start(board: Client) -> tuple[int, float]:
    """The number of the run, and how long it takes."""
    stored = board.find("go")
    assert stored is not None
    return board.start("go", stored.crc), stored.duration_s
