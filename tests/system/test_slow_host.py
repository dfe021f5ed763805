"""A host that is busy for a moment: the virtual board does not run away from it."""

from __future__ import annotations

import time
from dataclasses import replace

from armtempo import simulator
from armtempo.link import open_board
from armtempo.link.follow import Follower
from armtempo.model import arm as arms
from armtempo.planning import point_to_point
from armtempo.robot import operate

from tests import interpreters

AWAY_S = 3.0
SPEED_DEG_S = 6.0
FASTEST = interpreters.starter(interpreters.AVAILABLE[min(1, len(interpreters.AVAILABLE) - 1)])


def test_samples_wait_for_a_host_that_does_not_read() -> None:
    """In virtual time a motion of a minute would be over long before the host is back."""
    shipped = arms.load_arm(arms.default_path())
    joints = [
        replace(joint, limits=replace(joint.limits, speed_deg_s=SPEED_DEG_S)) if joint.limits else joint
        for joint in shipped.joints
    ]
    arm = replace(shipped, joints=tuple(joints))
    motion = point_to_point.straight("slow", operate.home_deg(arm), [180.0, -60.0, 40.0], arm)
    with (
        simulator.launch(interpreter=FASTEST) as process,
        open_board(process.port) as board,
    ):
        operate.configure(board, arm, replace=True)
        operate.home(board, arm)
        stored = operate.store(board, "slow", operate.motion_data(motion, arm))
        run, duration_s = board.start(stored.name, stored.crc)
        assert duration_s > 50.0
        follower = Follower(board, run)
        time.sleep(AWAY_S)
        indices = [sample.index for sample in follower.samples()]
    assert follower.end is not None
    assert follower.end.lost == ()
    assert indices == list(range(len(indices)))
