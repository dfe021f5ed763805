"""Python programs as processes of their own that start quickly: forked from one with the large packages in it.

A quarter of a second to a whole one of processor time each, which starting the interpreter anew would take for imports.
What a test says of a start itself, of signals during imports or of packages that are missing, needs ``subprocess``.
"""

from __future__ import annotations

import atexit
import json
import os
import select
import socket
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

_SERVER = Path(__file__).with_name("fork_server.py")


@cache
def _server() -> socket.socket:
    """Requests to a server that lives as long as this process."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with theirs:
        command = [sys.executable, str(_SERVER), str(theirs.fileno())]
        process = subprocess.Popen(
            command, pass_fds=[theirs.fileno()], stdin=subprocess.DEVNULL, start_new_session=True
        )

    def end() -> None:
        ours.close()
        process.wait()

    atexit.register(end)
    return ours


class Process(subprocess.Popen[str]):
    """As ``subprocess.Popen`` of this interpreter's path and ``-c CODE``, ``-m MODULE`` or a file, and their arguments.

    Where another ``PYTHONPATH`` is asked for, and elsewhere than on Linux, the interpreter is started anew.
    """

    _told: socket.socket | None = None

    def _execute_child(self, args: Any, executable: Any, *options: Any) -> None:
        """See Popen: start, and close the child's ends of the pipes."""
        _, _, _, folder, environment, *_ = options
        pipes = options[8:14]
        environment = dict(os.environ if environment is None else environment)
        if sys.platform != "linux" or environment.get("PYTHONPATH") != os.environ.get("PYTHONPATH"):
            super()._execute_child(args, executable, *options)  # type: ignore[misc]
            return
        assert args[0] == sys.executable, args
        request = {
            "arguments": list(map(str, args[1:])),
            "environment": environment,
            "folder": str(folder or os.getcwd()),
            "new_session": bool(options[-2]),
        }
        self._told, told = socket.socketpair()
        with told:
            streams = [
                end if end >= 0 else number for number, end in enumerate((pipes[0], pipes[3], pipes[5]))
            ]
            data = json.dumps(request).encode()
            socket.send_fds(_server(), [data], [*streams, told.fileno()])
        self._answers = self._told.makefile()
        self.pid = int(self._answers.readline())
        self._child_created = True
        self._close_pipe_fds(*pipes)  # type: ignore[attr-defined]

    def _wait(self, timeout: float | None) -> int:
        """See Popen."""
        if self._told is None:
            return int(super()._wait(timeout))  # type: ignore[misc]
        if self.returncode is None:
            if not select.select([self._told], [], [], timeout)[0]:
                assert timeout is not None
                raise subprocess.TimeoutExpired(self.args, timeout)
            self.returncode = int(self._answers.readline())
            self._answers.close()
            self._told.close()
        return self.returncode

    def _internal_poll(self, *state: Any, **options: Any) -> int | None:
        """See Popen."""
        if self._told is None:
            return super()._internal_poll(*state, **options)  # type: ignore[misc,no-any-return]
        if self.returncode is None and select.select([self._told], [], [], 0)[0]:
            self._wait(None)
        return self.returncode


def run(*arguments: str | Path, timeout: float, **options: Any) -> subprocess.CompletedProcess[str]:
    """As ``subprocess.run`` of this interpreter with ``arguments``, its output and errors kept as text."""
    command = [sys.executable, *map(str, arguments)]
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, **options}
    with Process(command, **options) as process:
        try:
            output, errors = process.communicate(timeout=timeout)
        except BaseException:
            process.kill()
            raise
    return subprocess.CompletedProcess(command, process.returncode, output, errors)
