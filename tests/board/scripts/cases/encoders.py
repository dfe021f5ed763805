"""Encoders beyond 16 bits, and what their counts say about a joint."""

import random
from array import array

import bare_board
import cases
from armtempo_board.hardware import isr
from armtempo_board.hardware.encoders import EncoderInput
from armtempo_board.motion.following_error import FollowingError
from engine_rig import TICK_HZ, Motion, Rig, Steps, arm, row

SEED = 20263


def case_both_ways_round():
    """Many rounds of the counter, to and fro, in jumps of up to 32 767 counts, inverted or not."""
    random.seed(SEED)
    for channel, timer in ((0, 1), (1, 3), (2, 8), (3, 4)):
        for inverted in (0, 1):
            board = bare_board.start()
            encoder = EncoderInput(channel, inverted)
            total = 0
            for n in range(300):
                jump = random.choice((1, -1, 32767, -32767, random.randrange(-32767, 32768)))
                if n < 100:
                    jump = 32767 if n < 50 else -32767
                board.timers[timer].turn(jump)
                total += -jump if inverted else jump
                encoder.update()
                assert encoder.counts == total, (n, encoder.counts, total)


def case_declared():
    """The count continues from what was declared, also across the counter's zero."""
    board = bare_board.start()
    encoder = EncoderInput(0, 0)
    board.timers[1].turn(-5)
    encoder.declare(-1000)
    assert encoder.counts == -1000
    board.timers[1].turn(10)
    encoder.update()
    assert encoder.counts == -990
    encoder.take(3)
    assert encoder.counts == -992


def case_expected_counts():
    """The quotient rounds down, wherever the joint stands; the sign of the ratio counts."""
    for numerator, denominator in ((5, 16), (-5, 16), (80, 256), (4000, 12800), (7, 1), (0, 5)):
        following = FollowingError(
            row(encoder=0, counts_num=numerator, counts_den=denominator, following_counts=10)
        )
        for steps in (0, 1, -1, 15, 16, -16, 17, 123456, -123457, 999999):
            exact = steps * numerator / denominator
            assert exact - 1 < following.expected(steps) <= exact
    assert not following.is_exceeded(100, 10) and following.is_exceeded(100, -11)
    assert not FollowingError(row(following_counts=10, encoder=255)).is_exceeded(100, -1000)
    assert not FollowingError(row(following_counts=0, encoder=1)).is_exceeded(100, -1000)


def case_at_full_speed():
    """300 000 steps a second with 4 counts a step, over many rounds of the counter, there and back."""
    joints = [row(channel=0, encoder=2, counts_num=4, counts_den=1, following_counts=300)]
    there = Steps((1000, 280, 12_000, 1))
    back = Steps((1000, 280, 12_000, -1))
    rig = Rig(joints)
    for steps in (there, back, back, there):
        before = rig.commanded()[0]
        rig.run(Motion(TICK_HZ // 20, steps))
        assert rig.engine.fault == 0, rig.engine.fault
        for sample in rig.samples:
            assert abs(sample[5] - 4 * sample[4]) <= 8, sample
        assert rig.commanded() == [before + steps.total()]
        assert rig.samples[-1][5] == 4 * rig.commanded()[0]


def case_moved_by_hand():
    """While nothing moves the encoders are followed too."""
    rig = Rig(arm(2))
    for _ in range(10):
        rig.board.timers[1].turn(20_000)
        rig.board.timers[3].turn(-20_000)
        rig.turn()
    buffer = array("i", [0] * 8)
    rig.engine.snapshot(buffer)
    assert list(buffer) == [0, 0, 0, 0, 0, 0, 200_000, -200_000], buffer
    rig.engine.home(2, [0, 160])
    rig.engine.snapshot(buffer)
    assert list(buffer) == [0, 0, 0, 0, 0, 160, 200_000, 50], buffer


def case_unread_counter():
    """The counter of an encoder timer reads back as 16 bits."""
    board = bare_board.start()
    encoder = EncoderInput(1, 0)
    board.timers[3].turn(-1)
    assert isr.read_counter(encoder.address) == 0xFFFF


cases.run(globals())
