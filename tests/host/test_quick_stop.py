"""``armtempo stop`` asks for the stop before it imports the command line."""

from __future__ import annotations

import json
import os
import random
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from armtempo.basics.errors import LinkError
from armtempo.basics.settings import ProjectSettings
from armtempo.ports import claim, claim_file, names, quick_stop
from armtempo.ports.caller import Ownership, ownership
from armtempo.ports.line_socket import LineSocket, request_line
from armtempo.ports.messages import Message
from armtempo.ports.server import Server

PORT = "/dev/q"
HEAVY = (
    *("click", "numpy", "serial", "dataclasses", "typing", "pathlib", "collections", "contextlib"),
    *("re", "json", "enum", "signal", "socket", "tempfile", "importlib", "armtempo.cli", "armtempo.robot"),
)


@pytest.fixture(autouse=True)
def alone(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """No claims of programs outside of the tests, no answers of other tests."""
    monkeypatch.setattr(quick_stop, "_answers", {})
    for name in ("TMPDIR", "XDG_CACHE_HOME"):
        monkeypatch.setenv(name, str(tmp_path_factory.mktemp("temporary")))


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


@pytest.mark.parametrize("folder", [".", "below/it"])
def test_the_port_may_come_from_the_project_folder(
    asked: list[Message], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: str
) -> None:
    (tmp_path / "armtempo.toml").write_text(f'port = "{PORT}"\n')
    (tmp_path / folder).mkdir(parents=True, exist_ok=True)
    monkeypatch.chdir(tmp_path / folder)
    quick_stop.send([])
    assert len(asked) == 1
    assert quick_stop.take_answer(PORT, False) is not None


def test_a_virtual_board_of_the_project_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "armtempo.toml").write_text('port = "sim:board"\n')
    (tmp_path / "below").mkdir()
    monkeypatch.chdir(tmp_path / "below")
    port = ProjectSettings().get("port").value
    server = Server(
        claim.new(names.same_for_all(port), port, "/dev/x"), {"stop": lambda _: {"moving": False}}
    )
    try:
        quick_stop.send(["--now"])
    finally:
        server.close()
    answer = quick_stop.take_answer(port, True)
    assert answer is not None
    assert not answer.moved


def test_a_program_that_has_died_is_none_to_choose(asked: list[Message]) -> None:
    died = subprocess.Popen([sys.executable, "-c", ""])
    died.wait()
    left = claim.new("/dev/r", "/dev/r", "/dev/r")._replace(pid=died.pid)
    left.write()
    try:
        quick_stop.send([])
    finally:
        left.remove()
    assert len(asked) == 1


def test_of_several_open_ports_none_is_chosen(asked: list[Message]) -> None:
    second = Server(claim.new("/dev/r", "/dev/r", "/dev/r"), {})
    try:
        quick_stop.send([])
    finally:
        second.close()
    assert not asked


def test_a_program_that_hangs_is_left_to_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    deaf = claim.new(PORT, PORT, PORT)
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(deaf.address)
        listening.listen(1)
        deaf.write()
        monkeypatch.setattr(quick_stop, "_HELLO_S", 0.05)
        quick_stop.send(["--port", PORT])
        assert quick_stop.take_answer(PORT, False) is None
        assert ownership(deaf) is Ownership.HUNG  # known by now: it is not waited for again
    deaf.remove()


def test_a_refusal_is_left_to_the_command() -> None:
    def stop(request: Message) -> Message:
        raise LinkError("no", "ask again")

    server = Server(claim.new(PORT, PORT, PORT), {"stop": stop})
    try:
        quick_stop.send(["--port", PORT])
    finally:
        server.close()
    assert quick_stop.take_answer(PORT, False) is None


@pytest.mark.skipif(not claim.LOCAL_SOCKETS, reason="those of Windows wait by themselves")
def test_a_stop_waits_for_a_program_that_many_ask() -> None:
    """Whose system refuses more callers for a moment."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listening, ExitStack() as callers:
        address = f"{os.environ['XDG_RUNTIME_DIR']}/full"
        listening.bind(address)
        listening.listen(0)
        full = False
        while not full:
            caller = callers.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM))
            caller.setblocking(False)
            full = caller.connect_ex(address) != 0
        threading.Timer(0.1, lambda: [listening.accept()[0].close() for _ in range(2)]).start()
        LineSocket(address, 60.0).close()


def test_a_request_is_the_json_that_any_reader_takes() -> None:
    numbers = random.Random(3)
    letters = 'aé"\\\n\x00\ud800😀'
    for _ in range(300):
        text = "".join(numbers.choices(letters, k=5))
        fields = {
            "by": text,
            "now": numbers.random() < 0.5,
            "rate": numbers.randrange(-(2**70), 2**70),
            "topics": [text],
        }
        line = request_line(7, "stop", fields)
        assert line.endswith(b"}\n")
        assert json.loads(line) == {"id": 7, "request": "stop", **fields}


@pytest.mark.parametrize("port", ["/dev/ü", "C:\\x\ny", "rfc2217://host:1", ""])
def test_a_claim_comes_back_from_its_file_as_it_was(port: str) -> None:
    made = claim.new(port, port, "/dev/x")
    made.write()
    try:
        assert claim.find(port, port) == made
    finally:
        made.remove()


def test_the_folder_for_temporary_files_is_the_one_of_tempfile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for value in (str(tmp_path), "/nowhere", ""):
        for name in ("TMPDIR", "TEMP", "TMP"):
            monkeypatch.setenv(name, value)
        code = "import tempfile; print(tempfile.gettempdir())"
        wanted = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout
        assert wanted.strip() in map(os.path.dirname, claim_file.folders())


@pytest.mark.skipif(os.name != "posix", reason="modes are of POSIX")
@pytest.mark.parametrize("taken", ["open to others", "link", "file"])
def test_a_folder_that_another_user_made_first_does_not_keep_a_stop_out(
    taken: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As any user can in /tmp: then the claims are in a folder of the user's own."""
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    cache = tempfile.mkdtemp(prefix="own-")
    monkeypatch.setenv("XDG_CACHE_HOME", cache)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    usual = tmp_path / f"armtempo-{os.getuid()}"
    if taken == "link":
        (tmp_path / "elsewhere").mkdir(mode=0o700)
        usual.symlink_to(tmp_path / "elsewhere")
    elif taken == "file":
        usual.write_text("")
    else:
        usual.mkdir()
        usual.chmod(0o777)
    port = "/dev/taken"
    server = Server(claim.new(port, port, port), {"stop": lambda request: {"moving": True}})
    try:
        assert Path(server.claim.address).is_relative_to(cache)
        quick_stop.send(["--port", port])
        answer = quick_stop.take_answer(port, False)
        assert answer
        assert answer.moved
    finally:
        server.close()
        shutil.rmtree(cache)
    assert not list(tmp_path.glob("**/*.claim"))


@pytest.mark.parametrize(("missing", "fits"), [(0, True), (1, False)])
def test_a_socket_has_a_path_that_the_system_takes(
    missing: int, fits: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With its name; else its folder is another."""
    folder = f"{tmp_path}/armtempo"
    longest = len(f"{folder}/0123456789abcdef.socket") - missing
    monkeypatch.setattr(claim_file, "_LONGEST_SOCKET_PATH", longest)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert (folder in claim_file.folders()) == fits


def test_nothing_heavy_is_imported_for_it() -> None:
    code = (
        f"import sys; before = set(sys.modules); import armtempo.__main__, armtempo.ports.quick_stop as quick; "
        f"quick.send(['--port', 'x']); print([name for name in {HEAVY} if name in set(sys.modules) - before])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
