"""A host that is busy for a moment: the virtual board does not run away from it."""

from __future__ import annotations

import time
from dataclasses import replace

from armtempo import simulator
from armtempo.link import open_board
from armtempo.link.follow import Follower
from armtempo.model.arm import Arm
from armtempo.planning import point_to_point
from armtempo.records import encoded_motion
from armtempo.robot import arm_state, stored_motion

from tests import interpreters

AWAY_S = 1.5
SPEED_DEG_S = 12.0
FASTEST = interpreters.starter(interpreters.AVAILABLE[min(1, len(interpreters.AVAILABLE) - 1)])


def test_samples_wait_for_a_host_that_does_not_read() -> None:
    """In virtual time a motion of half a minute would be over long before the host is back."""
    shipped = Arm.paper()
    joints = [
        replace(joint, limits=replace(joint.limits, speed_deg_s=SPEED_DEG_S)) if joint.limits else joint
        for joint in shipped.joints
    ]
    arm = replace(shipped, joints=tuple(joints))
    motion = point_to_point.straight("slow", arm.home_deg, [180.0, -60.0, 40.0], arm)
    with (
        simulator.launch(simulator.LaunchOptions(interpreter=FASTEST)) as process,
        open_board(process.port) as board,
    ):
        arm_state.configure(board, arm, replace=True)
        arm_state.home(board, arm)
        stored = stored_motion.store(board, "slow", encoded_motion.of_trajectory(motion, arm).data)
        started = board.start(stored.name, stored.crc)
        assert started.duration_s > 25.0
        follower = Follower(board, started.run)
        time.sleep(AWAY_S)
        indices = [sample.index for sample in follower.samples()]
    assert follower.ended
    assert follower.end.lost == ()
    assert indices == list(range(len(indices)))
