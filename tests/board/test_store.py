"""The store: whatever fails and whenever, the old record or the new one is there, whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import LinkError
from armtempo.link.client import Client
from armtempo.link.session import Session
from armtempo.link.transport import SerialTransport
from armtempo.model.arm import Arm
from armtempo.planning import point_to_point
from armtempo.records import encode
from armtempo.simulator import LaunchOptions, launch
from armtempo_shared import wire

from tests import interpreters, scripted

SCRIPT = Path(__file__).parent / "scripts" / "cases" / "store_cuts.py"


@scripted.each(scripted.together(scripted.cases(SCRIPT)))
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
