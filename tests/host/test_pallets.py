"""Pallets of an arm file: where their places are, in sequences, and what of them does not fit a board."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import armtempo
import numpy as np
import pytest
from armtempo.basics import json_codec
from armtempo.basics.errors import InputError, LinkError, PlanError
from armtempo.cli import sequences
from armtempo.diagnosis import geometry
from armtempo.encoding import encode, encoded_plan, flash_use, made_with
from armtempo.kinematics.of_arm import forward
from armtempo.link.board_messages import StoredMotion
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.pallet import ArmPallet
from armtempo.model.plan import Plan
from armtempo.model.sequence import Sequence
from armtempo.model.steps import EachPlace, ToPlace
from armtempo.model.tool_pose import Pose
from armtempo.planning import planner, point_to_point, via_points
from armtempo.robot import store

ARM_TEXT = shipped.find("ar4").path.read_text(encoding="utf-8")
TRAY = """
[output.gripper]
kind = "switch"
pin = "PB8"
states = { open = 0, closed = 1 }

[frame.tray]
position_mm = [330, 120, 255]
rpy_deg = [0, 0, -160]

[pallet.tray]
frame = "tray"
position_mm = [1, 2, 3]
rpy_deg = [180, 0, 0]
rows = 2
columns = 3
layers = 2
row_mm = 15
column_mm = 12
layer_mm = 8
above_mm = 20
"""
SMALL = TRAY.replace("rows = 2", "rows = 1").replace("layers = 2", "layers = 1")
STEPS = """
[[step]]
repeat = "tray"
[[step]]
place = "tray"
[[step]]
output = "gripper"
to = "open"
[[step]]
leave = "tray"
speed_mm_s = 30
[[step]]
end = "repeat"
"""


def arm(folder: Path, more: str = TRAY) -> Arm:
    """The arm with a gripper, with more in its file."""
    path = folder / "arm.toml"
    path.write_text(ARM_TEXT + more, encoding="utf-8")
    return Arm.load(path)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Moves in closed form instead of planned ones; a line's end is solved as a line ends, near its start."""

    def plan(arm: Arm, job: Any, progress: object) -> Any:
        here, to = job.via
        end = via_points.nearest(arm, to, here) if isinstance(to, Pose) else to
        return SimpleNamespace(trajectory=point_to_point.straight("goto", here, end, arm), notes=())

    monkeypatch.setattr(planner, "plan", plan)


def planned(folder: Path, steps: str = STEPS, more: str = TRAY, top: str = 'start = "home"') -> Plan:
    """The plan of a sequence of these steps."""
    path = folder / "s.toml"
    path.write_text(f'name = "s"\n{top}\n{steps}', encoding="utf-8")
    found = arm(folder, more)
    return armtempo.plan_sequence(found, Sequence.load(path, found))


def ends_mm(plan: Plan) -> list[list[float]]:
    """Where the tool is at the end of each motion, in the frame of the tray."""
    in_tray = np.linalg.inv(plan.arm.frame("tray"))
    found = []
    for _, leg in plan.loaded_legs:
        angles = list(plan.arm.all_home_deg)
        for joint, angle in zip(plan.arm.driven_indices, leg(leg.duration_s), strict=True):
            angles[joint] = float(angle)
        found.append((in_tray @ forward(plan.arm, angles))[:3, 3].round(1).tolist())
    return found


def test_its_places_are_along_the_axes_of_its_frame(tmp_path: Path) -> None:
    found = arm(tmp_path)
    tray = found.pallet("tray")
    assert tray.places == 12
    assert tray.describe(9) == "row 1, column 3, layer 2 of pallet 'tray'"
    for number, there in ((1, (1, 2, 3)), (3, (25, 2, 3)), (4, (1, 17, 3)), (12, (25, 17, 11))):
        pose = tray.pose(number, found.frames)
        assert pose.frame == "tray"
        np.testing.assert_allclose(np.array(pose.matrix)[:3, 3], (found.frame("tray") @ (*there, 1.0))[:3])
        above = np.array(tray.pose(number, found.frames, above=True).matrix) - np.array(pose.matrix)
        np.testing.assert_allclose(above[:3, 3], 20.0 * found.frame("tray")[:3, 2], atol=1e-9)
    bare = arm(tmp_path, TRAY[: TRAY.index("[frame")])
    assert encode.arm_record(found) == encode.arm_record(bare), "the board knows nothing of it"
    assert json_codec.decode(Arm, json_codec.encode(found), "arm") == found


def test_check_names_a_place_that_is_too_far(tmp_path: Path) -> None:
    assert not [each for each in geometry.findings(arm(tmp_path)) if "pallet" in each.where]
    (found,) = (
        each
        for each in geometry.findings(arm(tmp_path, TRAY.replace("row_mm = 15", "row_mm = -1500")))
        if "pallet" in each.where
    )
    assert "row 2, column 1, layer 2 of pallet 'tray' is 1561 mm from the base" in found.what


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("rows = 2", "rows = 0", "pallet.tray.rows = 0 is not allowed"),
        ("row_mm = 15\n", "", "arm.toml: pallet.tray: 2 rows at the same point; give row_mm"),
        ("layer_mm = 8", "layer_mm = 0", "pallet.tray: 2 layers at the same point"),
        ("rows = 2", "rows = 200", "pallet.tray: 1200 places; give at most 1000"),
        ("above_mm = 20", "above_mm = 0", "pallet.tray.above_mm = 0 is not allowed"),
        (
            'frame = "tray"',
            'frame = "trya"',
            "pallet.tray.frame = 'trya': there is no frame 'trya'; did you mean",
        ),
        ("position_mm = [1, 2, 3]\n", "", "pallet.tray.position_mm is missing"),
        ("rows = 2", "row = 2", "pallet.tray.row: unknown key"),
        ("[pallet.tray]", "[pallet.'a b']", "pallet.a b: the name is not allowed"),
        (
            "rpy_deg = [180, 0, 0]",
            "yaw_deg = 5\n[frame.table]\nposition_mm = [0, 0, 0]\nroll_deg = 5",
            "",
        ),
    ],
)
def test_a_pallet_that_cannot_be_is_refused_with_its_key(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    assert old in TRAY
    with pytest.raises(InputError) as refused:
        arm(tmp_path, TRAY.replace(old, new))
    assert said in str(refused.value)


def test_the_tool_comes_to_each_place_from_above(tmp_path: Path, quick: None) -> None:
    plan = planned(tmp_path)
    places = [(column, row, up) for up in (3, 11) for row in (2, 17) for column in (1, 13, 25)]
    expected = [[x, y, z + over] for x, y, z in places for over in (20, 0, 20)]
    assert ends_mm(plan) == pytest.approx(np.array(expected), abs=0.2)
    assert [row.words for row in plan.rows[:6]] == [
        "row 1, column 1, layer 1 of pallet 'tray'",
        "goto above row 1, column 1, layer 1 of pallet 'tray'",
        "line to row 1, column 1, layer 1 of pallet 'tray'",
        "output gripper open",
        "line to above row 1, column 1, layer 1 of pallet 'tray'",
        "end of place",
    ]
    assert (plan.frames, plan.pallets, len(plan.cycles)) == (("tray",), ("tray",), 12)
    lines = sequences.lines(plan)
    assert any(line.startswith("cycle (step 1, 12 times): ") for line in lines)
    assert f"on the board: 36 motions, {flash_use.of_plan(plan)} bytes of flash" in lines
    many = replace(plan, legs=3 * plan.legs)
    assert flash_use.of_plan(many) > flash_use.EMPTY_BYTES
    (line,) = [each for each in sequences.lines(many) if each.startswith("on the board: 108 motions, ")]
    assert f"more than the {flash_use.EMPTY_BYTES} of a new board: an upload is refused" in line


def test_a_part_of_it_and_from_its_end(tmp_path: Path, quick: None) -> None:
    keys = 'repeat = "tray"\nfirst_place = 3\nlast_place = 4\nreverse = true'
    plan = planned(tmp_path, STEPS.replace('repeat = "tray"', keys))
    down = [end for end in ends_mm(plan) if end[2] < 10]
    assert down == pytest.approx(np.array([[1, 17, 3], [25, 2, 3]]), abs=0.2)


def test_within_another_repeat_it_is_done_again(tmp_path: Path, quick: None) -> None:
    steps = f'[[step]]\nrepeat = "for ever"\n{STEPS.replace("leave", "place")}[[step]]\nend = "repeat"\n'
    plan = planned(tmp_path, steps, SMALL)
    assert sum("output" in row.words for row in plan.rows) == 6, "the first pass comes from home"
    assert [cycle.times for cycle in plan.cycles] == [0]
    encoded_plan.of_plan(plan)


@pytest.mark.slow
def test_a_place_out_of_reach_is_named(tmp_path: Path, quick: None) -> None:
    with pytest.raises(PlanError) as refused:
        planned(tmp_path, more=SMALL.replace("column_mm = 12", "column_mm = 400"))
    assert "s.toml: step[1]" in str(refused.value)
    assert "20 mm above row 1, column 2, layer 1 of pallet 'tray': " in str(refused.value)
    with pytest.raises(PlanError) as refused:
        planned(
            tmp_path,
            more=TRAY.replace("[1, 2, 3]", "[1, 2, -900]").replace("above_mm = 20", "above_mm = 900"),
        )
    assert "s.toml: step[2]" in str(refused.value)
    assert "place: row 1, column 1, layer 1 of pallet 'tray': " in str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            'repeat = "tray"',
            "repeat = 2",
            "step[2].place = 'tray': it is not within a repeat for this pallet",
        ),
        (
            'repeat = "tray"',
            'repeat = "trya"',
            "repeat = 'trya': arm 'AR4-MK3' has no pallet 'trya'",
        ),
        ('place = "tray"', 'place = "tra"', "has no pallet 'tra'; did you mean 'tray'"),
        ('place = "tray"', 'place = "tray"\nline = true', "line: unknown key"),
        ('repeat = "tray"', 'repeat = "tray"\nfirst_place = 13', "first_place = 13 is not allowed"),
        ('repeat = "tray"', "repeat = 2\nreverse = true", "reverse = True is not allowed"),
        (
            'place = "tray"',
            'repeat = "tray"\n[[step]]\nend = "repeat"',
            "within another repeat for pallet 'tray'",
        ),
    ],
)
def test_what_is_wrong_in_a_sequence_is_named(
    tmp_path: Path, old: str, new: str, said: str, quick: None
) -> None:
    with pytest.raises(InputError) as refused:
        planned(tmp_path, STEPS.replace(old, new))
    assert said in str(refused.value)


def test_made_in_code_it_is_checked_too(tmp_path: Path, quick: None) -> None:
    found = arm(tmp_path)
    pallet = ArmPallet("line", Pose.of_matrix(found.frame("tray"), ()), columns=2, column_mm=10.0)
    with pytest.raises(InputError, match="two pallets are called 'line'"):
        replace(found, pallets=(pallet, pallet))
    steps = (EachPlace((ToPlace("line"), ToPlace("line", leave=True)), "line", first=3),)
    with pytest.raises(InputError, match="places 3 to 2 of the 2 of pallet 'line'"):
        armtempo.plan_sequence(replace(found, pallets=(pallet,)), Sequence("s", steps))
    with pytest.raises(InputError, match="nothing is repeated"):
        armtempo.plan_sequence(replace(found, pallets=(pallet,)), Sequence("s", (EachPlace((), "line"),)))


def test_the_solutions_of_all_places_are_near_each_other() -> None:
    ar4 = Arm.load("ar4")
    first = Pose.of_matrix(forward(ar4, [10, 10, 20, 170, 40, -150]))
    pallet = ArmPallet("tray", first, rows=3, columns=3, row_mm=20.0, column_mm=-15.0)
    above = np.array([place.above_deg for place in via_points.places(ar4, pallet)])
    assert np.abs(np.diff(above, axis=0)).max() < 30.0


def test_one_that_has_changed_makes_a_plan_old(tmp_path: Path, quick: None) -> None:
    plan = planned(tmp_path, more=SMALL)
    made_with.check_plan("s.json", plan, arm(tmp_path, SMALL))
    with pytest.raises(InputError, match=r"s.json is old: pallet 'tray' has changed since"):
        made_with.check_plan("s.json", plan, arm(tmp_path, SMALL.replace("column_mm = 12", "column_mm = 13")))
    with pytest.raises(InputError, match="pallet 'tray' has changed since, or is gone"):
        made_with.check_plan("s.json", plan, arm(tmp_path, SMALL.replace("[pallet.tray]", "[pallet.other]")))
    with pytest.raises(InputError, match="frame 'tray' has changed since"):
        made_with.check_plan("s.json", plan, arm(tmp_path, SMALL.replace("330", "331")))


class Flash:
    """A board of which only the flash matters."""

    def __init__(self, free: int, stored: tuple[StoredMotion, ...] = ()) -> None:
        self.free = free
        self.kept = stored
        self.uploaded: list[str] = []

    def need(self, *_: str) -> None:
        """It has everything."""

    def hello(self) -> Any:
        """How much is free."""
        return SimpleNamespace(free_flash=self.free)

    def stored(self) -> tuple[StoredMotion, ...]:
        """What it has."""
        return self.kept

    def upload(self, name: str, *_: object) -> None:
        """Note it."""
        self.uploaded.append(name)


def test_what_the_flash_cannot_take_is_refused_before_anything_is_stored(tmp_path: Path, quick: None) -> None:
    encoded = encoded_plan.of_plan(planned(tmp_path, more=SMALL))
    sizes = [len(motion.data) for motion in encoded.legs] + [len(encoded.data)]
    needed = sum(map(flash_use.in_blocks, sizes))
    with_names = flash_use.of_plan(encoded.plan)
    assert needed < with_names < needed + 10 * 4 * 32
    board: Any = Flash(with_names + flash_use.BLOCK)
    store.store(board, encoded.records)
    assert len(board.uploaded) == len(sizes)
    full: Any = Flash(with_names - flash_use.BLOCK)
    with pytest.raises(
        LinkError, match=rf"10 records take \d+ bytes of the board's flash, of which {full.free} are"
    ):
        store.store(full, encoded.records)
    assert not full.uploaded


# the tool of each step

TOOLS = """
[tool.pen]
position_mm = [0, 0, 10]

[posture.over]
frame = "tray"
position_mm = [5, 5, 60]
rpy_deg = [180, 0, 0]
"""


def tool_at_ends(plan: Plan) -> list[np.ndarray]:
    """Where the tool of each motion is at its end."""
    return [forward(on, leg(leg.duration_s)) for on, leg in plan.loaded_legs]


def tools_of(plan: Plan) -> list[str]:
    return [leg.tool for leg in plan.legs]


def test_a_step_changes_the_tool_of_the_motions_after_it(tmp_path: Path, quick: None) -> None:
    steps = '[[step]]\ngoto = "over"\n[[step]]\ntool = "pen"\n[[step]]\ngoto = "over"\n'
    plan = planned(tmp_path, steps + STEPS.replace("leave", "place"), SMALL + TOOLS)
    assert tools_of(plan) == ["nothing", *["pen"] * (len(plan.legs) - 1)]
    over = np.array(plan.arm.posture("over").where.matrix)  # type: ignore[union-attr]
    for at_end in tool_at_ends(plan)[:2]:
        np.testing.assert_allclose(at_end, over, atol=0.1)
    there = plan.legs[1].trajectory
    assert not np.allclose(there(0.0), there(there.duration_s), atol=0.1)
    place = np.array(plan.arm.pallets[0].pose(1, plan.arm.frames).matrix)
    np.testing.assert_allclose(tool_at_ends(plan)[3], place, atol=0.1)
    plan.save(tmp_path / "s.json")
    assert tools_of(Plan.load(tmp_path / "s.json")) == tools_of(plan)
    changed = arm(tmp_path, SMALL + TOOLS.replace("[0, 0, 10]", "[0, 0, 11]"))
    with pytest.raises(InputError, match=r"s.json is old: tool 'pen' has changed since, or is gone"):
        made_with.check_plan("s.json", plan, changed)


def test_a_tool_that_changes_in_a_repeat_makes_its_first_pass_another(tmp_path: Path, quick: None) -> None:
    steps = '[[step]]\nrepeat = 5\n[[step]]\ngoto = "over"\n[[step]]\ntool = "pen"\n[[step]]\ngoto = "home"\n'
    plan = planned(tmp_path, f'{steps}[[step]]\nend = "repeat"\n', SMALL + TOOLS)
    assert [row.words for row in plan.rows].count("goto over") == 2
    assert (tools_of(plan), plan.cycles[0].times) == (["nothing", "pen", "pen", "pen"], 5)
    with pytest.raises(
        InputError, match=r"step\[2\]\.tool: arm 'AR4-MK3' has no tool 'pin'; did you mean 'pen'"
    ):
        planned(tmp_path, '[[step]]\ngoto = "over"\n[[step]]\ntool = "pin"\n', SMALL + TOOLS)


def test_a_job_for_another_tool_is_refused_until_a_step_puts_it_on(tmp_path: Path, quick: None) -> None:
    (tmp_path / "j.toml").write_text(
        'name = "j"\ntool = "pen"\nvia_deg = [[0, 0, 0, 0, 0, 0], [5, 0, 0, 0, 0, 0]]\n'
    )
    run = '[[step]]\nrun = "j.toml"\n'
    with pytest.raises(InputError, match="it is for tool 'pen', but the sequence has no tool here"):
        planned(tmp_path, run, SMALL + TOOLS)
    back = '[[step]]\ngoto = "home"\n[[step]]\ntool = "nothing"\n'
    with_tool = f'[[step]]\ntool = "pen"\n{run}{back}'
    assert tools_of(planned(tmp_path, with_tool, SMALL + TOOLS)) == ["pen", "pen"]
    with pytest.raises(InputError, match="it is for tool 'pen', but the sequence has no tool here"):
        planned(tmp_path, with_tool + run, SMALL + TOOLS)
