"""Whatever stops a motion, at whatever moment: no wrong pulse; the position is exact or declared unknown."""

# all cases: slow on CPython

import random

import cases
import machine_state
from armtempo_shared import armrecord, codes
from armtempo_shared.messages import OTHER_SWITCH
from engine_rig import FEWER, TICK_HZ, Evaluator, Motion, Rig, Steps, arm, row
from firmware import external_interrupts

FREEZE_TICKS = 84 * 10
HOME_TICKS = 84 * 10_000  # the main loop looks at a home switch in one of three services, here 1 ms apart
SEED = 20261
MOTION = Motion(
    TICK_HZ // 40,
    Steps((1000, 300, 5000, 1)),
    Steps((500, 900, 700, -1), (700_000, 1100, 1000, 1)),
    Steps((200, 500_000, 4, 1)),
)
LONG = Motion(
    TICK_HZ // 5,
    Steps((1000, 600, 25_000, 1)),
    Steps((500, 900, 700, -1), (700_000, 1500, 9_000, 1)),
    Steps((200, 500_000, 30, 1)),
)


def stopped(rig, code=0, joint=255):
    """The engine stands still, says why, and counts what the pins did."""
    engine = rig.engine
    for _ in range(3):
        rig.turn()
    assert not engine.moving
    assert not engine.moving
    assert (engine.fault, engine.fault_joint) == (code, joint), (engine.fault, engine.fault_joint)
    before = [pulses.rises for pulses in rig.pulses]
    rig.board.spend(TICK_HZ)
    assert [pulses.rises for pulses in rig.pulses] == before
    for pulses in rig.pulses:
        pulses.check_end()
    assert rig.commanded() == rig.stepped(), (rig.commanded(), rig.stepped())
    assert rig.samples[-1][4:7] == rig.stepped()[:3]


def again(rig):
    """After a fault was cleared, the next motion is whole."""
    assert rig.engine.clear()
    before = rig.commanded()
    rig.run(MOTION)
    assert rig.engine.fault == 0
    assert rig.commanded() == [a + steps.total() for a, steps in zip(before, MOTION.joints)]


def case_freeze_anywhere():  # slow
    """``freeze`` called at many moments."""
    random.seed(SEED)
    for number in range(30 // FEWER):
        rig = Rig(arm(3))
        rig.start(MOTION)
        rig.run_to(random.randrange(-1_000_000, MOTION.duration))
        rig.board.spend(random.randrange(1000))
        rig.engine.freeze()
        stopped(rig)
        assert rig.engine.known == 7
        if number % 10 == 0:
            again(rig)


def case_estop_anywhere():  # not emulated, slow
    """The E-stop's edge at exact ticks: just before, on and after edges, in pulses and between them."""
    random.seed(SEED)
    moments = [
        1000 + 300 * 700 + offset for offset in (-300, -166, -165, -161, -160, -159, -1, 0, 1, 7, 8, 9, 50)
    ]
    moments += [random.randrange(-1_000_000, MOTION.duration) for _ in range(24 // FEWER)]
    for number, moment in enumerate(moments):
        releases = number & 1
        flags = armrecord.FLAG_ESTOP_FITTED | (armrecord.FLAG_ESTOP_RELEASES if releases else 0)
        rig = Rig(arm(3), flags=flags)
        rig.start(MOTION)
        rig.board.at(rig.zero() + moment, press)
        rig.run_to(moment + 84 * 500)
        last = max([pulses.last_rise for pulses in rig.pulses])
        assert last <= rig.zero() + moment + FREEZE_TICKS, (moment, last - rig.zero())
        if releases:
            assert rig.board.pins.line("E12").level == 1
        stopped(rig, codes.ESTOP)
        assert rig.engine.known == (0 if releases else 7)
        assert not rig.engine.clear()
        assert rig.refusal(MOTION)[0] == codes.FAULT_PENDING
        external_interrupts.set_level("E15", 1)
        rig.turn()
        if number % 4 == 0:
            again(rig)


def press():
    external_interrupts.set_level("E15", 0)


def case_estop_at_rest():  # not emulated
    """Pressed while nothing moves, or before the program ran."""
    rig = Rig(arm(1), flags=armrecord.FLAG_ESTOP_FITTED | armrecord.FLAG_ESTOP_ACTIVE_HIGH)
    rig.turn()
    assert rig.engine.fault == 0
    external_interrupts.set_level("E15", 1)
    rig.turn()
    assert rig.engine.fault == codes.ESTOP
    assert not rig.engine.clear()
    external_interrupts.set_level("E15", 0)
    assert rig.engine.clear()
    rig.turn()
    assert rig.engine.fault == 0


def tap():
    """Press the E-stop for a moment."""
    external_interrupts.set_level("E15", 0)
    machine_state.board.spend(84)
    external_interrupts.set_level("E15", 1)
    machine_state.board.spend(84)


class Tapped:
    """A motion that is looked at while somebody taps the E-stop."""

    can_brake = False
    joints = MOTION.joints

    @property
    def duration(self):
        """What the engine asks for after its look at the E-stop."""
        tap()
        return MOTION.duration


def case_estop_while_loading():  # not emulated
    """A tap on the E-stop after the engine has looked at it, but before the start: nothing moves, and it is told."""
    for motion in (MOTION, Tapped()):
        rig = Rig(arm(3), flags=armrecord.FLAG_ESTOP_FITTED)
        for pulses, steps in zip(rig.pulses, motion.joints):
            pulses.expect(steps)
        rig.engine.load(motion)
        if motion is MOTION:
            tap()
        rig.engine.start()
        rig.run_to(MOTION.duration)
        assert rig.stepped() == [0, 0, 0] == rig.commanded()
        assert (rig.engine.fault, rig.engine.known) == (codes.ESTOP, 7)


def case_estop_behind_a_limit_switch():  # not emulated
    """It releases the drivers whatever came before, so the position is unknown."""
    rig = Rig(
        [row(channel=0, limit_low=0, limit_active_high=1)],
        flags=armrecord.FLAG_ESTOP_FITTED | armrecord.FLAG_ESTOP_RELEASES,
    )
    rig.start(Motion(TICK_HZ // 10, Steps((1000, 400, 2000, -1))))
    rig.run_to(400_000)
    external_interrupts.set_level("D8", 1)
    rig.turn()
    rig.turn()
    stopped_one(rig, codes.LIMIT_SWITCH)
    assert rig.engine.known == 1
    tap()
    assert rig.board.pins.line("E12").level == 1
    rig.turn()
    assert (rig.engine.fault, rig.engine.known) == (codes.LIMIT_SWITCH, 0)


def case_limit_switch_just_before_another_fault():
    """Its interrupt came since the turn began that finds the other: what came first is what the host hears of."""
    rig = Rig([row(channel=0, limit_low=0, limit_active_high=1)])
    rig.start(Motion(TICK_HZ // 10, Steps((1000, 400, 2000, -1))))
    rig.run_to(400_000)
    external_interrupts.set_level("D8", 1)
    rig.engine._fail(codes.FOLLOWING, 0)
    stopped_one(rig, codes.LIMIT_SWITCH)


def case_underrun_anywhere():  # not emulated, slow
    """The main loop stalls at many moments, for long enough and for not quite long enough."""
    random.seed(SEED)
    dry = 0
    for _ in range(18 // FEWER):
        rig = Rig(arm(3))
        rig.start(LONG)
        rig.run_to(random.randrange(-100_000, LONG.duration))
        rig.board.spend(random.randrange(84 * 90_000))
        while rig.engine.moving:
            rig.turn()
        if rig.engine.fault:
            dry += 1
            stopped(rig, codes.UNDERRUN, rig.engine.fault_joint)
            assert rig.engine.known == 7
        else:
            assert rig.commanded() == [steps.total() for steps in LONG.joints]
    assert 0 < dry < 18 // FEWER, dry


def case_written_too_late():  # not emulated
    """The interrupt takes so long that the last edge has passed when new ones are written."""
    motion = Motion(LONG.duration, LONG.joints[0], Steps(), Steps())
    for moment in (-500_000, 9_000_000):
        with_slow_emit(motion, moment)


def with_slow_emit(motion, moment):
    """From a moment on, whatever is written to the first joint's ring takes 30 ms."""
    from armtempo_board.motion import ring_feeder

    emit = ring_feeder.emit
    slow = []

    def slow_emit(rings, *arguments):
        for rig in slow:
            if rings & 1:
                rig.board.stall(84 * 30_000)
        return emit(rings, *arguments)

    ring_feeder.emit = slow_emit
    try:
        rig = Rig([dict(joint, following_counts=0) for joint in arm(3)])
    finally:
        ring_feeder.emit = emit
    rig.start(motion)
    rig.run_to(moment)
    slow.append(rig)
    while rig.engine.moving:
        rig.turn()
    stopped(rig, codes.UNDERRUN, 0)
    assert rig.engine.known == 7


def case_interrupt_gone():  # not emulated
    """TIM6 asks no more: the rings run dry, nothing wrong is stepped, and the fault says so."""
    for moment in (-500_000, 300_000, 9_000_000):
        rig = Rig(arm(3))
        import stm
        from armtempo_board.hardware import isr
        from machine import mem32

        rig.start(LONG)
        rig.run_to(moment)
        mem32[stm.TIM6 + 4 * isr.DIER] = 0
        while rig.engine.moving:
            rig.turn()
        stopped(rig, codes.INTERNAL, rig.engine.fault_joint)
        assert rig.engine.known == 7


def case_long_stall():  # not emulated
    """The main loop is away for nearly half the counter's range: the outputs stay where they stalled, 50 ms on."""
    rig = Rig(arm(3))
    rig.start(LONG)
    rig.run_to(800_000)
    served = rig.board.now
    rig.board.spend(20 * TICK_HZ)
    assert rig.pulses[0].last_rise <= served + TICK_HZ // 20
    for _ in range(3):
        rig.turn()
    stopped(rig, codes.UNDERRUN, rig.engine.fault_joint)


def case_limit_switches():  # not emulated
    """A switch stops a joint that moves towards it, not one that moves away; and ends a homing run."""
    joints = arm(3)
    joints[1] = row(channel=1, dir_inverted=1, limit_low=0, limit_high=2, limit_active_high=1)
    for name, moment, trips in (("D8", 300_000, 1), ("D8", 1_000_000, 0), ("D10", 1_000_000, 1)):
        for homing in (0, 7):
            rig = Rig(joints)
            rig.start(MOTION, homing)
            rig.board.at(rig.zero() + moment, lambda name=name: external_interrupts.set_level(name, 1))
            rig.run_to(MOTION.duration + TICK_HZ)
            if trips:
                assert rig.pulses[1].last_rise <= rig.zero() + moment + FREEZE_TICKS
                stopped(rig, 0 if homing else codes.LIMIT_SWITCH, 1)
                assert rig.engine.known == 7
            else:
                assert rig.engine.fault == 0
                assert rig.commanded() == [steps.total() for steps in MOTION.joints]


def case_home_switches():
    """A switch without interrupt ends a homing run towards it, and nothing else."""
    joints = arm(3)
    joints[1] = row(channel=1, limit_low=armrecord.POLLED | 0x34, limit_active_high=1)  # PD4
    for homing, moment, trips in (
        (0, 300_000, 0),
        (7, 300_000, 1),
        (5, 300_000, 0),
        (7, 1_000_000, 0),
        (7, 0, 1),
    ):
        rig = Rig(joints)
        external_interrupts.set_level("D4", int(moment == 0))
        rig.start(MOTION, homing)
        rig.board.at(rig.zero() + moment, lambda: external_interrupts.set_level("D4", 1))
        rig.run_to(MOTION.duration + TICK_HZ)
        if trips:
            assert rig.pulses[1].last_rise <= rig.zero() + moment + HOME_TICKS
            stopped(rig, 0, 1)
            assert rig.engine.known == 7
        else:
            assert rig.engine.fault == 0
            assert rig.commanded() == [steps.total() for steps in MOTION.joints]


def set_level_at(rig, moment, pin, level):
    rig.board.at(rig.zero() + moment, lambda: external_interrupts.set_level(pin, level))


def case_a_homing_motion_that_seeks_ends_at_other_switches():
    """Of joints that stand, and those at the other end; but not if one was pressed before, or for a moment alone."""
    joints = arm(3)
    joints[0] = row(channel=0, limit_low=1)  # the joints move to their high ends
    joints[1] = row(channel=1, limit_high=armrecord.POLLED | 0x34, limit_active_high=1)  # PD4
    joints[2] = row(channel=2, limit_low=armrecord.POLLED | 0x35, limit_active_high=1)  # PD5
    for homing, seeks, pin, before, back, tripped in (
        (0b101, True, "D4", 0, 0, 1),
        (0b101, True, "D5", 0, 0, 2),
        (0b101, True, "D9", 1, 0, 0),
        (0b101, False, "D4", 0, 0, None),
        (0b101, True, "D4", 1, 0, None),
        (0b101, True, "D4", 0, 240_000, None),
    ):
        rig = Rig(joints)
        active = int(pin != "D9")
        for name, level in (("D4", 0), ("D5", 0), ("D9", 1)):
            external_interrupts.set_level(name, level)
        external_interrupts.set_level(pin, active if before and active else 1 - active)
        rig.start(MOTION, homing, seeks)
        set_level_at(rig, 300_000, pin, active)
        if back:
            set_level_at(rig, 300_000 + back, pin, 1 - active)
        rig.run_to(MOTION.duration + TICK_HZ)
        if tripped is None:
            assert rig.engine.fault == 0
            assert rig.commanded() == [steps.total() for steps in MOTION.joints], (pin, before, back)
        else:
            stopped(rig, 0, tripped | OTHER_SWITCH)
            assert rig.engine.known == 7


def case_limit_tripped_before():  # not emulated
    """A joint that turns towards a switch that is tripped already is stopped by the main loop."""
    joints = [row(channel=0, limit_high=1)]
    rig = Rig(joints)
    external_interrupts.set_level("D9", 0)
    rig.start(Motion(TICK_HZ // 10, Steps((1000, 400, 2000, -1), (2_000_000, 400, 2000, 1))))
    rig.run_to(TICK_HZ)
    stopped_one(rig, codes.LIMIT_SWITCH)
    assert -2000 <= rig.commanded()[0] < -1900


def stopped_one(rig, code):
    assert (rig.engine.fault, rig.engine.fault_joint) == (code, 0)
    assert rig.commanded() == rig.stepped()


def case_following():  # not emulated
    """A blocked motor and a slipping coupling are noticed, and the joint's position is unknown."""
    for harm in ("block", "slip"):
        rig = Rig(arm(3))
        rig.start(MOTION)
        rig.run_to(600_000)
        if harm == "block":
            rig.arm.motors[0].blocked = True
        else:
            rig.arm.motors[0].slip(40)
        rig.run_to(MOTION.duration + TICK_HZ)
        assert (rig.engine.fault, rig.engine.fault_joint) == (codes.FOLLOWING, 0), rig.engine.fault
        assert rig.engine.known == 6, (harm, rig.engine.known)
        stopped(rig, codes.FOLLOWING, 0)
        assert rig.engine.clear()
        assert rig.refusal(MOTION) == (codes.UNHOMED, 0, 0)
        rig.engine.home(1, [0, 0, 0])
        assert rig.engine.known == 7


def case_start_failed():  # not emulated
    """The second counter does not follow the first."""
    rig = Rig(arm(3))
    rig.board.timers[2].follower = None
    rig.start(MOTION)
    assert rig.engine.fault == codes.START_FAILED
    assert not rig.engine.moving
    assert rig.stepped() == [0, 0, 0] == rig.commanded()
    rig.board.spend(TICK_HZ)
    assert rig.stepped() == [0, 0, 0]  # the counter that runs makes no steps


def case_refusals():  # not emulated
    """What a motion is refused for."""
    rig = Rig(arm(2))
    motion = Motion(TICK_HZ, Steps((1000, 400, 2000, 1)), Steps())
    Evaluator.refusal = (codes.TOO_FAST, 1, 400_000)
    assert rig.refusal(motion) == (codes.TOO_FAST, 1, 400_000)
    Evaluator.refusal = None
    Evaluator.offset = -3
    assert rig.refusal(motion) == (codes.WRONG_START, 0, -3)
    Evaluator.offset = 0
    rig.start(motion)
    assert rig.refusal(motion)[0] == codes.BUSY
    assert not rig.engine.clear()
    rig.run_to(motion.duration + TICK_HZ)
    assert rig.engine.fault == 0


def case_enable():  # not emulated
    """Drivers are off until the first motion is loaded, then on, then off when the engine is closed."""
    for flags, on in ((0, 0), (armrecord.FLAG_ENABLE_HIGH, 1)):
        rig = Rig(arm(1), flags=flags)
        line = rig.board.pins.line("E12")
        assert line.level == 1 - on
        rig.run(Motion(1000, Steps()))
        assert line.level == on
        rig.engine.close()
        assert line.level == 1 - on


def case_close_and_anew():  # not emulated
    """Another engine takes the hardware over, inputs and all."""
    flags = armrecord.FLAG_ESTOP_FITTED
    first = Rig(arm(2), flags=flags)
    first.start(Motion(TICK_HZ, Steps((1000, 4000, 2000, 1)), Steps((1000, 4000, 2000, 1))))
    first.run_to(1_000_000)
    first.engine.close()
    assert first.commanded() == first.stepped()
    first.make_engine(arm(2))
    engine = first.engine
    engine.home(3, [0, 0])
    for pulses in first.pulses:
        pulses.net = 0
    motion = Motion(1_000_000, Steps((1000, 4000, 200, 1)), Steps((1000, 4000, 200, -1)))
    first.run(motion)
    assert first.commanded() == [200, -200] == first.stepped()
    external_interrupts.set_level("E15", 0)
    first.turn()
    assert engine.fault == codes.ESTOP


cases.run(globals())
