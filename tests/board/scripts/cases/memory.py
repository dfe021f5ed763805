"""The memory for engines: what it hands out, and whether that is what host and board count with."""

import random
import sys

import bare_board
import cases

# isort: split
import stm
import uctypes

from armtempo_board.stepgen.step_generator import StepGenerator  # isort: skip  as program.py: the deepest first
from armtempo_board.app import memory_shares
from armtempo_board.hardware import backup_sram, registers
from armtempo_board.memory import Memory
from armtempo_board.motion.engine_memory import EngineMemory
from armtempo_shared import engine_memory
from machine import mem32

SEED = 5
LARGE = 3 * 1026


def engine_memory_of(words, address):
    """With a memory of that many words."""
    made = EngineMemory(engine_memory.LARGEST_BYTES, address)
    made.make_memory(words)
    return made


def begin_of(part):
    """Its place in the backup SRAM, in words; -1 if it is not there."""
    word = (uctypes.addressof(part) - stm.BKPSRAM) // 4
    return word if 0 <= word < engine_memory.PROCESSOR_WORDS else -1


def parts_of(generator):
    """All words of a step generator."""
    now = generator.subintervals
    windows = [points.words for points in (now.points, now._time_points)]
    own = [generator._solver, generator._law_words, generator.queue]
    return [now.angle, now.time] + windows + [now.angle_measures, now.time_measures] + own


def case_the_backup_sram_is_found():
    bare_board.start()
    assert backup_sram.find() == stm.BKPSRAM
    assert engine_memory_of(LARGE, stm.BKPSRAM).memory.take_for_processor(engine_memory.PROCESSOR_WORDS)


def case_a_memory_that_keeps_nothing_is_not_used():
    """Without any of its three bits nothing is kept; then the words come from the heap."""
    rows = registers.BACKUP_SRAM
    for missing in range(len(rows)):
        bare_board.start()
        registers.BACKUP_SRAM = rows[:missing] + rows[missing + 1 :]
        assert backup_sram.find() == 0
    registers.BACKUP_SRAM = rows
    memory = engine_memory_of(LARGE, 0).memory
    part = memory.take_for_processor(engine_memory.PROCESSOR_WORDS)
    assert begin_of(part) == -1
    assert memory.take(1026) is not None, "it is no part of the blocks"


def case_parts_lie_one_behind_the_other_and_are_0():
    bare_board.start()
    address = backup_sram.find()
    memory = Memory([100], address, 50)
    first, second = memory.take_for_processor(20), memory.take_for_processor(30)
    assert (begin_of(first), begin_of(second)) == (0, 20)
    assert begin_of(memory.take_for_processor(1)) == -1, "what has no space there comes from the blocks"
    for word in range(20):
        assert first[word] == 0
    first[19], second[0] = -(1 << 31), (1 << 31) - 1
    assert (first[19], second[0]) == (-(1 << 31), (1 << 31) - 1), "words are signed"
    assert (mem32[address + 76], mem32[address + 80]) == (first[19], second[0])
    memory.release()
    again = memory.take_for_processor(20)
    assert begin_of(again) == 0 and again[19] == 0


def case_an_engine_takes_what_the_formula_counts():
    """As many words as it says are enough, as far as blocks go; rings never lie where DMA does not reach."""
    print("seed", SEED)
    random.seed(SEED)
    bare_board.start()
    address = backup_sram.find()
    for _ in range(12):
        rates = [random.randrange(1, 240_001) for _ in range(random.randrange(1, 7))]
        words = engine_memory.words(rates)
        while not engine_memory.lasting_ms(rates, words):
            words += 1
        made = engine_memory_of(words, address)
        rings = made.rings(rates)
        generators = [StepGenerator(made.memory) for _ in rates]
        assert [begin_of(ring) for ring in rings] == [-1] * len(rings)
        spans = [(begin_of(part), 4 * words_of(part)) for each in generators for part in parts_of(each)]
        assert sum([size for _, size in spans]) == 4 * len(rates) * sum(engine_memory.GENERATOR_PARTS)
        inside = sorted([(begin, begin + size // 4) for begin, size in spans if begin >= 0])
        for number in range(1, len(inside)):
            assert inside[number - 1][1] == inside[number][0]
        assert inside[-1][1] <= engine_memory.PROCESSOR_WORDS


def words_of(part):
    """How many it has."""
    if sys.implementation.name == "micropython" and isinstance(part, uctypes.struct):
        return uctypes.sizeof(part) // 4
    return len(part)


def case_without_it_there_is_less_for_arms():
    """The words that no other memory has come out of the heap that arms have."""
    before = memory_shares._free
    memory_shares._free = lambda: 40_000
    try:
        bare_board.start()
        with_it = memory_shares.for_engine().size
        backup_sram.find, find = lambda: 0, backup_sram.find
        without = memory_shares.for_engine().size
        backup_sram.find = find
    finally:
        memory_shares._free = before
    assert with_it - without == 4 * engine_memory.PROCESSOR_WORDS


def case_fewer_joints_leave_more_for_rings_where_memory_is_short():
    bare_board.start()
    before = memory_shares._free
    for free, is_short in ((200_000, False), (memory_shares._RESERVE + 8_000, True)):
        memory_shares._free = lambda: free  # noqa: B023
        try:
            made = memory_shares.for_engine()
        finally:
            memory_shares._free = before
        sizes = []
        for joints in (3, 1, 3):
            memory_shares.resize(made, joints)
            sizes.append(made.memory.size)
        more = 2 * (engine_memory.object_bytes(2) - engine_memory.object_bytes(1)) // 4
        assert (sizes[1] - sizes[0], sizes[2] - sizes[0]) == ((more, 0) if is_short else (0, 0))


class Collector:
    """Takes the place of ``gc``: half of the heap is free, all of it after a collection."""

    free = 48_000

    def collect(self):
        self.free = 96_000

    def mem_free(self):
        return self.free


def case_samples_take_their_share_of_what_a_collection_leaves():
    kept, memory_shares.gc = memory_shares.gc, Collector()
    try:
        assert memory_shares.sample_bytes() == 96_000 // 48
    finally:
        memory_shares.gc = kept


cases.run(globals())
