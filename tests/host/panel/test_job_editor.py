"""The job that the panel edits: keys and comments belong to their via point, nothing of the file is lost."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.basics.errors import ArmtempoError, InputError
from armtempo.kinematics.of_arm import forward
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.panel import file_editor
from armtempo.panel.job_editor import JobEditor
from armtempo.panel.toml_blocks import TomlBlocks
from armtempo.panel.via_rows import ANGLES, POSE, Via

from tests.host import test_frames, test_tools

ARM = Arm.paper()
TABLES = """# my job
name = "feed"  # its name
seed = 7

# where it begins
[[via]]
angles_deg = [0, -60, 40]

[[via]]  # the lift
angles_deg = [5, -65, 45]
line = true  # straight up
tolerance_mm = 0.25

# over the tray
[[via]]
position_mm = [{place}]
stop = true
dwell_s = 0.5

[[via]]
posture = "home"

[parameters]
Pa = 0.3  # of the search
"""


def _place(*angles: float) -> str:
    return ", ".join(f"{value:.3f}" for value in forward(ARM, angles)[:3, 3])


@pytest.fixture
def editor(tmp_path: Path) -> JobEditor:
    """An editor with a job that has everything that a table can show, and more."""
    (tmp_path / "job.toml").write_text(TABLES.format(place=_place(12, -70, 50)))
    (tmp_path / "rows.toml").write_text(
        'name = "rows"  # its name\nvia_deg = [\n    [0, -60, 40],  # the first\n    [20, -75, 50],\n]\n'
    )
    (tmp_path / "day.toml").write_text('name = "day"\n[[step]]\ngoto = "home"\n')
    (tmp_path / "damaged.toml").write_text("[[via")
    return JobEditor(ARM, tmp_path, tmp_path / "job.toml")


def comments(text: str) -> set[str]:
    """All comments."""
    return {line.partition("#")[2].strip() for line in text.splitlines() if "#" in line}


def test_via_points_of_an_arm_with_a_slide_are_written_without_degrees(tmp_path: Path) -> None:
    """And an arm that only turns may have them so too: what is changed keeps its key."""
    editor = JobEditor(Arm.load("scara_z"), tmp_path, None)
    assert "via_joints = [" in editor.text
    editor.set_angle(1, 0, "50")
    editor.insert(1, [10.0, 1.0, 1.0, 1.0])
    editor.set_key(1, "stop", "true")
    assert editor.job().via == ((0, 0, 0, 0), (10, 1, 1, 1), (50, 0, 0, 0))
    assert "joints = [10.0" in editor.text
    assert "deg" not in editor.text
    editor.set_pose(1)
    assert editor.vias[1].form == POSE
    file = tmp_path / "turning.toml"
    file.write_text('name = "a"\n[[via]]\njoints = [0, -60, 40]\n[[via]]\njoints = [5, -60, 40]\n')
    turning = JobEditor(ARM, tmp_path, file)
    assert turning.vias[0].form == ANGLES
    turning.set_angle(0, 0, "3")
    assert "joints = [3, -60, 40]" in turning.text
    assert turning.job().via[0] == (3, -60, 40)


def test_the_files_are_the_jobs_of_the_folder(editor: JobEditor) -> None:
    assert editor.files() == ["damaged.toml", "job.toml", "rows.toml"]
    with pytest.raises(InputError, match="no such job"):
        editor.open("../job.toml")


def test_a_file_that_was_not_changed_is_saved_as_it_was(editor: JobEditor) -> None:
    assert editor.file is not None
    before = editor.file.read_text()
    assert editor.is_saved
    editor.save()
    assert editor.file.read_text() == before


def test_keys_and_comments_go_with_their_via_point(editor: JobEditor) -> None:
    text = editor.text
    editor.move(1, 1)  # the line comes after the tray
    assert [via.form for via in editor.vias] == [ANGLES, POSE, ANGLES, "posture"]
    assert [via.text("line") for via in editor.vias] == ["", "", "true", ""]
    assert [via.text("stop") for via in editor.vias] == ["", "true", "", ""]
    assert (
        editor.text.index("# over the tray")
        < editor.text.index("position_mm")
        < editor.text.index("# the lift")
    )
    assert comments(editor.text) == comments(text)
    editor.delete(0)  # no other via point gets its keys
    assert [via.text("line") for via in editor.vias] == ["", "true", ""]
    assert [via.text("dwell_s") for via in editor.vias] == ["0.5", "", ""]
    with pytest.raises(InputError, match="P0"):  # it stops where the motion begins
        editor.job()
    editor.undo()
    editor.undo()
    assert editor.text == text
    assert not editor.can_undo


def solved(editor: JobEditor) -> list[Via]:
    editor.solve()
    return editor.vias


def test_a_pose_stays_a_pose_and_is_kept_when_others_change(editor: JobEditor) -> None:
    assert editor.vias[2].angles_deg is None
    with pytest.raises(InputError, match="being searched for"):
        editor.set_own_angles(2)
    angles = solved(editor)[2].angles_deg
    assert angles == pytest.approx((12, -70, 50), abs=0.2)
    editor.set_angle(0, 0, "1.5")
    editor.set_key(1, "speed_mm_s", "20")
    file = editor.save()
    text = file.read_text()
    assert text == TABLES.format(place=_place(12, -70, 50)).replace("[0, -60, 40]", "[1.5, -60, 40]").replace(
        "tolerance_mm = 0.25\n", "tolerance_mm = 0.25\nspeed_mm_s = 20\n"
    )
    job = Job.load(file, ARM)
    assert [way.speed_mm_s for way in job.tool_segments] == [20]
    assert job.seed == 7
    assert job.parameters == {"Pa": 0.3}


def test_angles_become_a_pose_and_back(editor: JobEditor) -> None:
    editor.set_pose(0)
    assert editor.vias[0].form == POSE
    assert solved(editor)[0].angles_deg == pytest.approx((0, -60, 40), abs=0.2)
    editor.set_angles(0, (0, -60, 40))
    assert editor.vias[0].values == {ANGLES: [0, -60, 40]}
    editor.set_position(2, [100.0, 100.0, 9999.0])
    assert solved(editor)[2].angles_deg is None  # nothing reaches that
    with pytest.raises(ArmtempoError, match="P2"):
        editor.set_pose(2)


def test_inserted_and_copied_via_points(editor: JobEditor) -> None:
    editor.insert(2)  # where the one before it is, and nothing required on the way
    assert editor.vias[2].values == {ANGLES: [5, -65, 45]}
    editor.copy(1)
    assert editor.vias[2].values == editor.vias[1].values
    editor.insert(6, [1.0, 2.0, 3.00004])
    assert editor.vias[6].values == {ANGLES: [1.0, 2.0, 3.0]}


def test_rows_are_edited_in_their_place(editor: JobEditor) -> None:
    editor.open("rows.toml")
    editor.set_angle(1, 2, "51.5")
    editor.insert(2)
    editor.move(2, -1)
    editor.set_option("path", "free")
    editor.set_option("corridor_mm", "5")
    editor.set_option("corridor_mm", "")
    with pytest.raises(InputError, match="comments in via_deg would be lost"):
        editor.set_key(1, "line", "true")
    text = editor.save().read_text()
    assert "[0, -60, 40],  # the first" in text
    assert "# its name" in text
    job = Job.load(editor.folder / "rows.toml", ARM)
    assert job.path == "free"
    assert job.corridor_mm is None
    assert job.via == ((0, -60, 40), (20, -75, 51.5), (20, -75, 51.5))


def test_rows_become_tables_for_a_line(editor: JobEditor) -> None:
    editor.new("fresh")
    editor.set_angle(1, 0, "10")
    editor.set_key(1, "line", "true")
    assert [via.values for via in editor.vias] == [
        {ANGLES: [0, -60, 40]},
        {ANGLES: [10, -60, 40], "line": True},
    ]
    assert len(editor.job().tool_segments) == 1
    assert editor.save() == editor.folder / "fresh.toml"


def test_pasted_rows_replace_angles_and_lose_no_keys(editor: JobEditor) -> None:
    with pytest.raises(InputError, match="keys, such as lines"):
        editor.set_vias([{ANGLES: [0, -60, 40]}, {ANGLES: [1, -60, 40]}])
    editor.open("rows.toml")
    editor.set_vias([{POSE: [250.0, 0.0, 100.0]}, {POSE: [250.0, 10.0, 100.0]}])
    assert [via.form for via in editor.vias] == [POSE, POSE]
    assert "# its name" in editor.text
    editor.set_vias([{ANGLES: [0, -60, 40]}, {ANGLES: [1, -60, 40]}])
    assert [via.angles_deg for via in editor.vias] == [(0, -60, 40), (1, -60, 40)]


def test_a_plan_is_old_after_a_change(editor: JobEditor) -> None:
    plan: Any = object()
    editor.planned(plan, editor.version)
    assert not editor.plan_is_old
    editor.set_angle(0, 0, "2")
    assert editor.plan_is_old
    editor.undo()
    assert editor.plan_is_old  # as a whole it is not compared
    editor.planned(plan, editor.version - 1)  # it was changed while it was planned
    assert editor.plan_is_old
    editor.open("rows.toml")
    assert editor.plan is None


@pytest.mark.parametrize("change", ["other program", "outside", "invalid", "exists", "full"])
def test_what_cannot_be_saved_is_refused_and_nothing_is_written(
    editor: JobEditor, tmp_path: Path, change: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert editor.file is not None
    file = editor.file
    if change == "other program":
        file.write_text(file.read_text() + "# more\n")
        said, call = "changed by another program", editor.save
    elif change == "outside":
        (tmp_path / "inner").mkdir()
        editor = JobEditor(ARM, tmp_path / "inner", file)
        editor.set_angle(0, 0, "2")
        said, call = "outside of the project folder", editor.save
    elif change == "invalid":
        editor.set_angle(0, 0, "999")
        said, call = "within the range of joint 1", editor.save
    elif change == "full":

        def full(file: Path, text: str) -> None:
            raise InputError("No space left on device", "free some")

        monkeypatch.setattr(file_editor, "replace_text", full)
        editor.set_angle(0, 0, "2")
        said, call = "No space left", lambda: editor.save_as("other")
    else:
        said, call = "rows.toml exists already", lambda: editor.save_as("rows")
    edited = editor.text, editor.file, editor.can_undo
    before = {path: path.read_text() for path in tmp_path.glob("*.toml")}
    with pytest.raises(InputError, match=said):
        call()
    assert {path: path.read_text() for path in tmp_path.glob("*.toml")} == before
    assert (editor.text, editor.file, editor.can_undo) == edited


def test_a_job_is_saved_under_another_name(editor: JobEditor) -> None:
    assert editor.file is not None
    before = editor.file.read_text()
    with pytest.raises(InputError, match="not a valid name"):
        editor.save_as("no good")
    file = editor.save_as("other")
    assert file.read_text() == before.replace('"feed"', '"other"')
    assert (editor.file, editor.name) == (file, "other")
    assert (editor.folder / "job.toml").read_text() == before


@pytest.mark.parametrize("text", ["", "a", "[1,", "1e999", "[1, 2, 3]", "true", '"'])
def test_whatever_is_typed_is_refused_in_words_and_undone(editor: JobEditor, text: str) -> None:
    before = editor.text
    editor.set_angle(0, 1, text)
    with pytest.raises(InputError):
        editor.job()
    editor.undo()
    assert editor.text == before
    editor.set_key(1, "blend_mm", text)
    editor.set_option("refine", text)
    while editor.can_undo:
        editor.undo()
    assert editor.text == before


def test_blocks_keep_what_is_around_them() -> None:
    text = TABLES.format(place="1, 2, 3")
    blocks = TomlBlocks(text, "via")
    assert blocks.text == text
    assert [table.splitlines()[0] for table in blocks.tables] == [
        "# where it begins",
        "[[via]]  # the lift",
        "# over the tray",
        "[[via]]",
    ]
    assert blocks.tail.startswith("[parameters]")
    with pytest.raises(InputError, match="one after the other"):
        TomlBlocks('[[via]]\nposture = "a"\n[parameters]\nPa = 1\n[[via]]\nposture = "b"\n', "via")


def test_poses_stay_in_their_frame(tmp_path: Path) -> None:
    arm = Arm.load(test_frames.arm_file(tmp_path))
    place = test_frames.place_of(arm, [20.0, -40.0, 30.0], "tray")
    (tmp_path / "job.toml").write_text(
        f'name = "j"\nframe = "tray"\n[[via]]\nangles_deg = [0, -60, 40]\n[[via]]\nposition_mm = {place}\n'
        f'[[via]]\nframe = "table"\nposition_mm = {test_frames.place_of(arm, [25.0, -45.0, 30.0], "table")}\n',
        encoding="utf-8",
    )
    editor = JobEditor(arm, tmp_path, tmp_path / "job.toml")
    there = np.array([forward(arm, angles)[:3, 3] for angles in ([20.0, -40.0, 30.0], [25.0, -45.0, 30.0])])
    there += (3.0, -2.0, 4.0)
    for number, place in enumerate(there.tolist(), 1):
        editor.set_position(number, place)
    for via, place in zip(solved(editor)[1:], there, strict=True):
        np.testing.assert_allclose(forward(arm, via.angles_deg)[:3, 3], place, atol=0.1)
    editor.set_angles(2, [25.0, -45.0, 30.0])
    assert "frame" not in editor.vias[2].values
    editor.set_pose(2)
    assert editor.vias[2].values["position_mm"] == pytest.approx(
        test_frames.place_of(arm, [25, -45, 30], "tray"), abs=1e-3
    )
    editor.insert(3)
    editor.set_key(1, "frame", "base")
    editor.insert(2)
    assert editor.vias[2].values == editor.vias[1].values, "with its frame"
    assert editor.job().frames == ("tray",)


def test_poses_are_of_the_jobs_tool(tmp_path: Path) -> None:
    arm = Arm.load(test_tools.arm_file(tmp_path))
    (tmp_path / "job.toml").write_text(f'tool = "gripper"\n{test_tools.JOB}', encoding="utf-8")
    editor = JobEditor(arm, tmp_path, tmp_path / "job.toml")
    editor.solve()
    editor.set_pose(1)
    place = forward(arm.with_tool("gripper"), [20, 10, -10, 5, 40, 8])[:3, 3]
    assert editor.vias[1].values["position_mm"] == pytest.approx(place.tolist(), abs=1e-3)
    assert solved(editor)[1].angles_deg == pytest.approx([20, 10, -10, 5, 40, 8], abs=0.02)
    editor.set_option("tool", "")
    assert editor.tooled_arm.tool is None
    assert editor.tooled_arm == arm
