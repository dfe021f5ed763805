"""Whether the encoders do not turn while the arm's pins step: otherwise a driver is on in spite of ENABLE."""

from array import array
from binascii import unhexlify

from armtempo_shared import armrecord

from armtempo_board.buffers import COMMANDED
from armtempo_board.selftest.bare_engine import load, make_engine, serve
from armtempo_board.selftest.common import enable, feed

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_STILL = 2  # counts by which an encoder at an edge may change


def measure(record: str, motion: str, start_steps: "list[int]", idle_us: int) -> "dict[str, Any]":
    """Counts of each encoder (None: there is none), and the counts due for its joint's steps.

    The motion ends as soon as one turns.
    """
    feed()
    engine, joints = make_engine(record, encoders=True)
    sample = array("i", [0] * (COMMANDED + 2 * len(joints)))
    ends: "list[Any]" = [None] * len(joints)
    try:
        load(engine, unhexlify(motion), start_steps)
        engine.snapshot(sample)
        begins = list(sample)[COMMANDED:]
        engine.start()
        turned = False
        while engine.moving and not turned:
            serve(engine, idle_us)
            engine.snapshot(sample)
            ends = [now - before for now, before in zip(list(sample)[COMMANDED:], begins)]
            turned = max([abs(counts) for counts in ends[len(joints) :]]) > _STILL
    finally:
        engine.freeze()
        off = enable()
        engine.close()
    rows = list(zip(joints, ends, ends[len(joints) :]))
    return {
        "turned": [None if row["encoder"] == armrecord.NONE else counts for row, _, counts in rows],
        "due": [abs(steps * row["counts_num"]) // row["counts_den"] for row, steps, _ in rows],
        "fault": engine.fault,
        "enable": off,
    }
