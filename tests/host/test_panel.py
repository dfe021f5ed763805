"""The panel without a browser: who may ask, one command at a time, one client in control, the job's file."""

from __future__ import annotations

import ast
import asyncio
import ipaddress
import itertools
import json
import math
import os
import re
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.basics import toml_table
from armtempo.basics.errors import InputError, LinkError, PlanError, PortInUseError, RunFolderError
from armtempo.kinematics import Geometry, all_frames
from armtempo.kinematics.chain import all_angles_deg
from armtempo.kinematics.of_arm import forward
from armtempo.link.board_messages import Levels, Positions, Sample
from armtempo.model import mesh_files, shipped
from armtempo.model.arm import Arm
from armtempo.model.room import FAR_MM, ArmRoom, KeepOut
from armtempo.panel import homing, layout, past_runs, problem, teaching, words
from armtempo.panel.access import COOKIE, MOST_BYTES, Access, Policy
from armtempo.panel.arm_scene import ArmShape
from armtempo.panel.hold import ButtonHold
from armtempo.panel.job_editor import JobEditor
from armtempo.panel.live import LiveArm
from armtempo.panel.panel_board import Needs, PanelBoard
from armtempo.panel.press import Press, Presses
from armtempo.panel.problem import Cure
from armtempo.panel.sequence_editor import SequenceEditor
from armtempo.panel.server import listen, reachable
from armtempo.robot.board_state import BoardState, JointState

ARM = Arm.paper()
ME, OTHER = "me", "other"
HELD_S = 2.0
"""In place of ALIVE_S: a busy machine is silent for longer than that."""
_NUMBERS = itertools.count(1)


def press(operator: PanelBoard) -> Press:
    """One that is made now."""
    return Press(next(_NUMBERS), operator.presses.state, operator.presses.clock())


def do(
    operator: PanelBoard, what: str, client: str, call: Callable[[], object], needs: Needs = Needs.MOVE
) -> None:
    """Start a command with a press that is made now."""
    operator.do(what, client, press(operator), call, needs)


async def _inner(scope: Any, receive: Any, send: Any) -> None:
    message = await receive() if scope["type"] == "http" else {"body": b""}
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": message["body"]})


def answer(
    access: Access, kind: str = "http", query: str = "", body: tuple[bytes, ...] = (b"",), **headers: str
) -> list[dict[str, Any]]:
    """What is sent for a request whose ``body`` comes in chunks."""
    sent: list[dict[str, Any]] = []
    given = [(name.replace("_", "-").encode(), value.encode()) for name, value in headers.items()]
    scope = {
        "type": kind,
        "path": "/",
        "query_string": query.encode(),
        "headers": given,
        "client": ("1.2.3.4", 5),
    }
    chunks = list(body)

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": chunks.pop(0), "more_body": bool(chunks)}

    async def send(message: Any) -> None:
        sent.append(message)

    asyncio.run(access(scope, receive, send))
    return sent


def access(token: str = "secret", inner: Any = _inner) -> Access:
    """That of a panel at 127.0.0.1:8088."""
    return Access(inner, {"127.0.0.1", "arm.local"}, token, 8088)


ASKED = {"host": "127.0.0.1:8088", "cookie": f"{COOKIE.format(port=8088)}=secret"}
"""Headers of a request that is served."""
PAGE = {"origin": "http://127.0.0.1:8088"}
"""The further header of a connection."""


@pytest.mark.parametrize(
    ("headers", "allowed"),
    [
        ({}, True),
        ({"origin": "http://127.0.0.1:8088", "sec_fetch_site": "same-origin"}, True),
        ({"sec_fetch_site": "none", "sec_fetch_mode": "navigate"}, True),
        ({"origin": "http://evil.example"}, False),
        ({"origin": "null"}, False),
        ({"origin": "http://["}, False),
        ({"host": "["}, False),
        ({"host": "[::1"}, False),
        ({"host": "evil.example:8088"}, False),
        ({"host": ""}, False),
        ({"sec_fetch_site": "cross-site", "sec_fetch_mode": "no-cors"}, False),
        ({"sec_fetch_site": "cross-site", "sec_fetch_mode": "navigate"}, False),
        ({"sec_fetch_site": "same-site", "sec_fetch_mode": "navigate"}, False),
        ({"content_length": str(MOST_BYTES + 1)}, False),
        ({"content_length": "many"}, False),
        ({"content_length": "\xb2"}, False),
    ],
)
def test_who_may_ask(headers: dict[str, str], allowed: bool, caplog: pytest.LogCaptureFixture) -> None:
    asked = {**ASKED, **headers}
    assert (answer(access(), **asked)[0].get("status") == 200) == allowed
    if not allowed:
        assert "refused '/' from 1.2.3.4" in caplog.text
        refused = answer(access(), "websocket", **{**PAGE, **asked})
        assert [message["type"] for message in refused] == ["websocket.close"]


def test_a_connection_names_the_page_that_it_comes_from() -> None:
    refused = answer(access(), "websocket", **ASKED)
    assert [message["type"] for message in refused] == ["websocket.close"]
    assert answer(access(), "websocket", **ASKED, **PAGE)[0]["type"] != "websocket.close"


def test_a_body_in_chunks_is_whole_or_refused() -> None:
    assert answer(access(), body=(b"a", b"", b"b"), **ASKED)[-1]["body"] == b"ab"
    large = answer(access(), body=(b"x" * MOST_BYTES, b"x", b"not read"), **ASKED)
    assert large[0]["status"] == 413


@pytest.mark.parametrize(
    ("query", "cookie", "allowed"),
    [
        ("token=secret", "", True),
        ("", f"{COOKIE.format(port=8088)}=secret", True),
        ("", f"{COOKIE.format(port=8089)}=secret", False),  # of another panel on this machine
        ("", "", False),
        ("token=Secret", "", False),
        ("token=", f"{COOKIE.format(port=8088)}=", False),
        ("", "a=b; =; \x7f", False),
        ("token=%C3%A9", "", False),
    ],
)
@pytest.mark.parametrize("host", ["arm.local:8088", "127.0.0.1:8088"])
def test_everybody_needs_the_token(host: str, query: str, cookie: str, allowed: bool) -> None:
    sent = answer(access(), query=query, host=host, cookie=cookie)
    assert (sent[0].get("status") == 200) == allowed
    kept = any(b"HttpOnly" in value for name, value in sent[0]["headers"] if name == b"set-cookie")
    assert kept == (query == "token=secret")


def test_an_address_with_the_token_is_opened_from_anywhere_and_framed_nowhere() -> None:
    link = {"host": "127.0.0.1:8088", "sec_fetch_site": "cross-site"}
    start = answer(access(), query="token=secret", **link, sec_fetch_mode="navigate")[0]
    assert start["status"] == 200
    assert (b"x-frame-options", b"DENY") in start["headers"]
    assert answer(access(), query="token=secret", **link, sec_fetch_mode="no-cors")[0]["status"] == 403


def test_a_page_runs_its_own_scripts_only() -> None:
    async def page(scope: Any, receive: Any, send: Any) -> None:
        await send(
            {"type": "http.response.start", "status": 200, "headers": [(b"content-type", b"text/html")]}
        )
        await send({"type": "http.response.body", "body": b"<script>own()</scr", "more_body": True})
        await send({"type": "http.response.body", "body": b"ipt>&lt;script>"})

    start, body = answer(Policy(page), **ASKED)  # type: ignore[arg-type]
    headers = dict(start["headers"])
    (nonce,) = re.findall(rb'nonce="([^"]+)"', body["body"])
    policy = headers[b"content-security-policy"]
    assert int(headers[b"content-length"]) == len(body["body"])
    assert b"script-src 'self' 'nonce-" + nonce in policy
    assert b"frame-ancestors 'none'" in policy
    assert b"unsafe-inline" not in policy.partition(b"script-src")[2].partition(b";")[0]
    assert b"connect-src 'self' ws://127.0.0.1:8088" in policy


@pytest.mark.parametrize(("host", "loopback"), [("0.0.0.0", False), ("127.0.0.1", True), ("::1", True)])
def test_the_printed_addresses_work(host: str, loopback: bool) -> None:
    with listen(host, 0) as listening:
        bound, port = listening.getsockname()[:2]
        addresses = reachable(bound)
        assert addresses
        for address in addresses:
            assert not ipaddress.ip_address(address).is_unspecified
            with socket.create_connection((address, port), timeout=10):
                pass
    assert ipaddress.ip_address(addresses[-1]).is_loopback  # for this machine's browser
    assert ipaddress.ip_address(addresses[0]).is_loopback == (loopback or len(addresses) == 1)


class Clock:
    """One that stands still."""

    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


@pytest.mark.parametrize(
    ("age_s", "meant"), [(0.0, True), (0.29, True), (0.31, False), (15.0, False), (-2.0, False)]
)
def test_a_press_that_comes_late_is_not_meant(age_s: float, meant: bool) -> None:
    """Nor one of the future: the server's machine slept."""
    clock = Clock()
    presses = Presses(lambda: "at rest", clock)
    press = Press(1, presses.state, clock.now_s)
    clock.now_s += age_s
    with nullcontext() if meant else pytest.raises(InputError, match="it arrived more than"):
        presses.take(ME, press)


def test_a_press_is_carried_out_once_in_order_and_in_the_state_that_it_was_made_in() -> None:
    state = ["at rest"]
    presses = Presses(lambda: state[0], Clock())
    first, second, third, fourth = (Press(n, presses.state, 100.0) for n in (1, 2, 3, 4))
    presses.take(ME, second)
    for late in (second, first):  # a second time, and after a later one
        with pytest.raises(InputError, match="arrived twice or out of order"):
            presses.take(ME, late)
    presses.take(OTHER, first)  # each page has numbers of its own
    presses.released(ME, 3)
    with pytest.raises(InputError, match="it was released"):
        presses.take(ME, third)
    state[0] = "moving"
    with pytest.raises(InputError, match="state changed"):
        presses.take(ME, fourth)


@pytest.mark.parametrize(
    "said",
    [
        None,
        5,
        {},
        {"number": 1, "state": 1, "made_s": None},
        {"number": 1.0, "state": 1, "made_s": 1.0},
        {"number": 1, "state": 1, "made_s": math.nan},
        {"number": 1, "state": True, "made_s": math.inf},
        {"number": 1, "state": 1, "made_s": "0"},
    ],
)
def test_what_is_no_press_is_refused(said: object) -> None:
    with pytest.raises(InputError, match="did not say when"):
        Press.of(said)


class Session:
    """A session of nobody's."""

    def listen(self, listener: object) -> None:
        """Nothing is to be heard."""

    def in_a_hurry(self, timeout_s: float) -> Any:
        raise LinkError("nothing answers")


class Jog:
    """A held jog that lasts until it is no longer held."""

    def __init__(self) -> None:
        self.held = 0
        self.ends = ""
        self.angles_deg = ARM.home_deg
        self.ended = threading.Event()

    def __enter__(self) -> Jog:
        return self

    def hold(self, seconds: float) -> bool:
        self.held += 1
        time.sleep(seconds / 10)
        return True

    def __exit__(self, *_: object) -> None:
        self.ended.set()


class Board:
    """A board that only jogs."""

    def __init__(self) -> None:
        self.client = type("Client", (), {"session": Session()})()
        self.jog = Jog()
        self.stops: list[tuple[bool, str]] = []
        self.moves = True
        self.homes = 0

    def configure(self, arm: Arm) -> None:
        """It has this arm."""

    def close(self) -> None:
        """Nothing is open."""

    def home(self, arm: Arm, where: object) -> None:
        self.homes += 1

    def request_stop(self, now: bool, by: str) -> bool:
        self.stops.append((now, by))
        return self.moves


@pytest.fixture
def operator(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[PanelBoard]:
    monkeypatch.setattr("armtempo.panel.panel_board.LOOK_S", 1000.0)  # it is never asked for its state
    monkeypatch.setattr("armtempo.panel.hold.ALIVE_S", HELD_S)
    board = Board()
    made = PanelBoard(lambda sink, tell: board, "sim", JobEditor(ARM, tmp_path, None), tmp_path / "runs")  # type: ignore[arg-type, return-value]
    made.take_control(ME)
    yield made
    made.close()


def wait(condition: Callable[[], bool]) -> None:
    """Until it holds."""
    limit_s = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < limit_s
        time.sleep(0.005)


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
    stops = operator.board.stops  # type: ignore[attr-defined]
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


def test_a_stop_of_an_arm_at_rest_is_no_stop_to_freeze_after(operator: PanelBoard) -> None:
    operator.board.moves = False  # type: ignore[attr-defined]
    operator.stop()
    assert not operator.can_freeze


def test_a_freeze_says_which_joints_nothing_measures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("armtempo.panel.panel_board.LOOK_S", 1000.0)
    monkeypatch.setattr("armtempo.panel.panel_board.FREEZE_AFTER_S", -1.0)
    blind = replace(ARM, joints=tuple(replace(joint, encoder=None) for joint in ARM.joints))
    made = PanelBoard(lambda sink, tell: Board(), "sim", JobEditor(blind, tmp_path, None), tmp_path)  # type: ignore[arg-type, return-value]
    made.stop()
    made.freeze()
    assert "joint 1, joint 2, joint 3 may have moved on" in made.live.doubt
    made.close()


def test_a_held_button_moves_nothing_before_its_target_was_seen(operator: PanelBoard) -> None:
    hold, jog = ButtonHold(operator), operator.board.jog  # type: ignore[attr-defined]
    begun = press(operator)
    hold.press(ME, begun, "home", lambda: jog, after_s=1000.0)
    time.sleep(0.05)
    hold.release(ME, begun.number)
    wait(lambda: not operator.busy)
    assert not jog.held
    assert not jog.ended.is_set()


@pytest.mark.parametrize("how", ["released", "silent", "late", "other in control", "lost"])
def test_a_jog_ends_with_its_button(operator: PanelBoard, how: str) -> None:
    hold, jog = ButtonHold(operator), operator.board.jog  # type: ignore[attr-defined]
    begun = press(operator)
    hold.press(ME, begun, "jog", lambda: jog)
    wait(lambda: hold.alive(ME, replace(begun, made_s=operator.presses.clock())) or jog.held > 2)
    begin_s = time.monotonic()
    if how == "released":
        hold.release(ME, begun.number)
    elif how == "other in control":
        operator.take_control(OTHER)
    elif how == "lost":
        hold.lost(ME)
    while not jog.ended.is_set() and how != "silent":
        late_s = 9.0 if how == "late" else 0.0  # it was held nine seconds ago
        hold.alive(ME, replace(begun, made_s=operator.presses.clock() - late_s))
        time.sleep(0.01)
    wait(jog.ended.is_set)
    assert how not in ("silent", "late") or time.monotonic() - begin_s > HELD_S / 4
    wait(lambda: not operator.busy)
    assert any(words.BROWSER_SILENT in line for line in operator.log.last) == (how in ("silent", "late"))


def test_a_release_that_overtakes_its_press_ends_it(operator: PanelBoard) -> None:
    hold, jog = ButtonHold(operator), operator.board.jog  # type: ignore[attr-defined]
    late = press(operator)
    hold.release(ME, late.number)
    with pytest.raises(InputError, match="it was released"):
        hold.press(ME, late, "jog", lambda: jog)
    assert not operator.busy
    assert not jog.held


def test_a_refused_press_of_a_watcher_ends_nobodys_jog(operator: PanelBoard) -> None:
    hold, jog = ButtonHold(operator), operator.board.jog  # type: ignore[attr-defined]
    begun = press(operator)
    hold.press(ME, begun, "jog", lambda: jog)
    wait(lambda: hold.alive(ME, replace(begun, made_s=operator.presses.clock())) or jog.held > 2)
    with pytest.raises(InputError):
        hold.press(OTHER, press(operator), "jog", lambda: jog)
    assert hold.held_by(ME)
    hold.release(ME, begun.number)
    wait(jog.ended.is_set)


def test_the_picture_has_the_radii_and_the_room_of_the_arm_file() -> None:
    room = ArmRoom(
        (KeepOut("tray", (100.0, -50.0, 0.0), (200.0, 50.0, 30.0)),), low_mm=(-FAR_MM, -FAR_MM, -20.0)
    )
    thick = tuple(
        replace(joint, radius_mm=40.0 if number == 2 else 0.0) for number, joint in enumerate(ARM.joints)
    )
    shape = ArmShape(replace(ARM, joints=thick, room=room))
    radii = {index // 2: radius * shape.reach_mm for index, _, radius in shape.pieces}
    assert radii[2] == pytest.approx(40.0)
    assert all(radius > 5.0 for radius in radii.values())  # what the file does not say is drawn all the same
    tray, (floor_low, floor_high) = shape.room
    assert np.array(tray) * shape.reach_mm == pytest.approx(np.array([[100, -50, 0], [200, 50, 30]]))
    assert floor_low[2] == floor_high[2] == pytest.approx(-20.0 / shape.reach_mm)
    assert all(floor_high[:2] - floor_low[:2] > 1.0)


def test_meshes_next_to_the_arm_file_are_shown_in_the_frames_of_their_rows(tmp_path: Path) -> None:
    file = tmp_path / "arm.toml"
    file.write_text(shipped.arm_path().read_text())
    arm, corners = Arm.read(file), np.eye(3)[None]
    assert not ArmShape(arm).meshes
    mesh_files.write(file, {0: corners, 3: corners})
    shape = ArmShape(arm)
    angles = np.array([90.0, -60.0, 40.0])
    base, third = shape.poses(angles)[len(shape.pieces) :]
    assert base == [0, 0, 0, 0, 0, 0, 1]
    wanted = all_frames(Geometry.of(arm), np.radians(all_angles_deg(arm, angles)).tolist())[3, :3, 3]
    assert np.array(third[:3]) * shape.reach_mm == pytest.approx(wanted, abs=0.1)
    assert abs(np.linalg.norm(third[3:]) - 1.0) < 1e-4


SEQUENCE = """# all day
name = "day"  # its name

[[step]]
repeat = 2  # twice

# the tray
[[step]]
goto = [10, -60, 40]

[[step]]
wait_s = 0.5  # it settles

[[step]]
end = "repeat"
"""


@pytest.fixture
def steps(tmp_path: Path) -> SequenceEditor:
    (tmp_path / "day.toml").write_text(SEQUENCE)
    (tmp_path / "job.toml").write_text('name = "feed"\nvia_deg = [[0, -60, 40], [20, -75, 50]]\n')
    (tmp_path / "damaged.toml").write_text("[[step")
    desk = SequenceEditor(ARM, tmp_path)
    assert desk.files() == ["day.toml"]
    desk.open("day.toml")
    return desk


def test_steps_are_edited_and_comments_stay(steps: SequenceEditor) -> None:
    steps.set(0, "repeat", "for ever")
    steps.set(1, "goto", "[12.5, -60, 40]")
    steps.move(2, -1)
    steps.move(0, -1)  # it is the first
    steps.add(1)
    steps.set_kind(1, "wait_s")
    steps.set(1, "wait_s", "0.25")
    file = steps.save()
    text = file.read_text()
    assert text.index("# it settles") < text.index("# the tray")  # each goes with its step
    assert steps.depths == [0, 1, 1, 1, 0]
    for comment in ("# all day", "# its name", "# twice", "# the tray", "# it settles"):
        assert comment in text
    steps.open("day.toml")
    assert steps.steps == [
        {"repeat": "for ever"},
        {"wait_s": "0.25"},
        {"wait_s": "0.5"},
        {"goto": "[12.5, -60, 40]"},
        {"end": "repeat"},
    ]
    steps.delete(0)
    steps.delete(3)
    assert len(steps.sequence().steps) == 3


def test_steps_that_are_no_sequence_are_not_saved(steps: SequenceEditor) -> None:
    steps.delete(3)
    with pytest.raises(InputError, match="repeat without an end"):
        steps.save()
    assert steps.file is not None
    assert steps.file.read_text() == SEQUENCE
    steps.undo()
    assert steps.text == SEQUENCE
    steps.copy(1)
    assert steps.steps[1] == steps.steps[2] == {"goto": "[10, -60, 40]"}
    steps.new("fresh")
    assert steps.save().name == "fresh.toml"
    assert steps.files() == ["day.toml", "fresh.toml"]
    with pytest.raises(InputError, match="no such sequence"):
        steps.open("../day.toml")


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
    made.close()


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


def test_a_fault_of_ours_does_not_end_the_states(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("armtempo.panel.panel_board.LOOK_S", 0.01)
    asked: list[int] = []
    board = Board()

    @contextmanager
    def fail(timeout_s: float) -> Iterator[bool]:
        asked.append(1)
        yield 1 // 0

    board.client.session.in_a_hurry = fail
    made = PanelBoard(lambda sink, tell: board, "sim", JobEditor(ARM, tmp_path, None), tmp_path)  # type: ignore[arg-type, return-value]
    wait(lambda: len(asked) > 3)
    made.close()
    assert "the board's state" in caplog.text


def board_state(**changed: Any) -> BoardState:
    """What a board at rest says, whose arm is at home."""
    joints = tuple(
        JointState(joint.name, True, 0, angle, 0, None)
        for joint, angle in zip(ARM.driven, ARM.home_deg, strict=True)
    )
    found = {field.name: "" for field in fields(BoardState)} | {
        "virtual": False, "moving": False, "speed_percent": 100.0, "state": "idle", "joints": joints, "sequence": None,
        "port": "port",
    }  # fmt: skip
    return BoardState(**{**found, **changed})


def unhomed() -> BoardState:
    """What a board says that does not know where its arm is."""
    joints = board_state().joints
    return board_state(joints=tuple(replace(joint, known=False, angle_deg=0.0) for joint in joints))


class Telling:
    """A board that says where its arm is."""

    def __init__(self, state: BoardState) -> None:
        self._state = state
        self.client = type("Client", (), {"levels": lambda _: Levels(0b1, (65535,))})()

    def state(self, arm: Arm) -> BoardState:
        return self._state


def test_an_arm_that_is_not_homed_is_drawn_as_unknown_at_home(operator: PanelBoard) -> None:
    operator.live.ask(Telling(unhomed()))  # type: ignore[arg-type]
    shape = ArmShape(ARM)
    told = layout.message(operator, shape)
    assert (told["links"], told["tool"], told["unknown"]) == (None, None, True)
    assert told["ghost"] == shape.poses(np.array(ARM.home_deg))
    assert told["texts"]["armtempo-where"] == "position unknown"
    assert told["texts"]["armtempo-angle-1"] == "?"
    operator.live.ask(Telling(board_state()))  # type: ignore[arg-type]
    told = layout.message(operator, shape)
    assert told["links"] == shape.poses(np.array(ARM.home_deg))
    assert told["texts"]["armtempo-angle-2"] == "-60.00°"


def test_a_state_that_is_old_says_how_old(operator: PanelBoard) -> None:
    operator.live.ask(Telling(board_state(state="moving", moving=True, speed_percent=20.0)))  # type: ignore[arg-type]
    assert layout.state_line(operator) == "moving at 20 % · port"
    operator.live.heard_s -= 3.0
    assert re.fullmatch(r"moving at 20 % · last heard 3\.\d s ago · port", layout.state_line(operator))


def test_outputs_and_inputs_are_those_of_the_board() -> None:
    text = (
        shipped.arm_path().read_text()
        + """
[output.gripper]
kind = "servo"
pin = "PB8"
pulse_us = [500, 2500]
angles_deg = [0, 180]
states = { open = 0.0, closed = 180.0 }
safe = "open"

[input.part]
pin = "PD0"
"""
    )
    live = LiveArm(Arm.of_table(toml_table.parse(text, "arm.toml")))
    live.ask(Telling(board_state(arm="paper")))  # type: ignore[arg-type]
    assert (live.outputs, live.inputs) == ({"gripper": "closed"}, {"part": True})


@pytest.mark.parametrize(
    ("what", "said", "cures", "is_fault"),
    [
        ("nothing", "", (), False),
        ("cable", "the cable is out", (), True),
        ("no program", "another program runs", (Cure.DEPLOY,), True),
        ("fault", "E-stop", (Cure.CLEAR,), True),
        ("frozen", "may have moved on", (Cure.HOME,), True),
        ("failed", "run: the arm is elsewhere", (Cure.DISMISS,), True),
        ("unhomed", "Home it", (Cure.HOME,), False),
    ],
)
def test_the_banner_says_what_is_wrong_and_has_the_button_that_helps(
    operator: PanelBoard, what: str, said: str, cures: tuple[Cure, ...], is_fault: bool
) -> None:
    live = operator.live
    live.state = board_state()
    if what == "cable":
        operator.trouble = "the cable is out"
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
    found = problem.of(operator)
    assert (found is None) == (what == "nothing")
    if found is not None:
        assert said in found.text
        assert (found.cures, found.is_fault) == (cures, is_fault)
        assert "'armtempo" not in found.text


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


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("remove its cause, then 'armtempo clear'", "remove its cause, then ‘Clear the fault’"),
        ("move it there with 'armtempo goto'", "move it there with ‘Go to the start’"),
        ("'armtempo list' shows the names", "‘Stored motions’ shows the names"),
        ("see 'armtempo help recovery'", "see 'armtempo help recovery' in a terminal"),
        ("nothing to do", "nothing to do"),
    ],
)
def test_commands_are_the_panels_buttons(text: str, wanted: str) -> None:
    assert words.of_text(text) == wanted


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("job.toml: refine = 'banana' is not allowed", "job.toml: ‘Segments’ = 'banana' is not allowed"),
        (
            "job.toml: via P1.blend_mm = 0 is not allowed",
            "job.toml: via P1.‘Corner cut by, mm’ = 0 is not allowed",
        ),
        ("no motion along this path is shorter", "no motion along this path is shorter"),
        ("the stop at P1 is 5 s", "the stop at P1 is 5 s"),
    ],
)
def test_keys_are_the_panels_fields(text: str, wanted: str) -> None:
    assert words.of_job(text) == wanted


def test_what_turns_the_direction_of_a_line_is_seen() -> None:
    assert words.plain("a\u202eb\x1b\u200bc 'ü' <b>") == "a□b□□c 'ü' <b>"


def test_texts_are_no_properties() -> None:
    """A string of properties is code: a name in it could leave its quotes. ``look`` and icons are the panel's own."""
    allowed = {"look", "len(self.holds)", "number + 1", "icon"}
    for path in Path(layout.__file__).parent.glob("*.py"):
        for call in ast.walk(ast.parse(path.read_text())):
            if not (isinstance(call, ast.Call) and getattr(call.func, "attr", "") == "props"):
                continue
            for part in ast.walk(call):
                if isinstance(part, ast.FormattedValue) and not isinstance(part.value, ast.IfExp):
                    assert ast.unparse(part.value) in allowed, f"{path.name}: {ast.unparse(part)}"


def test_runs_of_the_command_line_are_listed_the_newest_first(tmp_path: Path) -> None:
    for number, (name, state) in enumerate({"feed-001": "complete", "feed-002": "fault"}.items()):
        (tmp_path / name).mkdir()
        made = {"duration_s": 6.8, "fault": "" if state == "complete" else "estop", "state": state}
        meta = {"format": "armtempo run", "started": "2026-01-02T03:04:05+00:00", "repetitions": [made, made]}
        (tmp_path / name / "run.json").write_text(json.dumps(meta))
        os.utime(tmp_path / name / "run.json", (1000 + number, 1000 + number))
    for name, text in (("damaged", "{"), ("other", "[1]"), ("empty", "{}")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "run.json").write_text(text)
        os.utime(tmp_path / name / "run.json", (1, 1))
    rows = past_runs.listed(tmp_path)
    assert [(row.folder.name, row.duration, row.ending) for row in rows[:2]] == [
        ("feed-002", "13.6 s", "estop"),
        ("feed-001", "13.6 s", "complete"),
    ]
    assert {row.ending for row in rows[2:]} == {"cannot be read"}
    with pytest.raises(RunFolderError, match="cannot be read"):
        past_runs.report(tmp_path / "damaged")


def test_a_typed_pose_is_reached_by_the_nearest_posture() -> None:
    here = np.array([10.0, -60.0, 40.0])
    place = forward(ARM, (20.0, -70.0, 50.0))[:3, 3].tolist()
    found = teaching.nearest(ARM, place, (0.0, 0.0, 0.0), here)
    assert forward(ARM, found)[:3, 3] == pytest.approx(place, abs=0.1)
    with pytest.raises(PlanError):
        teaching.nearest(ARM, [9999.0, 0.0, 0.0], (0.0, 0.0, 0.0), here)


def test_what_the_switches_home_is_named_in_its_order() -> None:
    assert homing.switches(ARM) == []
    ar4 = Arm.of("ar4")
    groups = homing.switches(ar4)
    assert sorted(name for group in groups for name in group.split(", ")) == sorted(
        joint.name for joint in ar4.driven
    )
    assert groups[: len(ar4.homing)] == [", ".join(group) for group in ar4.homing]
