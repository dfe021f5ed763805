"""The program above the engine, on every interpreter: commands, runs, faults, picking up again, the store."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import LinkError
from armtempo.encoding import encode
from armtempo.link.client import Client
from armtempo.link.session import Session
from armtempo.link.transport import SerialTransport
from armtempo.model.arm import Arm
from armtempo.planning import point_to_point
from armtempo.simulator import LaunchOptions, launch
from armtempo_shared import wire

from tests import interpreters, scripted

SCRIPTS = Path(__file__).parent / "scripts"
BASICS = SCRIPTS / "probes" / "app_basics.py"
SUBJECTS = [
    *(SCRIPTS / "cases" / f"app_{name}.py" for name in ("commands", "once", "runs", "faults", "start")),
    *(
        SCRIPTS / "cases" / f"app_{name}.py"
        for name in ("sequence_start", "sequences", "sequence_ahead", "programs", "program_ends", "homing")
    ),
]


@pytest.mark.parametrize("name", interpreters.EACH)
def test_first_words_to_last_sample(name: str, tmp_path: Path) -> None:
    lines = interpreters.run(name, BASICS, str(tmp_path / "flash")).splitlines()
    assert lines == BASICS.with_suffix(".txt").read_text().splitlines()


@scripted.each(scripted.together(scripted.cases(*SUBJECTS)))
def test_case(case: scripted.Case, tmp_path: Path) -> None:
    case.run(str(tmp_path / "flash"), heap="")


@pytest.mark.parametrize("name", interpreters.EACH[1:])
def test_the_loop_allocates_nothing_while_moving(name: str, tmp_path: Path) -> None:
    """2000 turns with the heap locked: samples, status, resending, refusals, noise."""
    output = interpreters.run(name, SCRIPTS / "cases" / "turns_locked.py", str(tmp_path / "flash"))
    taken, first, sent = map(int, output.split())
    assert taken > 195
    assert 0 < first < taken
    assert sent > 200 * 40


# random and mutated frames through parser and handlers, a share of them on MicroPython


SCRIPT = Path(__file__).parent / "scripts" / "cases" / "fuzz.py"
FRAMES = {"cpython": 20_000, "micropython": 10_000, "micropython-arm": 1_000}
SEED = 20261121


@pytest.mark.slow
@pytest.mark.parametrize("name", interpreters.EACH)
def test_no_exception_no_wrong_check_no_motion(name: str) -> None:
    """The script asserts all three (and names the seed in its arguments); every handler is reached."""
    given, acted, bad, reached = interpreters.run(name, SCRIPT, str(FRAMES[name]), str(SEED)).split()
    assert int(given) == FRAMES[name]
    assert int(acted) > 0.3 * FRAMES[name]
    assert int(bad) > 0.1 * FRAMES[name]
    assert reached == "True"


# replay without a host, from the REPL


REPLAY_SCRIPT = Path(__file__).parent / "scripts" / "probes" / "replay.py"


@pytest.mark.parametrize("name", interpreters.EACH)
def test_replay_from_the_repl(name: str, tmp_path: Path) -> None:
    """The first call takes the posture for the start and moves; the second finds the arm elsewhere."""
    paper_arm = Arm.paper()
    home_deg = np.array(paper_arm.home_deg)
    trajectory = point_to_point.straight("go", home_deg, home_deg + np.array([2.0, 1.0, -2.0]), paper_arm)
    (tmp_path / "armtempo").mkdir()
    (tmp_path / "armtempo" / "arm.ata").write_bytes(encode.arm_record(paper_arm))
    (tmp_path / "armtempo" / "go.atm").write_bytes(encode.motion_record(trajectory, paper_arm))
    lines = interpreters.run(name, REPLAY_SCRIPT, str(tmp_path), "go", heap="4M").splitlines()
    assert lines[0] == "taking the posture of the arm as the start of go"
    assert lines[1] == f"done at steps {_steps(trajectory, paper_arm)}"
    assert lines[2].split()[:4] == ["refused:", "wrong_start", "joint", "1"]
    assert lines[3].split() == ["refused:", "not_found"]


def _steps(trajectory, paper_arm):
    end = trajectory(trajectory.duration_s)
    return [round(angle * joint.steps_per_deg) for angle, joint in zip(end, paper_arm.driven, strict=True)]


# the store: whatever fails and whenever, the old record or the new one is there, whole


CUTS = Path(__file__).parent / "scripts" / "cases" / "store_cuts.py"


@scripted.each(scripted.together(scripted.cases(CUTS)))
def test_old_or_new_after_a_failure_at_every_change(case: scripted.Case) -> None:
    case.run(heap="")


# power cut at every flash operation of an upload to the virtual board: the old record or the new one


MOST_CUTS = 60
INTERPRETER = interpreters.starter(interpreters.AVAILABLE[min(1, len(interpreters.AVAILABLE) - 1)])


@pytest.mark.slow
def test_upload_is_old_or_new(tmp_path: Path) -> None:
    paper_arm = Arm.paper()
    home_deg = np.array(paper_arm.home_deg)
    old, new = (
        encode.motion_record(
            point_to_point.straight("go", home_deg, home_deg + np.array(move), paper_arm), paper_arm
        )
        for move in ([1.0, 1.0, 1.0], [2.0, 2.0, 2.0])
    )
    seen = []
    for cut in range(1, MOST_CUTS):
        flash = tmp_path / str(cut)
        (flash / "armtempo").mkdir(parents=True)
        (flash / "armtempo" / "arm.ata").write_bytes(encode.arm_record(paper_arm))
        (flash / "armtempo" / "go.atm").write_bytes(old)
        done, stored = _upload_with_a_cut(flash, cut, new)
        assert stored in (wire.record_crc(old), wire.record_crc(new)), cut
        assert stored == wire.record_crc(new) or not done, cut
        assert not list((flash / "armtempo").glob("*.new")), cut
        seen.append(stored == wire.record_crc(new))
        if done:
            break
    assert done, "more flash operations than expected"
    assert seen.count(False) >= 3
    assert seen == sorted(seen)


def _upload_with_a_cut(flash: Path, cut: int, data: bytes) -> tuple[bool, int]:
    """Whether the upload was acknowledged, and the checksum of what is stored once the board is up again."""
    with launch(LaunchOptions(flash, power_cut_at=cut, interpreter=INTERPRETER)) as virtual:
        transport = SerialTransport(virtual.port)
        board = Client(Session(transport))
        done = True
        try:
            board.hello()
            board.upload("go", data)
        except LinkError:
            done = False
        board = Client(Session(transport))
        board.hello()
        entry = board.find("go")
        assert entry is not None, cut
        assert board.fetch("go")[-4:] == entry.crc.to_bytes(4, "little")
        transport.close()
        return done, entry.crc
