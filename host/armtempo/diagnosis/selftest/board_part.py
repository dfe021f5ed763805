"""Identity of the board: firmware, clocks, memory, flash; cost of the program's work."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from armtempo_shared.limits import TICK_HZ

from armtempo.diagnosis.finding import Level
from armtempo.diagnosis.selftest.result import Measurement, judged

BOARD, CYCLES, MEMORY = "board", "cycles", "memory"
_CORE_HZ = 2 * TICK_HZ
_TOLERANCE = 0.002
"""Tolerance of the ratio of two clocks from one crystal: reading both takes some microseconds of 50 ms."""
EMITTED = {2: 700, 512: 8770}
"""Instructions of the ring interrupt's ``emit`` by edges, as ``board: selftest/cycles.py`` calls it; tests count."""
TURN = {"byte_code": 252, "machine_code": 22}
"""Instructions of a turn of the small loops of ``board: selftest/cycles.py``, as MicroPython 1.29 compiles them.

Counted by ``python -m tests.benchmark.selftest_heap``.
"""
EVALUATED = 2_590_000
"""Instructions of the evaluator, byte code and machine code, for ``motion.evaluated``; counted there too."""
_WAIT_STATES = 5
_CACHES = 0x700  # FLASH_ACR: prefetch, instruction cache, data cache (RM0090 3.9.1)
_SLOWEST_WRITE_MS = 4000
_LEAST_HEAP = 30_000
_OTHER_FIRMWARE = (
    "flash a firmware that sets the chip to 168 MHz and fits the board's crystal ('armtempo flash')"
)


def judge(found: dict[str, Any], board_id: str) -> Iterator[Measurement]:
    """Lines about ``found`` of ``board: selftest/identity.py``."""
    yield Measurement(
        BOARD, "firmware", f"MicroPython {found['version']}, {found['machine']}", "", Level.NOTE
    )
    yield judged(
        BOARD,
        "unique id",
        found["unique_id"],
        "as the program says",
        found["unique_id"] == board_id,
        "another board answers: plug in only one",
    )
    yield from _clocks(found["freq"], found["clocks"])
    acr = found["acr"]
    yield judged(
        BOARD,
        "flash wait states, caches",
        f"{acr & 15}, {'all on' if acr & _CACHES == _CACHES else 'not all on'}",
        f"{_WAIT_STATES}, all on",
        acr & 15 == _WAIT_STATES and acr & _CACHES == _CACHES,
        _OTHER_FIRMWARE,
    )
    yield from _flash(found["flash"])
    yield _backup_sram(found["backup_cycles"])
    yield judged(
        MEMORY,
        "heap without the program, largest block",
        f"{found['heap']}, {found['largest']} bytes",
        f"{_LEAST_HEAP} or more",
        found["heap"] >= _LEAST_HEAP,
        "flash a firmware with the program in it: 'armtempo flash'",
    )


def _clocks(freq: list[int], clocks: dict[str, int]) -> Iterator[Measurement]:
    yield judged(
        BOARD,
        "core, APB1, APB2 clock",
        ", ".join(f"{freq[index] / 1e6:g}" for index in (0, 2, 3)) + " MHz",
        "168, 42, 84 MHz",
        [freq[index] for index in (0, 2, 3)] == [_CORE_HZ, _CORE_HZ // 4, _CORE_HZ // 2],
        _OTHER_FIRMWARE,
    )
    per_tick = clocks["cycles"] / max(clocks["tim2"], 1)
    yield judged(
        BOARD,
        "cycles a tick of TIM2",
        f"{per_tick:.3f}",
        "2.000",
        abs(per_tick - 2) < 2 * _TOLERANCE,
        f"TIM2 does not count 84 MHz, so every motion would last wrong: {_OTHER_FIRMWARE}",
    )
    per_us = clocks["cycles"] / max(clocks["us"], 1)
    yield judged(
        BOARD,
        "cycles a microsecond of SysTick",
        f"{per_us:.2f}",
        f"{_CORE_HZ / 1e6:.2f}",
        abs(per_us - _CORE_HZ / 1e6) < _TOLERANCE * _CORE_HZ / 1e6,
        _OTHER_FIRMWARE,
    )


def _backup_sram(access: float | None) -> Measurement:
    return judged(
        BOARD,
        "backup SRAM",
        "none"
        if access is None
        else f"keeps what is written; a read takes {access:+.2f} cycles more than of the heap",
        "keeps what is written",
        access is not None,
        "none: the engine takes its 4 KB from the heap, and less is left for motions",
    )


def _flash(found: dict[str, Any] | None) -> Iterator[Measurement]:
    if found is None:
        yield Measurement(
            BOARD, "flash speed", "left out: no space for a file of 4 KB", "", Level.NOTE,
            "remove motions: 'armtempo remove'",
        )  # fmt: skip
        return
    yield judged(
        BOARD,
        "flash: erase and write, read 4 KB",
        f"{found['write_ms']}, {found['read_ms']} ms, no interrupt for {found['stall_us'] / 1000:.1f} ms"
        f"{'' if found['same'] else ', read back otherwise'}",
        f"write below {_SLOWEST_WRITE_MS} ms, the same read back",
        found["same"] and found["write_ms"] < _SLOWEST_WRITE_MS,
        "the flash may be worn: back motions up ('armtempo show'), then format it ('armtempo help recovery')",
    )


def judge_cycles(found: dict[str, float]) -> Iterator[Measurement]:
    """Lines about ``found`` of ``board: selftest/cycles.py``: figures, without a verdict."""
    for name, words in (
        ("byte_code", "a pass of a small loop in byte code"),
        ("machine_code", "the same in machine code"),
        ("collection", "a collection of the heap"),
    ):
        took = f"{found[name]:.1f} cycles, {1e6 * found[name] / _CORE_HZ:.2f} us"
        if instructions := TURN.get(name):
            took += f", {found[name] / instructions:.2f} an instruction of {instructions}"
        yield Measurement(CYCLES, words, took if found[name] else "takes no simulated time")
    emitted = EMITTED[512] - EMITTED[2]
    for name, words, instructions in (
        ("edges", f"510 edges by the ring interrupt, {emitted} instructions", emitted),
        ("evaluator", f"1067 steps by the evaluator, {EVALUATED} instructions", EVALUATED),
    ):
        per = found[name] / instructions
        took = f"{found[name]} cycles, {per:.2f} an instruction"
        yield Measurement(CYCLES, words, took if per > 0.01 else "takes no simulated time")
