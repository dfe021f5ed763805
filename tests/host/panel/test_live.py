"""What is shown is what the board said."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.kinematics.of_arm import forward
from armtempo.link.board_messages import Positions, Sample
from armtempo.model.tool import ArmTool
from armtempo.panel import layout, live_texts, problem
from armtempo.panel.arm_scene import ArmShape
from armtempo.panel.live import LiveArm
from armtempo.panel.panel_board import PanelBoard
from armtempo.panel.problem import Cure
from nicegui import ui

from tests.host import arms
from tests.host.panel.fakes import ARM, Telling, board_state, unhomed
from tests.host.panel.pages import pages


def test_curves_that_are_read_stay_whole_when_a_run_begins() -> None:
    live = LiveArm(ARM)
    for number in range(4):
        sample = Sample(number // 3, 0, number, number, 0, Positions((0, 0, 0), (0, 0, 0)))
        before = live.curves
        live.take_event(sample)
    assert live.curves is not before
    assert [len(rows) for rows in (before.time_s, before.thinned(9).angle_deg, live.curves.angle_deg)] == [
        3,
        3,
        1,
    ]


def test_the_path_of_a_run_is_that_of_its_tool() -> None:
    live = LiveArm(ARM)
    tip = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 50.0), (0.0, 0.0, 0.0, 1.0))
    live.plan = type("Plan", (), {"arm": replace(ARM, tool=ArmTool("pen", tip))})()  # type: ignore[assignment]
    for number in range(2):
        live.take_event(Sample(1, 0, number, number, 0, Positions((0, 0, 0), (0, 0, 0))))
    live.draw()
    assert live.plan is not None
    there = forward(live.plan.arm, live.curves.angle_deg[0])[:3, 3]
    np.testing.assert_allclose(live.run_path_mm, [there, there])
    assert np.linalg.norm(there - forward(ARM, live.curves.angle_deg[0])[:3, 3]) == pytest.approx(50.0)


def test_an_arm_that_is_not_homed_is_drawn_as_unknown_at_home(operator: PanelBoard) -> None:
    operator.live.ask(Telling(unhomed()))  # type: ignore[arg-type]
    shape = ArmShape(ARM)
    told = layout.message(operator, shape)
    assert (told["links"], told["tool"], told["unknown"]) == (None, None, True)
    assert told["ghost"] == shape.poses(np.array(ARM.home_deg))
    assert told["texts"]["armtempo-where"] == "position unknown"
    assert told["texts"]["armtempo-angle-1"] == "?"
    first, *others = unhomed().joints
    operator.live.ask(Telling(board_state(joints=(replace(first, known=True), *others))))  # type: ignore[arg-type]
    texts = layout.message(operator, shape)["texts"]
    assert [texts[f"armtempo-angle-{number}"] for number in (1, 2)] == ["0.00°", "?"]
    operator.live.ask(Telling(board_state()))  # type: ignore[arg-type]
    told = layout.message(operator, shape)
    assert told["links"] == shape.poses(np.array(ARM.home_deg))
    assert told["texts"]["armtempo-angle-2"] == "-60.00°"


def test_a_page_that_was_not_told_anything_yet_says_where_the_arm_is(
    operator: PanelBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The script, the connection and the first message come up to a second after the page."""
    monkeypatch.setattr(live_texts, "OLD_S", 1000.0)
    operator.live.ask(Telling(board_state()))  # type: ignore[arg-type]
    with pages(operator) as page:
        places = {one.props.get("id"): one.text for one in page.elements(ui.label)}
        assert live_texts.texts(operator).items() <= places.items()


def test_a_state_that_is_old_says_how_old(operator: PanelBoard) -> None:
    operator.live.ask(Telling(board_state(state="moving", moving=True, speed_percent=20.0)))  # type: ignore[arg-type]
    assert live_texts.state_line(operator) == "moving at 20 % · port"
    operator.live.heard_s -= 3.0
    assert re.fullmatch(r"moving at 20 % · last heard 3\.\d s ago · port", live_texts.state_line(operator))


def test_a_picture_of_an_arm_that_is_not_heard_says_how_old_it_is(operator: PanelBoard) -> None:
    operator.live.ask(Telling(board_state()))  # type: ignore[arg-type]
    shape = ArmShape(ARM)
    operator.live.heard_s -= 3.0
    assert not layout.message(operator, shape)["old"]  # a busy machine
    operator.trouble = "the cable is out"
    told = layout.message(operator, shape)
    assert told["old"]
    assert re.fullmatch(r"last heard 3\.\d s ago", told["texts"]["armtempo-unknown"])


def test_a_pause_is_named_as_one(operator: PanelBoard) -> None:
    operator.live.state = board_state(state="moving", moving=True, speed_percent=0.0)
    assert live_texts.state_line(operator).startswith("paused")
    operator.live.held = True  # a jog that was released
    assert live_texts.state_line(operator).startswith("moving")


def test_no_angle_is_minus_zero(operator: PanelBoard) -> None:
    operator.live.angles_deg = np.array([180.0, -38.0, -52.0])
    assert "-0.0" not in live_texts.position(operator)


def test_outputs_and_inputs_are_those_of_the_board(tmp_path: Path) -> None:
    live = LiveArm(arms.load(tmp_path, arms.GRIPPER, arms.PART))
    live.ask(Telling(board_state(arm="paper")))  # type: ignore[arg-type]
    assert (live.outputs, live.inputs) == ({"gripper": "closed"}, {"part": True})


@pytest.mark.parametrize(
    ("what", "said", "cures", "is_fault"),
    [
        ("nothing", "", (), False),
        ("cable", "the cable is out", (), True),
        ("cable in a run", "the cable is out", (), True),
        ("deployed to", "", (), False),
        ("no program", "another program runs", (Cure.DEPLOY,), True),
        ("fault", "E-stop", (Cure.CLEAR,), True),
        ("frozen", "may have moved on", (Cure.HOME,), True),
        ("failed", "run: the arm is elsewhere", (Cure.DISMISS,), True),
        ("unhomed", "Home it", (Cure.HOME,), False),
        ("reset in a run", "run: the board has restarted", (Cure.HOME, Cure.DISMISS), True),
    ],
)
def test_the_banner_says_what_is_wrong_and_has_the_button_that_helps(
    operator: PanelBoard, what: str, said: str, cures: tuple[Cure, ...], is_fault: bool
) -> None:
    live = operator.live
    live.state = board_state()
    if what == "cable":
        operator.trouble = "the cable is out"
    elif what == "cable in a run":
        operator.trouble, operator.busy = "the cable is out", "run"
    elif what == "deployed to":
        operator.trouble, operator.busy, operator._board = "the cable is out", "deploy", None
    elif what == "no program":
        operator.trouble, operator._board = "another program runs", None
    elif what == "fault":
        live.state = board_state(fault="estop")
    elif what == "frozen":
        live.doubt = "joint 1 may have moved on"
    elif what == "failed":
        operator.failure = "run: the arm is elsewhere"
    elif what == "unhomed":
        live.state = unhomed()
    elif what == "reset in a run":
        live.state, operator.failure = unhomed(), "run: the board has restarted"
    found = problem.of(operator)
    assert (found is None) == (not said)
    if found is not None:
        assert said in found.text
        assert (found.cures, found.is_fault) == (cures, is_fault)
        assert "'armtempo" not in found.text
