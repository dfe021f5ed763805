"""``armtempo stop`` asks for the stop before it imports the command line."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

import pytest
from armtempo.project import quick_stop
from armtempo.share import claim
from armtempo.share.lines import Message
from armtempo.share.server import Server

PORT = "/dev/q"
HEAVY = ("click", "numpy", "serial", "dataclasses", "armtempo.cli", "armtempo.robot")


@pytest.fixture
def asked() -> Iterator[list[Message]]:
    """The stops that reach the program that has the port."""
    found: list[Message] = []

    def stop(request: Message) -> Message:
        found.append(request)
        return {"moving": True}

    server = Server(claim.new(PORT, PORT, PORT), {"stop": stop})
    yield found
    server.close()


@pytest.mark.parametrize(
    ("arguments", "now"),
    [
        (["--port", PORT], False),
        ([f"--port={PORT}", "--now"], True),
        (["--json", "--now", "--port", PORT], True),
        ([], False),
    ],
)
def test_a_stop_is_passed_on_and_its_answer_kept_once(
    asked: list[Message], arguments: list[str], now: bool
) -> None:
    quick_stop.send(arguments)
    assert [(one["now"], one["by"]) for one in asked] == [(now, "'armtempo stop'")]
    answer = quick_stop.take_answer(PORT, now)
    assert answer is not None
    assert answer.moved
    assert "process" in answer.program
    assert quick_stop.take_answer(PORT, now) is None


@pytest.mark.parametrize(
    "arguments",
    [["--help"], ["--port", PORT, "--log-traffic", "x"], ["--port", "/dev/other"], ["--prot", PORT]],
)
def test_what_is_not_plain_is_left_to_the_command(asked: list[Message], arguments: list[str]) -> None:
    quick_stop.send(arguments)
    assert not asked
    assert quick_stop.take_answer(PORT, False) is None


def test_the_port_may_come_from_the_environment(
    asked: list[Message], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ARMTEMPO_PORT", PORT)
    quick_stop.send([])
    assert len(asked) == 1


def test_nothing_heavy_is_imported_for_it() -> None:
    code = (
        f"import sys, armtempo.project.quick_stop; print([name for name in {HEAVY} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
