"""The panel without a browser: who may ask, one command at a time, one client in control, the job's file."""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.basics.errors import InputError, LinkError, PortInUseError
from armtempo.kinematics import Geometry, all_frames
from armtempo.kinematics.chain import all_angles_deg
from armtempo.link.board_messages import Positions, Sample
from armtempo.model import mesh_files, shipped
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.room import FAR_MM, ArmRoom, KeepOut
from armtempo.panel.access import COOKIE, MOST_BYTES, Access
from armtempo.panel.arm_scene import ArmShape
from armtempo.panel.desk import Desk
from armtempo.panel.held_jog import ALIVE_S, ButtonHold
from armtempo.panel.live import LiveArm
from armtempo.panel.operator import Needs, Operator
from armtempo.panel.sequence_desk import SequenceDesk
from armtempo.planning.jog.jog_motion import JogMove

ARM = Arm.paper()
ME, OTHER = "me", "other"


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


@pytest.mark.parametrize(
    ("query", "headers", "allowed"),
    [
        ("", {"host": "127.0.0.1:8088"}, True),
        ("", {"host": "127.0.0.1:8088", "origin": "http://127.0.0.1:8088"}, True),
        ("", {"host": "127.0.0.1:8088", "origin": "http://evil.example"}, False),
        ("", {"host": "evil.example:8088"}, False),
        ("", {}, False),
        ("", {"host": "127.0.0.1", "content_length": str(MOST_BYTES + 1)}, False),
        ("", {"host": "127.0.0.1", "content_length": "many"}, False),
    ],
)
def test_who_may_ask_on_the_loopback_address(
    query: str, headers: dict[str, str], allowed: bool, caplog: pytest.LogCaptureFixture
) -> None:
    access = Access(_inner, {"127.0.0.1"}, "")
    assert (answer(access, query=query, **headers)[0].get("status") == 200) == allowed
    if not allowed:
        assert "refused '/' from 1.2.3.4" in caplog.text
        assert answer(access, "websocket", query, **headers)[0]["type"] == "websocket.close"


def test_a_body_in_chunks_is_whole_or_refused() -> None:
    access = Access(_inner, {"127.0.0.1"}, "")
    assert answer(access, body=(b"a", b"", b"b"), host="127.0.0.1")[-1]["body"] == b"ab"
    large = answer(access, body=(b"x" * MOST_BYTES, b"x", b"not read"), host="127.0.0.1")
    assert large[0]["status"] == 413


@pytest.mark.parametrize(
    ("query", "cookie", "allowed"),
    [
        ("token=secret", "", True),
        ("", f"{COOKIE}=secret", True),
        ("", "", False),
        ("token=Secret", "", False),
        ("token=", f"{COOKIE}=", False),
        ("", "a=b; =; \x7f", False),
        ("token=%C3%A9", "", False),
    ],
)
def test_other_machines_need_the_token(query: str, cookie: str, allowed: bool) -> None:
    sent = answer(Access(_inner, {"arm.local"}, "secret"), query=query, host="arm.local:8088", cookie=cookie)
    assert (sent[0].get("status") == 200) == allowed
    kept = any(b"HttpOnly" in value for name, value in sent[0]["headers"] if name == b"set-cookie")
    assert kept == (query == "token=secret")


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

    def configure(self, arm: Arm) -> None:
        """It has this arm."""

    def close(self) -> None:
        """Nothing is open."""

    def held_jog(self, *_: object) -> Jog:
        return self.jog

    def request_stop(self, now: bool, by: str) -> bool:
        self.stops.append((now, by))
        return True


@pytest.fixture
def operator(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Operator]:
    monkeypatch.setattr("armtempo.panel.operator.LOOK_S", 1000.0)  # it is never asked for its state
    board = Board()
    made = Operator(lambda sink, tell: board, "sim", Desk(ARM, tmp_path, None), tmp_path / "runs")  # type: ignore[arg-type, return-value]
    made.take_control(ME)
    yield made
    made.close()


def wait(condition: Callable[[], bool]) -> None:
    """Until it holds."""
    limit_s = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < limit_s
        time.sleep(0.005)


def test_one_command_at_a_time_of_who_has_control(operator: Operator) -> None:
    go = threading.Event()
    operator.do("wait", ME, go.wait)
    with pytest.raises(InputError, match="wait is under way"):
        operator.do("more", ME, go.wait)
    with pytest.raises(InputError, match="Another page has control"):
        operator.do("more", OTHER, go.wait)
    go.set()
    wait(lambda: not operator.busy)
    operator.release(ME)
    with pytest.raises(InputError, match="Take control"):
        operator.do("more", ME, go.wait)


def test_an_error_of_a_command_is_logged_and_ends_nothing(operator: Operator) -> None:
    def fail() -> None:
        raise LinkError("the arm is elsewhere", "bring it there")

    operator.do("run", ME, fail)
    wait(lambda: not operator.busy)
    assert "bring it there" in operator.log.last[-1]
    operator.do("again", ME, lambda: None)


def test_stop_twice_freezes(operator: Operator) -> None:
    operator.stop()
    operator.stop()
    assert [now for now, _ in operator.board.stops] == [False, True]  # type: ignore[attr-defined, comparison-overlap]


@pytest.mark.parametrize("how", ["released", "silent", "other in control"])
def test_a_jog_ends_with_its_button(operator: Operator, how: str) -> None:
    hold, jog = ButtonHold(operator), operator.board.jog  # type: ignore[attr-defined]
    hold.press(ME, JogMove(math.inf, joint=0), 0.25)
    wait(lambda: jog.held > 2)
    begin_s = time.monotonic()
    if how == "released":
        hold.release(ME)
    elif how == "other in control":
        operator.take_control(OTHER)
    while not jog.ended.is_set() and how != "silent":
        hold.alive(ME)
        time.sleep(0.01)
    wait(jog.ended.is_set)
    assert how != "silent" or time.monotonic() - begin_s > ALIVE_S / 2


def test_saving_keeps_the_comments_of_the_job_file(tmp_path: Path) -> None:
    file = tmp_path / "job.toml"
    file.write_text(
        '# my job\nname = "feed"  # its name\nseed = 7\nvia_deg = [[0, -60, 40], [20, -75, 50]]\n'
    )
    desk = Desk(ARM, tmp_path, file)
    rows = [[0.0, -60.0, 40.0], [10.5, -70.0, 45.0], [20.0, -75.0, 50.0]]
    desk.save(rows, {"path": "free", "timing": "shared", "corridor_mm": "5"})
    text = file.read_text()
    assert "# my job" in text
    assert "# its name" in text
    again = Job.load(file, ARM)
    assert [list(row) for row in again.via] == rows  # type: ignore[arg-type]
    assert (again.path, again.seed, again.name, again.corridor_mm) == ("free", 7, "feed", 5.0)
    assert "timing" not in text  # it is the default


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


def test_nothing_is_written_outside_of_the_folder(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    file = tmp_path / "job.toml"
    file.write_text(text := 'name = "feed"\nvia_deg = [[0, -60, 40], [20, -75, 50]]\n')
    desk = Desk(ARM, tmp_path / "other", file)
    with pytest.raises(InputError, match="outside of the project folder"):
        desk.save(desk.rows(), {})
    assert file.read_text() == text


@pytest.mark.parametrize("rows", [[], [[0.0, -60.0, 40.0]], [[0.0, -60.0, 40.0], [999.0, 0.0, 0.0]]])
def test_rows_that_are_no_motion_are_refused(tmp_path: Path, rows: list[list[float]]) -> None:
    with pytest.raises(InputError):
        Desk(ARM, tmp_path, None).job_with(rows, {})


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
def steps(tmp_path: Path) -> SequenceDesk:
    (tmp_path / "day.toml").write_text(SEQUENCE)
    (tmp_path / "job.toml").write_text('name = "feed"\nvia_deg = [[0, -60, 40], [20, -75, 50]]\n')
    (tmp_path / "damaged.toml").write_text("[[step")
    desk = SequenceDesk(ARM, tmp_path)
    assert desk.files() == ["day.toml"]
    desk.open("day.toml")
    return desk


def test_steps_are_edited_and_comments_stay(steps: SequenceDesk) -> None:
    steps.set(0, "repeat", "for ever")
    steps.set(1, "goto", "[12.5, -60, 40]")
    steps.move(2, -1)
    steps.move(0, -1)  # it is the first
    steps.add(1)
    steps.set_kind(1, "wait_s")
    steps.set(1, "wait_s", "0.25")
    file = steps.save()
    text = file.read_text()
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


def test_steps_that_are_no_sequence_are_not_saved(steps: SequenceDesk) -> None:
    steps.delete(3)
    with pytest.raises(InputError, match="repeat without an end"):
        steps.save()
    assert steps.file is not None
    assert steps.file.read_text() == SEQUENCE
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

    made = Operator(connect, "port", Desk(ARM, tmp_path, None), tmp_path)  # type: ignore[arg-type]
    made.take_control(ME)
    assert "another program" in made.why_not(ME)
    assert "another program" in made.why_not(ME, Needs.BOARD)
    with pytest.raises(LinkError, match="another program"):
        made.board.list()
    deployed: list[int] = []
    for trouble in ("in use by another", ""):
        made.do("deploy", ME, lambda: made.without_board(lambda: deployed.append(1)), Needs.IDLE)
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
    monkeypatch.setattr("armtempo.panel.operator.LOOK_S", 0.01)
    asked: list[int] = []
    board = Board()

    @contextmanager
    def fail(timeout_s: float) -> Iterator[bool]:
        asked.append(1)
        yield 1 // 0

    board.client.session.in_a_hurry = fail
    made = Operator(lambda sink, tell: board, "sim", Desk(ARM, tmp_path, None), tmp_path)  # type: ignore[arg-type, return-value]
    wait(lambda: len(asked) > 3)
    made.close()
    assert "the board's state" in caplog.text
