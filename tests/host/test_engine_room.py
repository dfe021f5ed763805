"""What is said of the memory for an arm: on a board, and before there is one."""

from itertools import combinations_with_replacement

import pytest
from armtempo import Arm
from armtempo.basics.errors import InputError
from armtempo.link.board_messages import Hello
from armtempo.robot import engine_room
from armtempo.robot.engine_room import AS_FILES, IN_FIRMWARE, Room
from armtempo_shared import engine_memory, limits
from armtempo_shared.engine_memory import SHORT_MS, room_words

PAPER = Arm.paper()


def board(room: Room) -> Hello:
    """A board with so much memory for engines."""
    return Hello(
        protocol=1, joints=0, encoders=0, state="unconfigured", tick_hz=84_000_000, max_rate=240_000,
        max_rate_sum=240_000, free_flash=0, free_heap=0, arm_crc=0, program_crc=0, boot=1,
        engine_room=room.size, features=0, arm_problem=0, arm_value=0, board_id="1",
    )  # fmt: skip


def six_joints() -> Arm:
    return Arm.load("ar4")


def test_an_arm_that_fits_is_told_with_its_bytes() -> None:
    line = engine_room.of_arm(PAPER, board(AS_FILES))
    needed = engine_memory.needed_bytes(engine_room.encode.step_rates(PAPER))
    assert line == f"memory on the board: {needed} bytes for 3 joints of {AS_FILES.size}"
    assert "fits with the program as files or in the firmware" in engine_room.of_arm(PAPER)


def test_an_arm_with_more_joints_is_sent_to_the_firmware() -> None:
    arm = six_joints()
    with pytest.raises(InputError) as refused:
        engine_room.check(arm, board(AS_FILES))
    assert f"the board has {AS_FILES.size}" in refused.value.problem
    assert "armtempo flash" in refused.value.hint
    assert "too much, or put the program into the board's firmware" in engine_room.of_arm(
        arm, board(AS_FILES)
    )
    assert "fits only with the program in the firmware" in engine_room.of_arm(arm)
    engine_room.check(arm, board(IN_FIRMWARE))


def test_a_room_that_is_too_small_is_told_in_bytes() -> None:
    small = Room(6_000)
    with pytest.raises(InputError) as refused:
        engine_room.check(PAPER, board(small))
    assert "the board has 6000" in refused.value.problem
    assert "lower its top speeds" in refused.value.hint


def test_no_way_out_is_promised_that_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine_room, "IN_FIRMWARE", AS_FILES)
    with pytest.raises(InputError) as refused:
        engine_room.check(six_joints(), board(AS_FILES))
    assert "armtempo flash" not in refused.value.hint


def test_a_board_tells_what_the_firmware_would_give() -> None:
    lines = engine_room.of_board(board(AS_FILES))
    assert len(lines) == 2
    assert "1 x 240000 steps/s, 2 x 62000 steps/s, 3 x 30000 steps/s" in lines[0]
    assert "6 x 40000 steps/s" in lines[1]
    assert "sequences" in lines[1]
    assert len(engine_room.of_board(board(IN_FIRMWARE))) == 1


def test_the_words_name_the_highest_rate_that_fits() -> None:
    room = Room(8_500)
    (rate,) = [
        int(part.split()[2]) for part in room.words().split(": ")[1].split(", ") if part.startswith("3 x")
    ]
    assert room.holds([rate] * 3)
    assert not room.holds([rate + 1000] * 3)


def test_rings_last_as_long_as_there_is_memory_for() -> None:
    for rates, in_firmware, as_files in (
        ([5_000] * 3, 12, 12),
        ([20_000] * 3, 12, 3),
        ([30_000] * 3, 12, 2),
        ([60_000] * 3, 12, 0),
        ([80_000] * 3, 12, 0),
        ([20_000] * 6, 6, 0),
        ([40_000] * 6, 3, 0),
    ):
        assert engine_memory.lasting_ms(rates, room_words(len(rates), IN_FIRMWARE.size)) == in_firmware
        assert engine_memory.lasting_ms(rates, room_words(len(rates), AS_FILES.size)) == as_files
    for lasts_ms in engine_memory.LASTING_MS:
        for rate in (5_000, 60_000, 240_000):
            entries = engine_memory.ring_words(rate, lasts_ms) - 1
            assert entries == 1024 or entries / (2 * rate) >= lasts_ms / 1000


def test_the_largest_rings_find_their_places_first() -> None:
    """Else the small joint's would be in the only block that has room for the large one's."""
    assert engine_memory.lasting_ms([5_000, 240_000], 1960) == 12


def test_a_block_holds_a_ring_of_1024_entries_or_two_of_512() -> None:
    assert engine_memory.blocks(3000) == [1026, 1026, 948]
    assert engine_memory.ring_words(240_000, 3) == 1024 + 1
    assert 2 * engine_memory.ring_words(48_000, 3) == 1026


def test_every_arm_fits_the_largest_memory() -> None:
    """Of the joints that a ring is as large for, the slowest each."""
    slowest = [1] + [
        rate
        for rate in range(2, limits.MAX_STEP_RATE + 1)
        if engine_memory.ring_words(rate, SHORT_MS) > engine_memory.ring_words(rate - 1, SHORT_MS)
    ]
    arms = [
        list(rates)
        for joints in range(1, limits.MAX_JOINTS + 1)
        for rates in combinations_with_replacement(slowest, joints)
        if sum(rates) <= limits.MAX_STEP_RATE_SUM
    ]
    assert len(arms) > 200
    most = max(map(engine_memory.words, arms))
    assert most == engine_memory.words([1, 1, *slowest[1:]])
    assert all(engine_memory.lasting_ms(rates, engine_memory.LARGEST_WORDS) for rates in arms)
    assert not all(engine_memory.lasting_ms(rates, engine_memory.LARGEST_WORDS - 1) for rates in arms)
