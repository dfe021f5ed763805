"""One arm after the other: random records, uploads, runs, removals; nothing of them may stay in the heap.

Registers are plain memory. Arguments: folder of the store, number of changes, seed. Prints what the first and the last
change, which are to the same arm, left: bytes in use, largest free block; then how many arms were taken, and refused.
"""

import gc
import random
import sys

sys.path.insert(0, __file__.rsplit("/", 2)[0] + "/rigs/bare")

import machine
import stand_in
import stm
from arm_rows import HEAD, row
from armtempo_board.selftest.common import largest
from armtempo_shared import armrecord, engine_memory, motion, wire


class Time:
    """In the place of the module: where the program waits, the counters run."""

    def ticks_ms(self):
        return stand_in.Clock.now_ms

    def ticks_diff(self, late, early):
        return late - early

    def sleep_us(self, wait_us):
        for name in ("TIM2", "TIM5"):
            stm.BLOCKS[name][9] = stm.BLOCKS[name][9] + 84 * wait_us & 0xFFFFFFFF


machine.unique_id = lambda: b"123456789012"
sys.modules["time"] = Time()

from armtempo_board.app.app import App  # noqa: E402

FREE_BYTES = 12_000
"""Bytes of memory for engines, about as on stock MicroPython."""


def arm_of(rates, outputs):
    """That many switches, or a servo too, on pins of ports C and D; as many inputs on port B."""
    rows = [row(channel=n, max_rate=rate, counts_num=0, counts_den=1) for n, rate in enumerate(rates)]
    names = [name for name, _ in armrecord.OUTPUT]
    table = [dict(dict.fromkeys(names, 0), pin=0x20 + number) for number in range(outputs)]
    if outputs > 1:
        table[0].update(timer=10, channel=1, prescaler=51, period=64614, high=8077)
    inputs = [{"pin": 0x11 + number, "active_high": 0, "debounce_ms": 5} for number in range(outputs)]
    return armrecord.pack(dict(HEAD, identity=1), rows, table, inputs)


def motion_of(arm, segments):
    """All joints go 20 steps up, slowly, and stay."""
    points = [min(max(i - 4, 0), 2) * 10 << 28 for i in range(segments + 5)]
    times = [(i - 2) * 8_400_000 << 16 for i in range(segments + 5)]
    return motion.pack(
        5,
        [points] * arm[5],
        [times] * arm[5],
        1,
        ((6,) * motion.REST_ENTRIES, (6,) * motion.OTHER_ENTRIES, 14, 0),
        wire.record_crc(arm),
    )


def change(host, rates, segments, outputs):
    """Whether the arm was taken, and its motion run."""
    arm = arm_of(rates, outputs)
    before = host.hello()[1]
    answer = host.upload("/arm", arm)[-1]
    if answer[0] == "error":
        needed = engine_memory.needed_bytes(rates)
        assert answer[1] == "no_engine_memory" and answer[3] == needed, answer
        assert host.hello()[1][9] == before[9], "the old arm stays in force"
        return False
    record = motion_of(arm, segments)
    assert host.upload("go", record)[-1] == ("ok", (), b"")
    assert host.ask("home", ((1 << len(rates)) - 1,), bytes(4 * len(rates)))[0] == "ok"
    started = host.ask("start", (0, wire.record_crc(record)), "go")
    assert started[0] == "ok", started
    if outputs:
        assert host.ask("output", (0, 65535))[0] == "ok"
    assert host.ask("stop", (1,))[0] == "ok"
    assert host.ask("list", (0,))[0] == "ok"
    assert host.ask("remove", (), "go")[0] == "ok"
    return True


def main(root, count, seed):
    random.seed(seed)
    from armtempo_board.app import memory_shares

    memory_shares._free = lambda: FREE_BYTES + memory_shares._RESERVE + engine_memory.object_bytes(6)
    memory_shares._USUAL_JOINTS = 6
    port = stand_in.Port()
    app = App(port, root)
    host = stand_in.Host(app, port)
    assert change(host, [20_000], 3, 2)  # names stay in memory for good
    taken = 0
    for number in range(count):
        rates = [random.randrange(1_000, 240_001) for _ in range(random.randrange(1, 7))]
        outputs = random.choice((0, 0, 1, 2, 8))
        if number in (0, count - 1):
            rates, outputs = [20_000] * 3, 0
        taken += change(host, rates, random.randrange(3, 60), outputs)
        host.events = []
        if number in (0, count - 1):
            rates = None
            size = largest()
            print(gc.mem_alloc(), size)
    print(taken, count - taken)


main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
