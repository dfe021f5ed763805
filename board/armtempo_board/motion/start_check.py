"""Whether a motion may start from the present positions. Needs much memory, so it is unloaded afterwards."""

from armtempo_shared import codes

from armtempo_board.errors import Refused

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_shared.motion import MotionHead

    from armtempo_board.motion.joint_drive import JointDrive

_ANY_JOINT = 0


def check_start(
    motion: "MotionHead", joints: "list[JointDrive]", limits: "list[dict[str, int]] | None", known: int
) -> int:
    """Duration of the motion, in ticks; raises Refused.

    ``limits``: the engine's, None if its splines were checked before; ``known``: one bit per joint.
    """
    if limits is not None:
        check_splines(motion, joints, limits)
    from armtempo_board.motion import endpoints  # here, so that it can be forgotten

    for number, joint in enumerate(joints):
        if not known >> number & 1:
            raise Refused(codes.UNHOMED, number)
        off = endpoints.start_offset(motion, number, joint.position(joint.ring.matches()))
        if off:
            raise Refused(codes.WRONG_START, number, off)
    return endpoints.duration_ticks(motion)


def check_splines(motion: "MotionHead", joints: "list[JointDrive]", limits: "list[dict[str, int]]") -> None:
    """Check the splines of the motion; raises Refused."""
    from armtempo_board.motion import motion_check  # here, so that it can be forgotten

    joint = joints[_ANY_JOINT]  # as the gap is the same for all; it walks through the motion
    motion_check.check(motion, limits, joint.gap_ticks, joint.generator.subintervals)
