"""Cuts the power, fails or fills the flash at every single change of every operation of the store.

What is stored afterwards is the old (o) or the new (n), and once it is the new it stays that.
"""

import cases
import flash
import stand_in

stand_in.install()

from armtempo_board import step_rates  # noqa: E402
from armtempo_board.errors import Refused  # noqa: E402
from armtempo_board.storage import measured_rates, motion_file, store  # noqa: E402
from armtempo_shared import codes, wire  # noqa: E402

ARM = stand_in.arm()
OLD = stand_in.record(ARM, segments=3)
NEW = stand_in.record(ARM, segments=4)
NEW_ARM = stand_in.arm(joints=3)


def put(place, file_name, data):
    place.begin(file_name, len(data))
    for at in range(0, len(data), 100):
        place.write(at, data[at : at + 100])
    if place.commit(wire.record_crc(data)) == wire.ARM_RECORD_NAME:
        place.take_arm(True)


def fresh(undone=False):
    chip = flash.Flash(undone)
    store.os = chip
    store.open = motion_file.open = chip.open
    place = store.Store("/flash/armtempo")
    put(place, "feed", OLD)
    put(place, "spare", OLD)
    put(place, wire.ARM_RECORD_NAME, ARM)
    place.set_default("feed")
    chip.sync()
    chip.changes = 0
    return chip, place


def content(place):
    """All that the store holds; every record must be whole."""
    found = [place.default(), wire.record_crc(place.read(wire.ARM_RECORD_NAME))]
    for name in place.names():
        data = place.read(name)
        assert data in (OLD, NEW), name
        found.append((name, data == NEW))
    return found


def letter(found, before, after):
    if found == after:
        return "n"
    assert found == before, (found, before, after)
    return "o"


FAILURES = ((None, "cut", False), (None, "cut and undone", True), (flash.EIO, "error", False))
FAILURES += ((flash.ENOSPC, "full", False),)


def run(operation):
    """The operation at every failure; prints what is stored after each."""
    chip, place = fresh()
    before = content(place)
    operation(place)
    changes = chip.changes
    assert changes > 1
    after = content(place)
    assert before != after
    for error, word, undone in FAILURES:
        letters = ""
        for fail_at in range(1, changes + 2):
            place = after_failure(operation, fail_at, error, undone)
            letters += letter(content(place), before, after)
            again(operation, place, after)
        print(word, letters)
        assert letters[-1] == "n", "what was acknowledged is lost"
        if error is None:
            assert letters == "o" * letters.count("o") + "n" * letters.count("n"), letters
            assert "o" in letters


def after_failure(operation, fail_at, error, undone):
    """The store when the operation failed at that change, the last being none of its; after a cut, started again."""
    chip, place = fresh(undone)
    chip.fail_at = fail_at
    chip.error = error
    refused = attempt(operation, place, error)
    if error is None:
        return restarted(chip)
    ended = chip.changes < fail_at
    failed = codes.FLASH_FULL if error == flash.ENOSPC else codes.FLASH_ERROR
    assert refused == (0 if ended else failed), refused
    return place


def restarted(chip):
    """A store on the flash as a cut left it, whose start was itself cut short at every change there is."""
    for fail_at in range(1, 10):
        chip.power_up()
        chip.changes = 0
        chip.fail_at = fail_at
        try:
            place = store.Store("/flash/armtempo")
            break
        except flash.PowerCut:
            pass
    chip.fail_at = 0
    assert not [name for name in chip.files if name.endswith(".new")], chip.files
    return place


def attempt(operation, place, error):
    try:
        operation(place)
    except flash.PowerCut:
        assert error is None
    except Refused as refusal:
        return refusal.code
    return 0


def again(operation, place, after):
    """What was cut short can be done again."""
    if content(place) != after:
        operation(place)
    assert content(place) == after


def case_a_flash_with_too_few_blocks_refuses_before_it_writes():
    """With each number of free blocks, for a new name and an old one: the folder may grow by one."""
    needed = -(-len(NEW) // flash.BLOCK) + 1
    for name in ("other", "feed"):
        taken = 0
        for free in range(2 * needed):
            chip, place = fresh()
            chip.free_blocks = free
            before, changes = content(place), chip.changes
            try:
                put(place, name, NEW)
                taken += 1
            except Refused as refused:
                assert (refused.code, refused.value) == (codes.FLASH_FULL, free * flash.BLOCK)
                assert (content(place), chip.changes) == (before, changes), "something was written"
        assert taken == needed, (name, taken)


def case_put():
    run(lambda place: put(place, "other", NEW))
    run(lambda place: put(place, "feed", NEW))
    run(lambda place: put(place, wire.ARM_RECORD_NAME, NEW_ARM))


def case_remove_and_rename():
    run(lambda place: place.remove("feed"))
    run(lambda place: place.rename("feed", "food"))
    run(lambda place: place.rename("spare", "food"))


def case_set_the_default_and_none():
    run(lambda place: place.set_default("spare"))
    run(lambda place: place.set_default(""))


def case_measured_rates_count_for_their_chip_and_program_only():
    chip, _ = fresh()
    measured_rates.open = chip.open
    measured_rates.write("/flash/armtempo", b"chip", 5, (200_000, 150_000, 3))
    whole = chip.files["/flash/armtempo/rates.bin"]
    for data, board_id, program_crc, expected in (
        (whole, b"other", 5, (240_000, 240_000, 0)),
        (whole, b"chip", 6, (240_000, 240_000, 0)),
        (whole[:-1], b"chip", 5, (240_000, 240_000, 0)),
        (b"", b"chip", 5, (240_000, 240_000, 0)),
        (whole, b"chip", 5, (200_000, 150_000, 3)),
    ):
        chip.files["/flash/armtempo/rates.bin"] = data
        measured_rates.read("/flash/armtempo", board_id, program_crc)
        assert (step_rates.one, step_rates.together, step_rates.joints) == expected


cases.run(globals())
