"""Goes in front of parts that make steps: the engine for the board's own arm, without drivers, inputs and encoders."""

from armtempo_shared import armrecord


class NoPin:
    """In the place of ENABLE: the engine cannot switch the drivers on."""

    def value(self, level=None):
        """Nothing."""
        return 0


_RANGE = 1 << 24  # steps; with the drivers off a joint can go anywhere


def make_engine(record, estop=False, rates=None):
    """(engine, rows of its joints); it steps the pins of this arm and no others.

    ``estop``: its interrupt stops it. ``rates``: of that many joints, in the place of the arm's.
    """
    from armtempo_board.app import room
    from armtempo_board.motion.engine import Engine

    with open(record, "rb") as file:
        head, joints, _ = armrecord.unpack(file.read())
    head["flags"] &= armrecord.FLAG_ENABLE_HIGH | (armrecord.FLAG_ESTOP_ACTIVE_HIGH if estop else 0)
    if estop:
        head["flags"] |= armrecord.FLAG_ESTOP_FITTED
    for joint in joints:
        joint["encoder"] = joint["limit_low"] = joint["limit_high"] = armrecord.NONE
        joint["following_counts"] = 0
    if rates:
        joints = joints[: len(rates)]
        for joint, rate in zip(joints, rates):
            joint["max_rate"], joint["min_steps"], joint["max_steps"] = rate, -_RANGE, _RANGE
    engine = Engine(head, joints, room.workspace())
    engine.inputs.enable_pin = NoPin()
    return engine, joints


def serve(engine, idle_us):
    """A turn of the loop. ``idle_us``: what it takes in simulated time, which the chip needs by itself."""
    engine.service()
    if idle_us:
        time.sleep_us(idle_us)


def load(engine, motion, start_steps):
    """Stand at its start and load it; ValueError where the drivers are not off."""
    from armtempo_shared.motion import Motion

    output, driven, level = enable()
    if not output or driven != level or level == engine.inputs.on_level:
        raise ValueError("ENABLE is not inactive: no steps are made")
    engine.home((1 << len(start_steps)) - 1, start_steps)
    engine.load(Motion(motion))
