"""The owner of a board's port answers other programs, stops the board for them, and publishes samples.

Each request runs in its own thread; requests and this program's commands take turns (``Session.lock``), a stop first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from threading import Event as Flag
from threading import Thread
from typing import Any

from armtempo_shared.limits import TICK_HZ

from armtempo.basics.errors import ArmtempoError, NoAnswerError
from armtempo.link import Client
from armtempo.link.board_messages import Done, Event, Fault, Sample
from armtempo.link.traffic import Chunk
from armtempo.model.arm import Arm
from armtempo.ports import claim, names
from armtempo.ports.messages import TOPICS, Message
from armtempo.ports.server import Server
from armtempo.robot.board_state import BoardState
from armtempo.robot.running import LOCK_S, change_speed, fault_name, request_stop
from armtempo.robot.stop_request import StopRequest

EVERY_S = 0.5
"""Interval of the published states."""


class Sharing:
    """Makes a board's port known to other programs, until ``close``.

    ``state``: returns the board's state; ``stops``: the stop requests of this program's running calls;
    ``arm``: returns the arm, if known.
    """

    def __init__(
        self,
        client: Client,
        state: Callable[[], BoardState],
        stops: Sequence[StopRequest],
        arm: Callable[[], Arm | None],
    ) -> None:
        self._client = client
        self._state = state
        self._stops = stops
        self._arm = arm
        self._server: Server | None = None
        self._closed = Flag()

    def open(self, port: str) -> None:
        """Listen; raises OSError if that fails. A virtual board that only this program can reach is not shared."""
        name = names.same_for_all(port)
        if not name:
            return
        session = self._client.session
        device = session.transport.name if names.is_sim(port) else port
        handlers = {
            "status": self._status,
            "stop": self._stop,
            "speed": self._speed,
            "output": self._output,
            "inputs": self._inputs,
        }
        self._server = Server(claim.new(name, port, device), handlers)
        session.guard(self._server.check)
        session.listen(self._heard)
        Thread(target=self._hand_out_states, name="armtempo states", daemon=True).start()

    def close(self) -> None:
        self._closed.set()
        if self._server is not None:
            self._server.close()

    def traffic(self, chunk: Chunk, words: list[str]) -> None:
        """Publish the port's traffic."""
        if self._server is not None and self._server.wanted("traffic"):
            content = {"time_s": chunk.time_s, "direction": chunk.direction, "data": chunk.data.hex()}
            self._server.publish("traffic", {**content, "words": words})

    # requests

    def _status(self, request: Message) -> Message:
        return {"status": self._read().to_json()}

    def _stop(self, request: Message) -> Message:
        now = request.get("now", False)
        moving = request_stop(self._client, self._stops, now, request.get("by") or "another program")
        if self._server is not None:
            self._server.publish("event", {"event": "stop", "now": now})
        return {"moving": moving}

    def _speed(self, request: Message) -> Message:
        rate = request["rate"]
        with self._locked():
            change_speed(self._client, rate)
        if self._server is not None:
            self._server.publish("event", {"event": "speed", "rate": rate})
        return {}

    def _output(self, request: Message) -> Message:
        with self._locked():
            self._client.set_output(request["number"], request["value"])
        return {}

    def _inputs(self, request: Message) -> Message:
        with self._locked():
            found = self._client.levels()
        return {"inputs": found.inputs, "outputs": list(found.outputs)}

    def _read(self) -> BoardState:
        with self._locked():
            return self._state()

    @contextmanager
    def _locked(self) -> Iterator[None]:
        with self._client.session.by_turns(LOCK_S) as mine:
            if not mine:
                raise NoAnswerError(
                    "the program that has the port is waiting for the board's answer", "try again"
                )
            yield

    # published messages

    def _hand_out_states(self) -> None:
        while not self._closed.wait(EVERY_S):
            server = self._server
            if server is None or not any(map(server.wanted, TOPICS)):
                continue
            try:
                server.publish("status", {"status": self._read().to_json()})
            except ArmtempoError as error:
                server.publish("event", {"event": "trouble", "text": str(error)})

    def _heard(self, event: Event) -> None:
        if self._server is None:
            return
        if isinstance(event, Sample):
            if self._server.wanted("sample"):
                self._server.publish("sample", sample_json(event, self._arm()))
        elif self._server.wanted("event"):
            self._server.publish("event", _event_json(event))


def sample_json(sample: Sample, arm: Arm | None) -> dict[str, Any]:
    """A sample as plain values, also in degrees if the arm is known."""
    steps, counts = sample.positions.commanded_steps, sample.positions.counts
    found: dict[str, Any] = {
        "run": sample.run,
        "index": sample.index,
        "time_s": sample.ticks / TICK_HZ,
        "path_s": sample.path_ticks / TICK_HZ,
        "commanded_steps": list(steps),
        "counts": list(counts),
    }
    if arm is not None and len(arm.driven) == len(steps):
        gears = arm.transmission
        angles = gears.angles_of_counts(counts).tolist()
        found["joints"] = [joint.name for joint in arm.driven]
        if arm.slides:
            found["units"] = [joint.unit.name for joint in arm.driven]
        found[arm.texts.list_key("commanded_deg")] = gears.angles_of_steps(steps).tolist()
        found[arm.texts.list_key("angle_deg")] = [
            angle if seen else None for angle, seen in zip(angles, gears.measured, strict=True)
        ]
    return found


def _event_json(event: Event) -> dict[str, Any]:
    if isinstance(event, Done):
        return {"event": "done", "run": event.run, "time_s": event.ticks / TICK_HZ}
    if isinstance(event, Fault):
        time_s = event.ticks / TICK_HZ
        joint = event.joint + 1 if event.joint < 255 else None
        return {
            "event": "fault",
            "run": event.run,
            "time_s": time_s,
            "fault": fault_name(event.code),
            "joint": joint,
        }
    return {"event": "notice", "text": getattr(event, "text", "")}
