"""Goes in front of parts that make steps: the engine for the board's own arm, without its drivers."""

from armtempo_shared import armrecord

_ESTOP_LINE = 15
_PUPDR_SHIFT = 2 * _ESTOP_LINE


class NoPin:
    """In the place of ENABLE: the engine cannot switch the drivers on."""

    def value(self, level=None):
        """Nothing."""
        return 0


_RANGE = 1 << 24  # steps; with the drivers off a joint can go anywhere


def make_engine(record, estop=False, rates=None, encoders=False, workspace=None):
    """(engine, rows of its joints); it steps the pins of this arm and no others, and the arm's E-stop stops it.

    ``estop``: one is fitted, whatever the arm has. ``rates``: of that many joints, instead of the arm's;
    they can go anywhere then.
    ``encoders``: they are read, but no joint is checked against them. ``workspace``: of a program that has one already.
    """
    from armtempo_board.app import room
    from armtempo_board.motion.engine import Engine
    from armtempo_board.motion.engine_parts import EngineParts

    with open(record, "rb") as file:
        head, joints, _ = armrecord.unpack(file.read())
    kept = armrecord.FLAG_ENABLE_HIGH | armrecord.FLAG_ESTOP_ACTIVE_HIGH | armrecord.FLAG_ESTOP_FITTED
    head["flags"] = head["flags"] & kept | (armrecord.FLAG_ESTOP_FITTED if estop else 0)
    for joint in joints:
        joint["limit_low"] = joint["limit_high"] = armrecord.NONE
        joint["following_counts"] = 0
        if not encoders:
            joint["encoder"] = armrecord.NONE
    if rates:
        joints = joints[: len(rates)]
        for joint, rate in zip(joints, rates):
            joint["max_rate"], joint["min_steps"], joint["max_steps"] = rate, -_RANGE, _RANGE
    if workspace is None:
        workspace = room.workspace()
    else:
        room.share(workspace, len(joints))
    engine = Engine(EngineParts(head, joints, workspace))
    engine.inputs.enable_pin = NoPin()
    if head["flags"] & armrecord.FLAG_ESTOP_FITTED:
        pull_inactive(engine)
    return engine, joints


_PULLS = stm.GPIOE + stm.GPIO_PUPDR


def pulls(engine, tripped):
    """The register of port E's pull resistors with the one that draws the E-stop to a level."""
    pull = 1 if tripped == engine.inputs._estop_level else 2
    return mem32[_PULLS] & ~(3 << _PUPDR_SHIFT) | pull << _PUPDR_SHIFT


def pull_inactive(engine):
    """An E-stop that is not wired would be tripped: draw it to the other level. A switch is stronger.

    ValueError where one is pressed.
    """
    mem32[_PULLS] = pulls(engine, 0)
    time.sleep_ms(1)
    engine.service()  # notes what tripped until now
    if not engine.clear():
        engine.close()
        raise ValueError("the E-stop is pressed, or wired for the other level")


def serve(engine, idle_us):
    """A turn of the loop. ``idle_us``: what it takes in simulated time, which the chip needs by itself."""
    engine.service()
    if idle_us:
        time.sleep_us(idle_us)


def load(engine, motion, start_steps):
    """Stand at its start and load it; the motion. ValueError where the drivers are not off."""
    from armtempo_shared.motion import Motion

    output, driven, level = enable()
    if not output or driven != level or level == engine.inputs.on_level:
        raise ValueError("ENABLE is not inactive: no steps are made")
    engine.home((1 << len(start_steps)) - 1, start_steps)
    motion = Motion(motion)
    engine.load(motion)
    return motion
