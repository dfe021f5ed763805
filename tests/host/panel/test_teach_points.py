"""Frames and tools in the panel: which tool is jogged, and how both are taught."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from armtempo.kinematics.of_arm import forward
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.tool_pose import BASE
from armtempo.panel import layout, live_texts, words
from armtempo.panel.arm_scene import ArmShape
from armtempo.panel.panel_board import PanelBoard
from nicegui import ui

from tests.host.panel.fakes import board_state, press
from tests.host.panel.pages import Page, pages
from tests.host.test_taught_frames import TILTED, taught_points
from tests.host.test_taught_tools import PLACE, TIP, postures_at

TABLES = """
[frame.tray]
# of mine
position_mm = [250, 0, 20]

[tool.pen]
position_mm = [10, 0, 120]
radius_mm = 8
"""
JOB = """name = "feed"
[[via]]
position_mm = [260, 100, 220]
rpy_deg = [0, 170, 0]
frame = "tray"
[[via]]
position_mm = [270, 60, 220]
rpy_deg = [0, 170, 0]
frame = "tray"
"""


@pytest.fixture
def operator(
    operator_of: Callable[[Arm], PanelBoard], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> PanelBoard:
    """Of an arm of six joints with a frame and a tool in a file of the project folder."""
    monkeypatch.chdir(tmp_path)
    text = shipped.files()["ar4"].read_text(encoding="utf-8") + TABLES
    (tmp_path / "arm.toml").write_text(text, encoding="utf-8")
    made = operator_of(Arm.load(tmp_path / "arm.toml"))
    made.live.state = board_state()
    made.live.angles_deg = np.array((20.0, 10.0, -20.0, 15.0, 40.0, 30.0))
    return made


def choose(page: Page, tool: str) -> None:
    """Choose a tool, as the browser says it."""
    number = ["", *(one.name for one in page.operator.arm.tools)].index(tool)
    page.press(words.TOOL, {"value": number, "label": tool}, "update:modelValue")
    page.look()


def test_the_chosen_tool_is_jogged_shown_and_used_for_poses_and_no_job_takes_it(operator: PanelBoard) -> None:
    here = operator.live.angles_deg
    with pages(operator) as page:
        bare = live_texts.position(operator)
        choose(page, "pen")
        pen = operator.jobs.arm.with_tool("pen")
        assert operator.arm.tool == pen.tool
        assert operator.board.arm is operator.live.arm is operator.arm  # what is jogged, and goes to poses
        assert operator.jobs.arm.tool is operator.sequences.arm.tool is None  # they name their own
        assert live_texts.position(operator) != bare
        assert "x {:.1f}  y {:.1f}  z {:.1f} mm".format(*forward(pen, here)[:3, 3]) in live_texts.position(
            operator
        )
        operator.busy = words.JOG
        page.press(words.TOOL, {"value": 0, "label": ""}, "update:modelValue")
        assert operator.tool == "pen"  # nothing is changed under a motion
        operator.busy = ""
        operator.choose_tool(page.client.id, press(operator), "")
        page.look()  # of a page that did not choose it
        assert page.named(words.TOOL).value == ""
        assert operator.arm.tool is None


def test_a_press_in_sight_of_another_tool_is_not_meant(operator: PanelBoard) -> None:
    with pages(operator) as page:
        before = operator.presses.state
        choose(page, "pen")
        assert operator.presses.state > before


def test_the_picture_has_the_tool_and_the_frames(operator: PanelBoard) -> None:
    shape = ArmShape(operator.arm)
    here = operator.live.angles_deg
    bare, poses = shape.tool(here), shape.poses(here)
    assert bare["name"] == ""
    assert bare["frame"][9:] == bare["from"]
    shape.arm = operator.arm.with_tool("pen")
    pen = shape.tool(here)
    assert pen["name"] == "pen"
    assert np.array(pen["frame"][9:]) * shape.reach_mm == pytest.approx(
        forward(shape.arm, here)[:3, 3], abs=0.01
    )
    assert pen["from"] == bare["from"]  # where it is mounted
    assert pen["radius"] * shape.reach_mm == pytest.approx(8.0, abs=0.01)
    assert shape.poses(here) == poses  # of the links alone
    ((name, columns),) = shape.frames()
    assert name == "tray"
    assert np.array(columns[9:]) * shape.reach_mm == pytest.approx((250.0, 0.0, 20.0), abs=0.01)


def teach(page: Page, kind: str, name: str) -> None:
    page.unfold(words.TEACH_POINTS)
    page.named(words.WHAT_IS_TAUGHT).value = kind
    page.named(words.NAME_OF_TAUGHT).value = name
    page.press(words.BEGIN)


def take(page: Page, angles_deg: list[float]) -> None:
    page.operator.live.angles_deg = np.array(angles_deg)
    page.press(words.TAKE_POINT)
    page.look()


def test_a_frame_is_taught_point_by_point_and_replaced_after_a_question(
    operator: PanelBoard, tmp_path: Path
) -> None:
    file = tmp_path / "arm.toml"
    text = file.read_text(encoding="utf-8")
    o, x, near, y = taught_points(operator.arm, TILTED, [0, 0, 0], [90, 0, 0], [2, 0, 0], [20, 60, 0])
    with pages(operator) as page:
        teach(page, "frame", "tray")
        assert any("a frame 'tray' already" in said for said in page.texts())
        page.answer(words.TEACH_ANEW)
        take(page, o)
        take(page, near)
        assert f"2  a point on the x axis{words.NEXT}" in page.texts()  # that was too near
        take(page, x)
        assert not page.named(words.STORE).enabled
        page.press(words.UNDO)
        take(page, x)
        choose(page, "pen")
        assert not page.named(words.TAKE_POINT).enabled  # the others are of another tool's point
        choose(page, "")
        take(page, y)
        assert not page.named(words.TAKE_POINT).enabled
        assert file.read_text(encoding="utf-8") == text  # until it is stored
        page.press(words.STORE)
        page.look()
        assert any("89.98 and 63.25 mm from the origin" in said for said in page.texts())
        assert any("turns the axes by up to" in said for said in page.texts())
        np.testing.assert_allclose(operator.arm.frame("tray"), TILTED, atol=0.03)
        assert "# of mine" in file.read_text(encoding="utf-8")
        assert page.of.shape.frames() == ArmShape(operator.arm).frames()


def test_a_new_tool_is_taught_from_four_postures_and_can_be_chosen(operator: PanelBoard) -> None:
    with pages(operator) as page:
        teach(page, "tool", "not a name")
        assert page.named(words.BEGIN).enabled  # it was refused
        teach(page, "tool", "brush")
        for angles_deg in postures_at(PLACE).values():
            take(page, list(angles_deg))
        page.press(words.STORE)
        assert any("the postures meet within" in said for said in page.texts())
        choose(page, "brush")
        assert operator.arm.tool is not None
        np.testing.assert_allclose(np.array(operator.arm.tool.matrix)[:3, 3], TIP, atol=0.05)


@pytest.mark.slow
def test_what_the_arm_has_anew_is_offered_on_every_page_and_makes_plans_old(
    operator: PanelBoard, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "feed.toml").write_text(JOB)
    operator.jobs.load(tmp_path / "feed.toml")
    monkeypatch.setattr(layout, "tool_path_mm", lambda *given: np.zeros((len(given[-1]), 3)))
    operator.jobs.planned(
        type(
            "Plan",
            (),
            {
                "name": "feed",
                "arm": operator.arm,
                "frames": ("tray",),
                "loaded_legs": (),
                "legs": (),
                "pallets": (),
                "job": type("Job", (), {"name": "feed", "holds": ""}),
                "total_s": 1.0,
                "trajectory": None,
            },
        )(),
        operator.jobs.version,
    )  # type: ignore[arg-type]
    with pages(operator) as page:
        page.unfold(words.TYPED_TARGET)
        page.named(words.FRAME).value = "tray"
        operator.jobs.solve()
        before = operator.jobs.vias[0].angles_deg
        text = (tmp_path / "arm.toml").read_text() + "\n[posture.away]\nangles_deg = [0, 0, 0, 0, 10, 0]\n"
        operator.arm_changed(arm_of(tmp_path, text))
        page.look()
        page.named("Go to away")
        assert not operator.jobs.plan_is_old  # it has nothing to do with that
        text = text.replace(
            "[250, 0, 20]", "[250, 0, 30]"
        ) + '\n[frame.bin]\nframe = "tray"\nz_mm = 1\n'.replace("z_mm = 1", "position_mm = [0, 0, 1]")
        operator.arm_changed(arm_of(tmp_path, text))
        page.look()
        assert page.named(words.FRAME).value == "tray"
        page.named(words.FRAME).value = "bin"
        page.named("bin x +")
        page.named(words.FRAME).value = "tray"
        assert operator.jobs.plan_is_old
        operator.jobs.solve()
        assert operator.jobs.vias[0].angles_deg != before
        operator.arm_changed(
            arm_of(tmp_path, text.replace("[frame.tray]", "[frame.table]").replace('"tray"', '"table"'))
        )
        page.look()
        assert page.named(words.FRAME).value != "tray"
        assert page.named(words.FRAME_OF_POSE).value == BASE


def test_a_name_is_changed_or_removed_after_a_question_that_says_what_uses_it(
    operator: PanelBoard, tmp_path: Path
) -> None:
    file = tmp_path / "arm.toml"
    text = file.read_text(encoding="utf-8")
    (tmp_path / "feed.toml").write_text(JOB)
    (tmp_path / "turn.py").write_text('cell.frame("tray")\n')
    operator.jobs.load(tmp_path / "feed.toml")
    operator.jobs.set_option("tool", "pen")  # not saved
    with pages(operator) as page:
        choose(page, "pen")
        page.unfold(words.NAMES)
        page.press("Rename frame tray")
        assert 'feed.toml, line 5: frame = "tray"' in page.texts()
        assert 'turn.py, line 1: cell.frame("tray")' in page.texts()
        page.answer(words.RENAME)  # to the same name
        assert file.read_text(encoding="utf-8") == text
        page.named(words.NEW_NAME).value = "plate"
        page.answer(words.RENAME)
        assert file.read_text(encoding="utf-8") == text.replace("[frame.tray]", "[frame.plate]")
        assert (tmp_path / "feed.toml").read_text() == JOB.replace('"tray"', '"plate"')
        assert operator.jobs.text == JOB.replace('"tray"', '"plate"').replace(
            '"feed"', '"feed"\ntool = "pen"', 1
        )
        page.press("Rename tool pen")
        assert "feed.toml, not saved: tool" in page.texts()
        new = [one for one in page.elements(ui.input) if one.props.get("label") == words.NEW_NAME]
        new[-1].value = "nib"  # of this dialog
        page.answer(words.RENAME)
        assert operator.tool == page.named(words.TOOL).value == "nib"  # it stays on the arm
        assert operator.jobs.option("tool") == "nib"
        operator.jobs.undo()  # of the edited option alone
        assert operator.jobs.text == (tmp_path / "feed.toml").read_text()
        assert operator.jobs.is_saved
        page.press("Remove tool nib")
        page.answer(words.REMOVE)
        assert operator.tool == "nib"  # which is jogged
        page.press("Remove frame plate")
        assert any(words.NOT_USED in said for said in page.texts())
        page.answer(words.REMOVE)
        assert not operator.arm.frames
        assert "Remove frame plate" not in page.names()
        assert "radius_mm = 8" in file.read_text(encoding="utf-8")


def arm_of(folder: Path, text: str) -> Arm:
    (folder / "arm.toml").write_text(text)
    return Arm.load(folder / "arm.toml")
