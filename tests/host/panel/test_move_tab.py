"""Targets and homing."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.basics.errors import PlanError
from armtempo.kinematics.of_arm import forward
from armtempo.model import home_switches, shipped
from armtempo.model.arm import Arm
from armtempo.model.frame import ArmFrame
from armtempo.model.pose import from_rpy
from armtempo.model.tool_pose import BASE
from armtempo.panel import teaching, words
from armtempo.panel.move_tab import JOINTS
from armtempo.panel.panel_board import PanelBoard

from tests.host import arms
from tests.host.panel.fakes import ARM, board_state, press, unhomed
from tests.host.panel.pages import Page, pages


@pytest.mark.slow
def test_a_typed_pose_is_reached_by_the_nearest_posture() -> None:
    here = np.array([10.0, -60.0, 40.0])
    place = forward(ARM, (20.0, -70.0, 50.0))[:3, 3].tolist()
    wanted = from_rpy(place, (0.0, 0.0, 0.0))
    found = teaching.nearest(ARM, wanted, here)
    assert forward(ARM, found)[:3, 3] == pytest.approx(place, abs=0.1)
    with pytest.raises(PlanError):
        teaching.nearest(ARM, from_rpy((9999.0, 0.0, 0.0), (0.0, 0.0, 0.0)), here)
    ar4 = Arm.of("ar4")
    with pytest.raises(PlanError, match="why not") as refused:
        teaching.nearest(ar4, from_rpy((900.0, 0.0, 474.0), (0.0, 90.0, 0.0)), np.array(ar4.home_deg))
    assert "misses it by" in (said := words.of_error(refused.value))
    assert "which comes to x " in said
    assert "tolerance" not in said
    assert said.endswith("or ask for less of its orientation")
    assert "why not" not in said  # a table for the terminal


def test_no_page_waits_while_a_typed_pose_is_searched_for(
    operator: PanelBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    operator.live.state = board_state()
    asked: list[threading.Thread] = []

    def nearest(*_: object) -> np.ndarray:
        asked.append(threading.current_thread())
        return np.array([10.0, -50.0, 40.0])

    monkeypatch.setattr(teaching, "nearest", nearest)
    with pages(operator) as page:
        page.unfold(words.TYPED_TARGET)
        page.named(words.FORM_OF_TARGET).value = "pose"
        shown: list[object] = []
        page.of.show_ghost = shown.append  # type: ignore[method-assign]
        page.fire(page.named(words.SHOW), "click")
        assert len(shown) == len(asked) == 1
        page.named(words.ONE_CLICK).value = True
        go = page.named(f"{words.GO}: {words.TYPED_TARGET}")
        page.of.holds[int(go.props["data-hold"])](press(operator))
        page.done()
        assert len(shown) == len(asked) == 2  # where it goes is shown too
        assert threading.main_thread() not in asked


def test_what_the_switches_home_is_named_in_its_order() -> None:
    assert home_switches.order(ARM) == []
    ar4 = Arm.of("ar4")
    groups = home_switches.order(ar4)
    assert sorted(name for group in groups for name in group) == sorted(joint.name for joint in ar4.driven)
    assert groups[: len(ar4.homing)] == list(ar4.homing)


def test_an_output_is_marked_as_the_board_says_and_set_by_a_press(
    operator_of: Callable[[Arm], PanelBoard], tmp_path: Path
) -> None:
    operator = operator_of(arms.load(tmp_path, arms.GRIPPER))
    operator.live.state = board_state()
    with pages(operator) as page:
        page.press("gripper: closed")
        assert operator.board.calls == [("output", "gripper", "closed")]  # type: ignore[attr-defined]
        pressed = page.named("gripper: closed").props
        assert pressed["aria-pressed"] == "false"  # until the board says it
        operator.live.outputs = {"gripper": "closed"}
        page.look()
        assert pressed["aria-pressed"] == "true"


def test_a_jog_that_is_not_possible_is_grey_with_the_reason(operator: PanelBoard) -> None:
    operator.live.state = unhomed()
    with pages(operator) as page:
        plus = page.named("joint 1 +")
        assert words.NOT_HOMED in [one.reason for one in page.of.controls if one.element is plus]
        operator.live.state = board_state()
        page.look()
        assert plus.enabled
        page.named(words.FRAME).value = BASE
        _found(page)
        assert not page.named("⟳ x +").enabled
        reasons = [control.reason for control in page.of.controls if control.element is page.named("⟳ x +")]
        assert "the arm cannot turn the tool about x from here" in reasons[0]
        page.named(words.FRAME).value = JOINTS
        page.look()
        assert page.named("⟳ x +").enabled  # what is not in view is not asked for


def test_the_tool_is_jogged_along_the_axes_of_a_frame(operator_of: Callable[[Arm], PanelBoard]) -> None:
    turned = ((0.0, -1.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    operator = operator_of(replace(ARM, frames=(ArmFrame("tray", turned), ArmFrame("joints", turned))))
    operator.live.state = board_state()
    with pages(operator) as page:
        assert "tray z +" not in page.names()  # the first view does not wait for what it does not show
        assert _in_view(page.named("joint 1 +"))
        page.named(words.FRAME).value = "joints"
        assert _in_view(page.named("joints z +"))
        assert not _in_view(page.named("joint 1 +"))
        page.named(words.FRAME).value = "tray"
        _found(page)
        turn = page.named("⟳ tray y +")  # about the base's x
        (reason,) = [control.reason for control in page.of.controls if control.element is turn]
        assert "the arm cannot turn the tool about tray-y from here" in reason


def _found(page: Page) -> None:
    """Show why jogs are not possible, which a thread finds out."""
    page.look()
    page.operator.live.draw()
    page.look()


def _in_view(element: Any) -> bool:
    return all(around.visible for around in element.ancestors(include_self=True))


def test_a_typed_pose_is_in_the_chosen_frame(operator_of: Callable[[Arm], PanelBoard]) -> None:
    turned = ((0.0, -1.0, 0.0, 50.0), (1.0, 0.0, 0.0, -20.0), (0.0, 0.0, 1.0, 10.0), (0.0, 0.0, 0.0, 1.0))
    operator = operator_of(replace(ARM, frames=(ArmFrame("tray", turned),)))
    operator.live.state = board_state()
    with pages(operator) as page:
        page.unfold(words.TYPED_TARGET)
        there = np.linalg.inv(turned) @ forward(ARM, operator.live.angles_deg)
        page.named(words.FRAME_OF_POSE).value = "tray"
        page.fire(page.named(words.TAKE_PRESENT), "click")
        fields = [page.named(name).value for name in words.POSE_FIELDS]
        assert fields[:3] == pytest.approx(there[:3, 3].tolist(), abs=0.01)
        shown = [page.of.scene]
        page.of.show_ghost = shown.append  # type: ignore[method-assign, assignment]
        page.named(words.FORM_OF_TARGET).value = "pose"
        page.fire(page.named(words.SHOW), "click")
        np.testing.assert_allclose(shown[-1], operator.live.angles_deg, atol=0.1)


def test_homing_names_and_shows_the_posture_of_home_first(
    operator: PanelBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    operator.live.state = unhomed()
    with pages(operator) as page:
        shown: list[Any] = []
        monkeypatch.setattr(page.of, "show_ghost", shown.append)
        page.press(words.HOMING)
        assert "joint 1 0°, joint 2 -60°, joint 3 40°" in page.texts()
        assert shown[0] == pytest.approx(np.array(operator.arm.home_deg))
        assert operator.board.homes == []  # type: ignore[attr-defined]
        page.answer(words.HOME)
        page.done()
        assert operator.board.homes == [None]  # type: ignore[attr-defined]


def test_a_joint_is_homed_alone(operator: PanelBoard) -> None:
    operator.live.state, operator.live.doubt = unhomed(), "it may be elsewhere"
    with pages(operator) as page:
        page.press(words.HOMING)
        page.named(words.WHICH_JOINTS).set_value("joint 2")
        assert "joint 2 -60°" in page.texts()
        page.answer(words.HOME)
        page.done()
        assert operator.board.homes == ["joint 2"]  # type: ignore[attr-defined]
        assert operator.live.doubt  # of the others


def test_homing_by_switches_tells_each_joint_and_claims_no_position(
    operator_of: Callable[[Arm], PanelBoard], monkeypatch: pytest.MonkeyPatch
) -> None:
    operator = operator_of(Arm.of("ar4"))
    operator.live.state = board_state()  # as the board says while it homes
    known: list[bool] = []
    monkeypatch.setattr(operator, "part", lambda *_: known.append(operator.live.known))
    with pages(operator) as page:
        page.press(words.HOMING)
        page.named(words.WHICH_JOINTS).set_value(operator.arm.driven[2].name)
        page.press(words.HOME_BY_SWITCHES)
        page.done()
        assert any("switch seen" in line for line in operator.log.last)
        assert (known, operator.live.known) == ([False], True)


def test_the_table_is_asked_for_where_the_arm_file_names_none(
    operator_of: Callable[[Arm], PanelBoard], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    text = "# mine\n" + shipped.arm_path().read_text()
    (tmp_path / "arm.toml").write_text(text)
    operator = operator_of(Arm.load(tmp_path / "arm.toml"))
    operator.live.state = board_state()
    with pages(operator) as page:
        assert words.NO_FLOOR in page.texts()
        page.press(words.ASK_FLOOR)
        page.named(words.FLOOR_HEIGHT).set_value(1e9)
        page.answer(words.STORE)
        assert (tmp_path / "arm.toml").read_text() == text
        text += "\n[workspace]\nx_mm = [-500, 500]  # by another program, meanwhile\n"
        (tmp_path / "arm.toml").write_text(text)
        page.named(words.FLOOR_HEIGHT).set_value(20.0)
        page.answer(words.STORE)
        page.look()
        assert words.NO_FLOOR not in page.texts()
        assert operator.arm.workspace is not None
        assert operator.arm.workspace.low_mm[::2] == (-500.0, 20.0)
        assert (tmp_path / "arm.toml").read_text().startswith(text.rstrip())
        assert operator.live.arm is operator.jobs.arm is operator.arm  # jogs and plans keep to it
