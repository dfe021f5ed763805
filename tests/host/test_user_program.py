"""Users' programs on the host: refusals with their lines, marks, the record; the page's examples without a board."""

from __future__ import annotations

import ast
import re
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from armtempo import testing
from armtempo.basics.errors import InputError, LinkError, PlanError
from armtempo.deploy import program_files
from armtempo.diagnosis.arm_check import check_arm
from armtempo.encoding import encode, encoded_plan, encoded_program
from armtempo.kinematics.chain import all_angles_deg
from armtempo.kinematics.of_arm import forward
from armtempo.link import Client
from armtempo.link.board_messages import Hello
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.parts import LimitSwitches
from armtempo.model.plan import Plan
from armtempo.model.tool_pose import Pose
from armtempo.model.user_program import UserProgram
from armtempo.model.workspace import KeepOut, Workspace
from armtempo.robot import programs
from armtempo_board.app.cell import CellError
from armtempo_shared import armrecord
from armtempo_shared.program import ProgramRecord, needed_bytes

from tests.host import test_pallets as pallets
from tests.interpreters import ROOT
from tests.system.commandline import run as run_command
from tests.system.commandline import small_plan

PAGE = (ROOT / "host" / "docs" / "programs.md").read_text()
ARM_FILE = shipped.arm_path().parent / "pick_and_place" / "arm.toml"
ARM = Arm.load(ARM_FILE)
CHIP_BYTES = 32_000
"""Free on the chip with an arm of six joints (host/docs/measurements.md)."""
HEAD = "from armtempo_board import cell\n"


def example(name: str, folder: Path) -> Path:
    """A program of the page as a file."""
    (found,) = re.findall(rf"^```py\n# {name}\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    (folder / name).write_text(found)
    return folder / name


def written(text: str, folder: Path, name: str = "pick.py") -> Path:
    (folder / name).write_text(HEAD + text)
    return folder / name


@pytest.mark.parametrize(
    ("text", "line", "problem"),
    [
        ("x = = 1\n", 2, "invalid syntax"),
        ("\ncell.goto('hom')\n", 3, "no posture 'hom'"),
        ("cell.goto((0, -50))\n", 2, r"\(0, -50\) is no posture"),
        ("cell.goto([0, 'up', 30])\n", 2, "is no posture"),
        (
            "cell.goto(posture=(0, 1e3, 30), speed=0.3)\n",
            2,
            "joint 2 at 1000 degrees is outside of its range",
        ),
        ("cell.goto('home', line=True)\n", 2, "plan a motion with a straight line of the tool"),
        ("cell.move('home')\n", 2, "the cell has no 'move'"),
        ("cell.at(3)\n", 2, "the cell has no 'at'"),
        ("cell.goto()\n", 2, "missing a required argument"),
        ("cell.goto('home', pace=1)\n", 2, "unexpected keyword argument 'pace'"),
        ("cell.set('grip', 'open')\n", 2, "no output 'grip'"),
        ("cell.set('gripper', 'ajar')\n", 2, "no state 'ajar'"),
        ("cell.set('gripper', value=200.0)\n", 2, "its range is"),
        ("cell.wait('parts')\n", 2, "no input 'parts'"),
        ("cell.count('a b')\n", 2, "not a valid name"),
        ("cell.run('my motion')\n", 2, "not a valid name"),
        ("cell.run('')\n", 2, "'' is not a valid name"),
        ("cell.set('', 1)\n", 2, "no output ''"),
        ("cell.tool('')\n", 2, "the name of the tool is empty"),
        ("import time\ntime.sleep(1)\n", 3, "keeps the board from its work"),
        ("from time import sleep as rest\nrest(1)\n", 3, "time.sleep keeps the board from its work"),
        ("import utime as t\nt.sleep_ms(20)\n", 3, "time.sleep_ms keeps the board from its work"),
        ("\nname = input('which? ')\n", 3, "waits for a terminal"),
        ("\nexec('while True: pass')\n", 3, r"exec\(\) runs a text in which the board cannot do its work"),
        ("x = [eval('1 + 1')]\n", 2, r"eval\(\) runs a text"),
        ("import machine\nmachine.reset()\n", 3, "restarts the board, and the arm's position is lost"),
        ("from machine import Pin\nPin('PA15', Pin.OUT)\n", 3, "PA15 is taken for STEP of channel 1"),
        ("import pyb\nled = pyb.Pin(pyb.Pin.board.E12)\n", 3, "PE12 is taken for ENABLE of the drivers"),
        ("import machine\nmachine.Pin('PB8').value(1)\n", 3, "PB8 is output 'gripper' of the arm"),
        ("import pyb\nx = pyb.Timer(2, freq=10)\n", 3, "timer 2 is taken for the step pulses"),
        ("import pyb\npyb.USB_VCP().close()\n", 3, "takes the link to the host"),
        ("import _thread\n_thread.start_new_thread(print, ())\n", 3, "MicroPython has no threads"),
        ("import armtempo_board.app.program\n", 2, "is the board's own"),
        ("async def f():\n    await cell.goto('home')\n", 3, "cell.goto is no coroutine"),
        ("async def f():\n    pass\nf()\n", 4, r"f\(\) does nothing, as it is a coroutine"),
        ("cell.serve()\n", 2, r"cell.serve\(\) does nothing"),
        ("\nimport pick\n", 3, "the board gets this file alone, not pick.py beside it"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(text: str, line: int, problem: str, tmp_path: Path) -> None:
    path = written(text, tmp_path)
    with pytest.raises(InputError, match=problem) as raised:
        UserProgram.load(path, ARM)
    assert f"pick.py, line {line}: " in str(raised.value)


def test_what_is_a_programs_own_is_not_refused(tmp_path: Path) -> None:
    text = (
        "import asyncio, time, machine\nfrom pyb import Timer\n"
        "machine.Pin('PC12', machine.Pin.IN).value()\nTimer(12, freq=5)\nmachine.Timer(-1)\ntime.sleep_us(40)\n"
        "async def f():\n    await asyncio.sleep(0)\n"
        "async def main():\n    asyncio.create_task(cell.serve())\n    await f()\nasyncio.run(main())\n"
    )
    assert UserProgram.load(written(text, tmp_path), ARM).source.endswith(text)


def with_switches(*joints: int, **safety: object) -> Arm:
    """The arm with a switch at the low end of some joints, from 1."""
    fitted = [
        replace(joint, switches=LimitSwitches(low=number, low_deg=joint.range_deg[0] + 1.0))
        if number in joints
        else joint
        for number, joint in enumerate(ARM.joints, 1)
    ]
    return replace(ARM, joints=tuple(fitted), safety=replace(ARM.safety, **safety))  # type: ignore[arg-type]


def test_only_an_arm_with_switches_is_homed_by_a_program(tmp_path: Path) -> None:
    path = written("\ncell.home()\n", tmp_path)
    with pytest.raises(InputError, match=r"pick.py, line 3: joint 2: no limit switch whose angle is known"):
        UserProgram.load(path, with_switches(1, 3))
    arm = with_switches(1, 2, 3)
    found = UserProgram.load(path, arm)
    table = Record(encoded_program.of_program(found, arm).data).table()
    assert [[row[0] for row in group] for group in table["homing"]["groups"]] == [[0], [1], [2]]
    number, side, trip, edge, *_ = table["homing"]["groups"][1][0]
    joint = arm.driven[number]
    assert (side, edge) == (-1, round(joint.range_deg[0] * joint.steps_per_deg))
    assert trip == round((joint.range_deg[0] + 1.0) * joint.steps_per_deg)
    assert testing.run(path, arm).calls == [("home",)]
    plain = encoded_program.of_program(UserProgram.load(written("cell.goto('home')\n", tmp_path), arm), arm)
    assert Record(plain.data).table()["homing"] == {}
    with pytest.raises(InputError, match="does not home the arm"):
        programs.check_default(replace(plain, arm=with_switches(1, 2, 3, at_power_up="program")))
    programs.check_default(plain)


@pytest.mark.parametrize(
    ("safety", "switches", "problem"),
    [
        ("estop_fitted = true", 0, "joint 1, joint 2, joint 3: no limit switch"),
        ("", 3, "without an E-stop"),
        ("estop_fitted = true", 3, ""),
    ],
)
def test_what_moves_by_itself_has_switches_and_an_estop(
    safety: str, switches: int, problem: str, tmp_path: Path
) -> None:
    before, *joints = shipped.arm_path().read_text().split("[[joint]]")
    for number, joint in enumerate(Arm.paper().driven[:switches]):
        joints[number] += f"\n[joint.switches]\nlow = {number + 1}\nlow_deg = {joint.range_deg[0]}\n"
    table = f'[safety]\nat_power_up = "program"\n{safety}\n'
    before = re.sub(r"^\[safety\]\n(?:[^\[]*)", "", before, flags=re.MULTILINE) + table
    (tmp_path / "arm.toml").write_text("[[joint]]".join((before, *joints)))
    if not problem:
        record = encode.arm_record(Arm.load(tmp_path / "arm.toml"))
        assert armrecord.unpack(record)[0]["flags"] & armrecord.FLAG_POWER_UP
        return
    with pytest.raises(InputError, match=f'arm.toml: safety.at_power_up = "program": .*{problem}'):
        Arm.load(tmp_path / "arm.toml")


def test_a_way_to_a_switch_that_would_leave_the_workspace_is_told(tmp_path: Path) -> None:
    """Joint 1 turns to its switch at the low end of its range, through what stands there."""
    arm = with_switches(1, 2, 3)
    found = encoded_program.of_program(UserProgram.load(written("cell.home()\n", tmp_path), arm), arm)
    assert not encoded_program.moves_that_touch(found)
    there = forward(arm, all_angles_deg(arm, np.array([arm.driven[0].range_deg[0], *arm.home_deg[1:]])))[
        :3, 3
    ]
    box = KeepOut("post", tuple(there - 5.0), tuple(there + 5.0))
    (problem,) = encoded_program.moves_that_touch(
        replace(found, arm=replace(arm, workspace=Workspace((box,))))
    )
    assert problem.startswith("between home and the switch of joint 1: ")
    assert "post" in problem
    (told,) = [
        each for each in check_arm(replace(arm, workspace=Workspace((box,)))) if each.where == "homing"
    ]
    assert problem in told.what
    plain = encoded_program.of_program(UserProgram.load(written("cell.goto('home')\n", tmp_path), arm), arm)
    assert not encoded_program.moves_that_touch(replace(plain, arm=replace(arm, workspace=Workspace((box,)))))


def test_other_refusals(tmp_path: Path) -> None:
    for name, text in (("my pick.py", HEAD), ("pick.py", "print(1)\n")):
        (tmp_path / name).write_text(text)
        with pytest.raises(InputError):
            UserProgram.load(tmp_path / name, ARM)
    with pytest.raises(InputError, match=r"none\.py: cannot be read"):
        UserProgram.load(tmp_path / "none.py", ARM)
    (tmp_path / "pick.py").write_text(HEAD, encoding="utf-8-sig")  # as Windows' editor may save it
    assert UserProgram.load(tmp_path / "pick.py", ARM).source == HEAD
    path = written("match 3:\n    case 3:\n        pass\n", tmp_path)
    with pytest.raises(InputError, match=r"pick.py, line 2: SyntaxError"):
        program_files.check_syntax(path, path.read_text())
    counts = "".join(f"cell.count('n{number}')\n" for number in range(9))
    with pytest.raises(InputError, match="9 counters"):
        UserProgram.load(written(counts, tmp_path), ARM)
    for deep in ("x = " + "-" * 5000 + "1\n", "x = 1" + " + 1" * 3000 + "\n"):
        with pytest.raises(InputError, match="nested too deep"):
            UserProgram.load(written(deep, tmp_path), ARM)


def test_marks_keep_the_lines_and_the_meaning(tmp_path: Path) -> None:
    text = (
        "from armtempo_board import cell as arm\n"
        "n = 0\n"
        "while arm.active('part') or n < 3:\n"
        "    for á, b in (1, 2), (3, 4):\n"
        "        n += á; arm.say(f'{arm.active(\"part\")}', arm.active(\n            'part'))\n"
        "while (x := n + 1) < 4: n = x\n"
        "print([arm.active('part') for _ in range(3)], n, sum(x * y for x in (1, 2) for y in range(x) if y))\n"
    )
    (tmp_path / "pick.py").write_text(text)
    found = UserProgram.load(tmp_path / "pick.py", ARM)
    lines = [
        [node.lineno for node in ast.walk(ast.parse(each)) if isinstance(node, ast.stmt)]
        for each in (text, found.marked)
    ]
    assert lines[0] == lines[1]
    assert "__at__(3) and (__at__(3, arm).active('part') or n < 3)" in found.marked
    assert "in __each__(4, ((1, 2), (3, 4))):" in found.marked
    assert "for x in __each__(8, ((1, 2))) for y in __each__(8, (range(x))) if y" in found.marked
    run = testing.run(tmp_path / "pick.py", ARM)
    assert run.said == ["False False"] * 2 + ["[False, False, False] 4 2"]


class Record(ProgramRecord):
    """In memory."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        super().__init__(len(data))

    def part(self, offset: int, size: int) -> bytes:
        return self._data[offset : offset + size]


def test_the_record_has_the_arms_names(tmp_path: Path) -> None:
    found = UserProgram.load(written("cell.goto('home')\ncell.count('n')\ncell.run('m')\n", tmp_path), ARM)
    assert (found.postures, found.counters, found.motions) == ({"home": 2}, {"n": 3}, {"m": 4})
    motion = encoded_plan.of_plan(Plan.load(small_plan(tmp_path / "m.json")), "m")
    encoded = encoded_program.of_program(found, ARM, (motion,))
    record = Record(encoded.data)
    table = record.table()
    assert record.source() == found.marked
    assert table["motions"] == {"m": motion.key.crc}
    assert table["counters"] == ["n"]
    assert table["outputs"]["gripper"][0] == 0
    assert set(table["outputs"]["gripper"][3]) == {"open", "closed"}
    assert table["inputs"] == {"part": 0}
    assert len(table["postures"]["home"]) == len(ARM.driven)
    long = UserProgram.load(written("# " + 17_000 * "x" + "\n", tmp_path), ARM)
    with pytest.raises(InputError, match="16384 bytes"):
        encoded_program.of_program(long, ARM)


def test_check_needs_no_board(tmp_path: Path) -> None:
    path = written("cell.goto('home')\ncell.run('m')\n", tmp_path)
    done = run_command("program", path, "--check", "--arm", ARM_FILE, folder=tmp_path, ARMTEMPO_PORT="none")
    assert done.exit_code == 0, done.errors
    assert "bytes of heap on the board" in done.output
    assert "must be on the board: m" in done.output
    path.write_text(HEAD + "cell.goto('hom')\n")
    done = run_command("program", path, "--check", "--arm", ARM_FILE, folder=tmp_path, ARMTEMPO_PORT="none")
    assert done.exit_code == 2
    done.said("pick.py, line 2", "hom")


@pytest.mark.parametrize("name", ["pick_place.py", "pallet.py", "polling.py", "alone.py"])
def test_the_pages_examples_fit_on_the_chip(name: str, tmp_path: Path) -> None:
    found = UserProgram.load(example(name, tmp_path), with_switches(1, 2, 3))
    heap = encoded_program.EncodedProgram(found, ARM, (), b"").heap_bytes
    assert needed_bytes(len(found.marked.encode())) <= heap <= CHIP_BYTES
    assert (heap > needed_bytes(len(found.marked.encode()))) == bool(found.homes)


class Small:
    """A client of a board with little heap, or without sequences; nothing else may be asked of it."""

    def __init__(self, free_heap: int, features: int = 15) -> None:
        fields = dict.fromkeys(Hello.__dataclass_fields__, 0)
        self.info = Hello(**{**fields, "free_heap": free_heap, "features": features})  # type: ignore[arg-type]

    def hello(self) -> Hello:
        return self.info

    def need(self, feature: str, what: str) -> None:
        Client.need(self, feature, what)  # type: ignore[arg-type]


def test_a_board_without_the_memory_for_it_gets_nothing(tmp_path: Path) -> None:
    found = UserProgram.load(written("cell.goto('home')\n", tmp_path), ARM)
    encoded = encoded_program.of_program(found, ARM)
    with pytest.raises(LinkError, match=f"needs {encoded.heap_bytes} bytes") as raised:
        programs.check_memory(Small(encoded.heap_bytes - 1), encoded)  # type: ignore[arg-type]
    assert "armtempo flash" in raised.value.hint
    with pytest.raises(LinkError) as raised:
        programs.check_memory(Small(100_000, features=0), encoded)  # type: ignore[arg-type]
    assert "armtempo flash" in raised.value.hint
    programs.check_memory(Small(encoded.heap_bytes), encoded)  # type: ignore[arg-type]


# armtempo.testing


def test_pick_and_place_and_its_own_test(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The page's test of the page's example."""
    example("pick_place.py", tmp_path)
    (tmp_path / "arm.toml").write_text(ARM_FILE.read_text())
    (code,) = re.findall(r"^```py\n(from armtempo import testing.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(code, names)
    (test,) = (value for name, value in names.items() if name.startswith("test_"))
    assert callable(test)
    test()


@pytest.mark.slow
def test_a_pallet(tmp_path: Path) -> None:
    run = testing.run(example("pallet.py", tmp_path), ARM)
    places = [call[1] for call in run.calls if call[0] == "goto" and call[1] not in ("home", (0, -50, 30))]
    assert len(set(places)) == 12
    assert places[:3] == [
        f"{over}row 1, column 1, layer 1 of pallet 'tray'" for over in ("above ", "", "above ")
    ]
    assert run.said[-1] == "row 2, column 3, layer 1 of pallet 'tray' is filled"
    assert run.counters == {"parts": 6}
    assert not run.stopped
    run = testing.run(tmp_path / "pallet.py", ARM, taken={"tray": 4})
    assert run.said[0] == "pallet 'tray' goes on at row 2, column 2, layer 1"
    assert (run.counters, run.taken) == ({"parts": 2}, {"tray": 0})


TOOLS = """
[tool.long]
position_mm = [0, 0, 400]

[tool.pen]
position_mm = [0, 0, 10]
"""


def six_joints(folder: Path) -> Arm:
    """An arm with a pallet, a posture given as a pose, and tools, one of which is too long for the pallet."""
    return pallets.arm(
        folder,
        pallets.SMALL
        + TOOLS
        + '[posture.over]\nframe = "tray"\nposition_mm = [5, 5, 50]\nrpy_deg = [180, 0, 0]\n',
    )


def test_places_and_postures_are_of_the_tool(tmp_path: Path) -> None:
    arm = six_joints(tmp_path)
    text = (
        "at = []\nfor tool in ('nothing', 'pen'):\n    cell.tool(tool)\n"
        "    tray = cell.pallet('tray')\n    tray.reset(1)\n    cell.goto(tray.next())\n    at.append(cell.posture())\n"
        "    cell.goto('over')\n    at.append(cell.posture())\nprint(at)\ncell.tool('pen')\n"
    )
    found = UserProgram.load(written(text, tmp_path), arm)
    assert (found.pallets, found.tools) == ({"tray": 5}, {"pen": 12})
    run = testing.run(found.path, arm)
    at = ast.literal_eval(run.said[0])
    for number, tool in ((0, "nothing"), (2, "pen")):
        held = arm.with_tool(tool)
        for posture, pose in (
            (at[number], arm.pallet("tray").pose(2, arm.frames)),
            (at[number + 1], arm.posture("over").where),
        ):
            assert isinstance(pose, Pose)
            np.testing.assert_allclose(forward(held, posture), pose.matrix, atol=0.1)
    encoded = encoded_program.of_program(found, arm)
    record = Record(encoded.data)
    first = record.table()["pallets"]["tray"][3]
    assert (first, record.table()["pallets"]["tray"][:3]) == ({"": 0, "pen": 3}, [1, 3, 1])
    steps = record.place(4, 6)
    np.testing.assert_allclose(arm.transmission.angles_of_steps(steps[6:]), at[2], atol=1e-9)
    assert 0.0 < encoded_program.off_line_mm(encoded) < 3.0
    assert record.source() == found.marked


@pytest.mark.slow
def test_a_place_out_of_reach_is_named_with_its_line(tmp_path: Path) -> None:
    arm = six_joints(tmp_path)
    found = UserProgram.load(written("cell.tool('long')\ncell.pallet('tray')\n", tmp_path), arm)
    with pytest.raises(PlanError) as refused:
        encoded_program.of_program(found, arm)
    for said in ("pick.py, line 3, with tool 'long': ", "row 1, column 1, layer 1 of pallet 'tray': "):
        assert said in str(refused.value)
    with pytest.raises(InputError, match=r"pick.py, line 2: .*has no pallet 'try'; did you mean 'tray'"):
        UserProgram.load(written("cell.pallet('try')\n", tmp_path), arm)
    with pytest.raises(InputError, match=r"pick.py, line 2: .*has no tool 'ling'; did you mean 'long'"):
        UserProgram.load(written("cell.tool('ling')\n", tmp_path), arm)
    many = UserProgram.load(written(f"cell.pallet('tray')\n# {16_000 * 'x'}\n", tmp_path), arm)
    with pytest.raises(InputError, match="and 3 places of pallets take more than the 16384 bytes"):
        encoded_program.of_program(many, arm)


def test_a_move_to_a_place_that_would_leave_the_workspace_is_told(tmp_path: Path) -> None:
    arm = six_joints(tmp_path)
    there = np.array(arm.pallet("tray").pose(2, arm.frames, above=True).matrix)[:3, 3]
    box = KeepOut("shelf", tuple(there - 3.0), tuple(there + 3.0))
    text = "cell.tool('pen')\ncell.goto('over')\ncell.pallet('tray')\n"
    found = encoded_program.of_program(UserProgram.load(written(text, tmp_path), arm), arm)
    assert not encoded_program.moves_that_touch(found)
    problems = encoded_program.moves_that_touch(replace(found, arm=replace(arm, workspace=Workspace((box,)))))
    place = "row 1, column 2, layer 1 of pallet 'tray'"
    for said in (
        f"between above {place} and the place: ",
        f"with tool 'pen' between above {place} and the place: ",
    ):
        assert any(each.startswith(said) for each in problems), problems
    assert any(each.startswith(f"between posture 'over' and above {place}: ") for each in problems)


def test_polling_a_sensor_while_moving(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    class Bus:
        def __init__(self, number: int, freq: int) -> None:
            assert (number, freq) == (2, 400_000)

        def readfrom_mem(self, address: int, register: int, size: int) -> bytes:
            seen.append(address)
            return max(0, 60 - len(seen)).to_bytes(size, "big")

    machine = ModuleType("machine")
    machine.I2C = Bus  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "machine", machine)
    run = testing.run(example("polling.py", tmp_path), ARM, motion_s=0.5)
    assert 30 < len(seen) < 40
    assert run.said[0].startswith("at [")


def test_what_a_program_raises_passes_and_endless_ones_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(CellError, match="joint 2 would leave its range"):
        testing.run(written("there = [0, 300, 0]\ncell.goto(there)\n", tmp_path), ARM)
    with pytest.raises(InputError, match="does not exist"):
        testing.run(written("cell.run('none')\n", tmp_path), ARM)
    small_plan(tmp_path / "other.json")
    with pytest.raises(InputError, match="planned for a different arm"):
        testing.run(written("cell.run('other')\n", tmp_path), "ar4")
    with pytest.raises(InputError, match="no input"):
        testing.run(written("pass\n", tmp_path), ARM, {"parts": True})
    with monkeypatch.context() as patch:
        patch.setattr(testing, "LONGEST_S", 1.0)
        run = testing.run(written("while True:\n    pass\n", tmp_path), ARM)
    assert run.stopped
    assert run.time_s == pytest.approx(1.0, abs=0.01)
    run = testing.run(written("cell.set('gripper', 'closed')\ncell.sleep(2)\n", tmp_path), ARM)
    assert run.outputs["gripper"] == pytest.approx(95.0, abs=0.01)
    assert run.time_s >= 2.0
    run = testing.run(written("print('a\\n\\nb')\nprint()\n", tmp_path), ARM)
    assert run.said == ["a", "b"]  # as the host is told
    with pytest.raises(CellError, match="more than 8 counters"):
        testing.run(written("for n in range(9):\n    cell.count('n%d' % n)\n", tmp_path), ARM)
    with pytest.raises(CellError, match="'log': the flash cannot be written while the arm moves"):
        testing.run(
            written("cell.goto([5, -60, 40], wait=False)\nopen('log', 'a')\n", tmp_path), ARM, motion_s=1.0
        )
    monkeypatch.chdir(tmp_path)
    log = "import os\nlog = open('log', 'w')\nlog.write('x')\n"
    with pytest.raises(CellError, match="'log' is still open for writing: close it before the arm moves"):
        testing.run(written(f"{log}cell.goto([5, -60, 40])\n", tmp_path), ARM)
    assert (tmp_path / "log").read_text() == "x"
    moves = f"{log}log.close()\ncell.goto([5, -60, 40], wait=False, line=False)\n"
    for call in ("os.remove('log')", "os.rename('log', 'old')", "from os import mkdir as make; make('new')"):
        with pytest.raises(CellError, match=r"os\.\w+: the flash cannot be written while the arm moves"):
            testing.run(written(f"{moves}{call}\n", tmp_path), ARM, motion_s=1.0)
    testing.run(written(f"{moves}cell.wait()\nos.remove('log')\n", tmp_path), ARM, motion_s=1.0)
    assert not (tmp_path / "log").exists()
    monkeypatch.setitem(sys.modules, "machine", ModuleType("machine"))
    monkeypatch.setattr(sys.modules["machine"], "Pin", lambda pin: pin, raising=False)
    pins = "from machine import Pin\nfor pin in ('PC12', '{}'):\n    Pin(pin)\n"
    testing.run(written(pins.format("PC11"), tmp_path), ARM)
    for pin in ("PA15", "E7", "PB8"):
        with pytest.raises(CellError, match=f"pin {pin[-3:].lstrip('P')} is taken by the arm"):
            testing.run(written(pins.format(pin), tmp_path), ARM)
    with pytest.raises(CellError, match="plan a motion with a straight line"):
        testing.run(written("line = True\ncell.goto('home', line=line)\n", tmp_path), ARM)
    with pytest.raises(NameError):
        testing.run(written("print(__file__)\n", tmp_path), ARM)
    source = (
        "import asyncio\nasync def main():\n    task = asyncio.create_task(cell.serve())\n"
        "    await asyncio.sleep(0)\n    print('in a task')\n    task.cancel()\nasyncio.run(main())\n"
    )
    assert testing.run(written(source, tmp_path), ARM).said == ["in a task"]
