"""What a plan, and a stored motion, sequence or program, was made with: seen when it has changed, and only then."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import armtempo
import pytest
from armtempo.basics.errors import InputError
from armtempo.cli import stored
from armtempo.encoding import encoded_plan, encoded_program, made_with
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.model.user_program import UserProgram
from armtempo.robot.motions import Motions
from armtempo.robot.position import ArmPosition
from armtempo.robot.programs import Programs
from armtempo.robot.store import BoardStore
from armtempo_shared.motion import Motion

from tests.host import test_pallets as pallets
from tests.host.test_pallets import quick  # noqa: F401  a fixture

MORE = (
    pallets.SMALL
    + pallets.TOOLS
    + """
[tool.spare]
position_mm = [0, 0, 33]

[frame.spare]
position_mm = [1, 2, 3]

[load.cup]
mass_kg = 0.1

[workspace]
floor_mm = -100

[[workspace.keep_out]]
name = "shelf"
frame = "tray"
low_mm = [-900, 500, 0]
high_mm = [-800, 600, 100]
"""
)
JOB = """
name = "j"
path = "through"
refine = 1
iterations = 2
tool = "pen"
holds = "cup"
[[via]]
posture = "home"
[[via]]
frame = "tray"
position_mm = [5, 5, 60]
rpy_deg = [180, 0, 0]
"""
CHANGES = {
    "floor_mm = -100": ("floor_mm = -99", "the workspace, or the radius of a link, has changed since"),
    "low_mm = [-900": ("low_mm = [-901", "the workspace, or the radius of a link, has changed since"),
    "[0, 0, 10]": ("[0, 0, 11]", "tool 'pen' has changed since, or is gone"),
    "[tool.pen]": ("[tool.pencil]", "tool 'pen' has changed since, or is gone"),
    "mass_kg = 0.1": ("mass_kg = 0.2", "load 'cup' has changed since, or is gone"),
    "330, 120": ("331, 120", "frame 'tray' has changed since"),
    "[0, 0, 33]": ("[0, 0, 34]", ""),
    "[1, 2, 3]\n\n": ("[1, 2, 4]\n\n", ""),
}


def arm(folder: Path, more: str = MORE) -> Arm:
    return pallets.arm(folder, more)


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    folder = tmp_path_factory.mktemp("made")
    (folder / "j.toml").write_text(JOB, encoding="utf-8")
    found = arm(folder)
    return armtempo.plan(found, Job.load(folder / "j.toml", found))


@pytest.mark.parametrize("old", CHANGES)
def test_a_plan_and_a_stored_motion_are_old_if_what_they_use_has_changed(
    old: str, plan: Plan, tmp_path: Path
) -> None:
    new, said = CHANGES[old]
    assert old in MORE
    now = arm(tmp_path, MORE.replace(old, new, 1))
    data = encoded_plan.of_plan(plan).data
    assert Motion(data).joints == 6
    made_with.check_stored("j", data, arm(tmp_path))
    if not said:
        made_with.check_plan("j.json", plan, now)
        made_with.check_stored("j", data, now)
        return
    with pytest.raises(InputError, match=said):
        made_with.check_plan("j.json", plan, now)
    with pytest.raises(InputError, match=f"'j' on the board is old: {said}"):
        made_with.check_stored("j", data, now)


def test_the_rows_of_the_arm_count_too_and_a_new_workspace(plan: Plan, tmp_path: Path) -> None:
    found = arm(tmp_path)
    data = encoded_plan.of_plan(plan).data
    for change in ({"d_mm": 170.0}, {"theta_offset_deg": 1.0}, {"parallel_linkage": True}):
        longer = replace(found, joints=(*found.joints[:5], replace(found.joints[5], **change)))
        with pytest.raises(InputError, match="the table of joints has changed since"):
            made_with.check_stored("j", data, longer)
    without = replace(plan, arm=replace(plan.arm, workspace=None))
    with pytest.raises(InputError, match="the workspace, or the radius of a link, has changed since"):
        made_with.check_stored("j", encoded_plan.of_plan(without).data, found)
    bare = encoded_plan.of_trajectory(plan.trajectory, plan.arm)
    made_with.check_stored("j", bare.data, longer)  # of an older version: not known
    assert made_with.of_record(b"ATM4") == {}
    assert made_with.added(bytes(16_300), {"workspace": 1, "rows": 12345, "frame " + 60 * "x": 1}) == bytes(
        16_300
    )


def test_a_stored_sequence_is_old_with_its_pallet_frame_and_tool(tmp_path: Path, quick: None) -> None:  # noqa: F811
    steps = f'[[step]]\ntool = "pen"\n{pallets.STEPS}'
    data = encoded_plan.of_plan(pallets.planned(tmp_path, steps, MORE)).data
    made_with.check_stored("s", data, arm(tmp_path))
    for old, new, said in (
        ("column_mm = 12", "column_mm = 13", "pallet 'tray' has changed since, or is gone"),
        ("[0, 0, 10]", "[0, 0, 11]", "tool 'pen' has changed since, or is gone"),
        ("floor_mm = -100", "floor_mm = -99", "the workspace, or the radius of a link, has changed since"),
    ):
        with pytest.raises(
            InputError, match=f"'s' on the board is old: {said}; plan it again, and upload it"
        ):
            made_with.check_stored("s", data, arm(tmp_path, MORE.replace(old, new)))


def test_a_stored_program_is_old_if_a_place_or_posture_of_it_is_elsewhere(tmp_path: Path) -> None:
    path = tmp_path / "pick.py"
    path.write_text(
        "from armtempo_board import cell\ncell.tool('pen')\ncell.goto('over')\ncell.pallet('tray')\n",
        encoding="utf-8",
    )
    found = arm(tmp_path)
    data = encoded_program.of_program(UserProgram.load(path, found), found).data
    encoded_program.check_stored("pick", data, found)
    spare = MORE + "[posture.unused]\nangles_deg = [1, 2, 3, 4, 5, 6]\n"
    encoded_program.check_stored("pick", data, arm(tmp_path, spare))
    for old, new, said in (
        ("[5, 5, 60]", "[5, 6, 60]", "posture 'over' is elsewhere now"),
        ("[posture.over]", "[posture.under]", "posture 'over' is elsewhere now"),
        ("column_mm = 12", "column_mm = 13", "pallet 'tray' is elsewhere now, or gone"),
        ("columns = 3", "columns = 2", "pallet 'tray' is elsewhere now, or gone"),
        ("[pallet.tray]", "[pallet.try]", "pallet 'tray' is elsewhere now, or gone"),
        ("[0, 0, 10]", "[0, 0, 11]", "posture 'over' is elsewhere now, with tool 'pen'"),
        ("[tool.pen]", "[tool.pin]", "tool 'pen' is gone"),
    ):
        with pytest.raises(InputError, match=f"'pick' on the board is old: {said}; upload its file again"):
            encoded_program.check_stored("pick", data, arm(tmp_path, MORE.replace(old, new)))
    encoded_program.check_stored("pick", data[:-1], found)


class Stored:
    """A board with one record, set up for an arm; whatever else is asked of it fails."""

    def __init__(
        self, name: str, data: bytes, arm: Arm, records: dict[str, bytes] | None = None, **kind: bool
    ) -> None:
        self.arm = arm
        self.client: Any = self
        self.entry = SimpleNamespace(
            name=name, crc=1, joints=6, **{"sequence": False, "program": False, **kind}
        )
        self.data = data
        self.records = records or {}

    def find(self, name: str) -> Any:
        return self.entry if name == self.entry.name else None

    def stored(self) -> list[Any]:
        return [self.entry]

    def fetch(self, name: str) -> bytes:
        return self.records.get(name, self.data)

    def stoppable(self, _: object) -> Any:
        import contextlib

        return contextlib.nullcontext()

    def known_arm(self) -> Arm:
        return self.arm

    def configure(self, _: Arm) -> None:
        pass

    def configure_for(self, *_: object) -> None:
        pass

    def home(self, _: object) -> None:
        pass


def test_a_default_that_is_no_program_starts_nothing_at_power_up(
    plan: Plan,
    quick: None,  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    monkeypatch.setattr("armtempo.robot.store.store", lambda *_: None)
    motion = encoded_plan.of_plan(plan)
    alone = replace(motion, arm=replace(motion.arm, safety=replace(motion.arm.safety, at_power_up="program")))
    for what, told in ((motion, 0), (alone, 1)):
        defaults: list[str] = []
        client = SimpleNamespace(set_default=defaults.append)
        board: Any = SimpleNamespace(client=client, configure_for=lambda *_: None)
        BoardStore(board).upload(what, default=True)
        assert defaults == [motion.name]
        assert len(caplog.messages) == told
    assert "nothing starts at power-up" in caplog.text


def test_what_is_old_is_not_run_by_its_name_and_listed(
    plan: Plan,
    tmp_path: Path,
    quick: None,  # noqa: F811
    caplog: pytest.LogCaptureFixture,
) -> None:
    now = arm(tmp_path, MORE.replace("floor_mm = -100", "floor_mm = -99"))
    defaults: list[str] = []
    motion: Any = Stored("j", encoded_plan.of_plan(plan).data, now)
    with pytest.raises(InputError, match="'j' on the board is old: the workspace"):
        Motions(motion).run("j", out=tmp_path)
    encoded = encoded_plan.of_plan(pallets.planned(tmp_path, more=MORE))
    sequence: Any = Stored("s", encoded.data, now, dict(encoded.records), sequence=True)
    with pytest.raises(InputError, match="'s' on the board is old: the workspace"):
        Motions(sequence).run_sequence("s")
    path = tmp_path / "pick.py"
    path.write_text("from armtempo_board import cell\ncell.goto('over')\n", encoding="utf-8")
    found = arm(tmp_path)
    program: Any = Stored(
        "pick",
        encoded_program.of_program(UserProgram.load(path, found), found).data,
        arm(tmp_path, MORE.replace("[5, 5, 60]", "[5, 6, 60]")),
        program=True,
    )
    with pytest.raises(InputError, match="'pick' on the board is old: posture 'over'"):
        Programs(program).run("pick")
    for board in (motion, sequence, program):
        assert "on the board is old" in stored._old(board, board.entry, board.arm)
        board.entry.default, board.set_default = False, defaults.append
        homed = ArmPosition(board).home  # of a command, the panel and the library
        homed(board.arm)
        board.entry.default = True
        homed(found)
        assert not defaults
        assert not caplog.messages
        homed(board.arm)
        assert caplog.messages.pop().endswith("the board's button starts nothing")
        assert defaults.pop() == ""
        caplog.clear()
    assert not stored._old(motion, motion.entry, found)
