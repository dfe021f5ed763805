"""One command at a time, one client in control; stop, freeze, a board that is not there."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from armtempo.basics.errors import InputError, LinkError, PortInUseError
from armtempo.basics.progress import Progress
from armtempo.model.arm import Arm
from armtempo.panel import words
from armtempo.panel.job_editor import JobEditor
from armtempo.panel.panel_board import Needs, PanelBoard

from tests.host.panel import fakes
from tests.host.panel.fakes import ARM, ME, OTHER, Board, board_state, do, wait


def test_one_command_at_a_time_of_who_has_control(operator: PanelBoard) -> None:
    go = threading.Event()
    do(operator, "wait", ME, go.wait)
    with pytest.raises(InputError, match="wait is under way"):
        do(operator, "more", ME, go.wait)
    with pytest.raises(InputError, match="Another page has control"):
        do(operator, "more", OTHER, go.wait)
    go.set()
    wait(lambda: not operator.busy)
    operator.release(ME)
    with pytest.raises(InputError, match="Take control"):
        do(operator, "more", ME, go.wait)


def test_an_error_of_a_command_is_logged_and_ends_nothing(operator: PanelBoard) -> None:
    def fail() -> None:
        raise LinkError("the arm is elsewhere", "bring it there")

    do(operator, "run", ME, fail)
    wait(lambda: not operator.busy)
    assert "bring it there" in operator.log.last[-1]
    do(operator, "again", ME, lambda: None)


def test_a_second_stop_brakes_again_and_only_an_arm_that_does_not_rest_is_frozen(
    operator: PanelBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    stops = operator.board.asked  # type: ignore[attr-defined]
    operator.freeze()  # nothing was stopped
    operator.stop()
    operator.stop()  # a double click
    operator.freeze()  # at once
    assert [now for now, _ in stops] == [False, False]
    monkeypatch.setattr("armtempo.panel.panel_board.FREEZE_AFTER_S", -1.0)
    assert operator.can_freeze
    operator.freeze()
    assert [now for now, _ in stops] == [False, False, True]
    assert "steps may be lost" in operator.live.doubt  # it stays, until the arm is homed
    operator.home()
    assert operator.live.doubt == ""


@pytest.mark.parametrize("by_panel", [True, False])
def test_a_command_that_is_stopped_before_anything_moves_moves_nothing(
    operator: PanelBoard, by_panel: bool
) -> None:
    """A sequence that is still planned, say: also by a stop of another program."""
    board: Any = operator.board
    began, stopped, reached = threading.Event(), threading.Event(), threading.Event()

    def work() -> None:
        began.set()
        stopped.wait(60)
        operator.preparing(1, 2)
        reached.set()

    do(operator, words.RUN, ME, work)
    began.wait(60)
    operator.stop() if by_panel else board.request_stop(False, "another program")
    stopped.set()
    wait(lambda: not operator.busy)
    assert not reached.is_set()
    assert "Run: stopped: " in operator.log.last[-1]
    assert not board.stops
    do(operator, words.GO_TO, ME, lambda: operator.go("home"))  # the next one moves
    wait(lambda: not operator.busy)
    ((_, _, _, stop, *_),) = [call for call in board.calls if call[0] == "goto"]
    assert not stop.wanted


def test_a_stop_of_an_arm_at_rest_is_no_stop_to_freeze_after(operator: PanelBoard) -> None:
    operator.board.moves = False  # type: ignore[attr-defined]
    operator.stop()
    assert not operator.can_freeze


def test_a_freeze_says_which_joints_nothing_measures(
    operator_of: Callable[[Arm], PanelBoard], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("armtempo.panel.panel_board.FREEZE_AFTER_S", -1.0)
    blind = replace(ARM, joints=tuple(replace(joint, encoder=None) for joint in ARM.joints))
    made = operator_of(blind)
    made.stop()
    made.freeze()
    assert "joint 1, joint 2, joint 3 may have moved on" in made.live.doubt


def test_a_board_that_does_not_answer_can_be_deployed_to_and_nothing_else(tmp_path: Path) -> None:
    board = Board()
    told: list[Callable[[str], object]] = []
    answers = [LinkError("the board runs another program"), PortInUseError("in use by another"), board]

    def connect(sink: object, tell: Callable[[str], object]) -> Board:
        told.append(tell)
        answer = answers.pop(0)
        if isinstance(answer, LinkError):
            raise answer
        return answer

    made = PanelBoard(connect, "port", JobEditor(ARM, tmp_path, None), tmp_path)  # type: ignore[arg-type]
    made.take_control(ME)
    assert "another program" in made.why_not(ME)
    assert "another program" in made.why_not(ME, Needs.BOARD)
    with pytest.raises(LinkError, match="another program"):
        made.board.list()
    deployed: list[int] = []
    for trouble in ("in use by another", ""):
        do(made, "deploy", ME, lambda: made.without_board(lambda: deployed.append(1)), Needs.IDLE)
        wait(lambda: not made.busy)
        assert made.trouble == trouble
    assert len(deployed) == 2
    assert made.board is board  # type: ignore[comparison-overlap]
    told[-1]("the cable is out; waiting for it to come back")
    assert "cable" in made.why_not(ME, Needs.BOARD)
    assert "cable" in made.log.last[-1]
    told[-1]("connected again")
    assert "cable" in made.trouble  # until the board has said its state
    assert "connected" in made.log.last[-1]
    logging.getLogger("armtempo").warning("the link of joint 1 is inside of the floor")  # by a plan
    assert "inside of the floor" in made.log.last[-1]
    made.close()


def test_a_fault_of_ours_does_not_end_the_states(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("armtempo.panel.board_link.LOOK_S", 0.01)
    asked: list[int] = []
    board = Board()

    @contextmanager
    def fail(timeout_s: float) -> Iterator[bool]:
        asked.append(1)
        yield 1 // 0

    board.client.session.by_turns = fail
    made = fakes.operator(board, tmp_path)
    wait(lambda: len(asked) > 3)
    made.close()
    assert "the board's state" in caplog.text


def test_a_plan_of_another_job_is_not_run(operator: PanelBoard) -> None:
    plan: Any = object()
    operator.live.state = board_state()
    needs = Needs.MOVE | Needs.PLAN
    assert operator.why_not(ME, needs) == words.NO_PLAN
    operator.jobs.planned(plan, operator.jobs.version)
    assert operator.why_not(ME, needs) == ""
    operator.jobs.set_angle(0, 0, "5")
    assert operator.why_not(ME, needs) == words.PLAN_IS_OLD


def test_what_moves_is_compared_with_no_plan_but_its_own(operator: PanelBoard) -> None:
    plan: Any = object()
    operator.live.plan = plan  # of a run that has ended
    do(operator, "sequence", ME, lambda: None)
    wait(lambda: not operator.busy)
    assert operator.live.plan is None


def test_a_sequence_is_stored_with_progress_before_it_is_run(operator: PanelBoard) -> None:
    seen: list[float] = []
    plan: Any = object()

    def upload(plan: object, replace: bool, progress: Progress) -> None:
        progress(1, 2)
        seen.append(operator.progress)

    operator.board.upload = upload  # type: ignore[method-assign, assignment]
    operator.run_sequence(plan)
    assert (seen, operator.progress) == ([0.5], 0.0)
    assert [call[:2] for call in operator.board.calls] == [("run_sequence", plan)]  # type: ignore[attr-defined]
