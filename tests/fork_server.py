"""Forks Python programs that have numpy, scipy, matplotlib and armtempo's own modules already: started by ``forked``.

Which modules a command imports, and that it starts as it should, is told by those that are started anew.
A request is a JSON object (``arguments`` of the interpreter, ``environment``, ``folder``) with four descriptors:
input, output, errors, and where the process's number and its exit code go, a line each.
"""

from __future__ import annotations

import atexit
import gc
import json
import os
import runpy
import signal
import socket
import sys
import threading
from collections.abc import Callable
from types import ModuleType
from typing import Any

LONGEST_REQUEST = 1 << 20


def import_packages() -> None:
    """What takes most of the time that a command needs to start; a quarter of a second of it are armtempo's."""
    import armtempo.cli
    import armtempo.pipeline  # noqa: F401
    import click  # noqa: F401
    import matplotlib.backends.backend_agg
    import matplotlib.backends.backend_svg
    import matplotlib.figure  # noqa: F401
    import scipy.interpolate
    import scipy.linalg
    import scipy.optimize  # noqa: F401
    import serial.tools.list_ports  # noqa: F401


def answer(requests: socket.socket) -> Callable[[], object] | None:
    """Fork until the tests end (then None); in each fork what it is to run."""
    while True:
        data, descriptors, *_ = socket.recv_fds(requests, LONGEST_REQUEST, 4)
        if not data:
            return None
        if os.fork() == 0:
            requests.close()
            return _supervised(json.loads(data), descriptors)
        for descriptor in descriptors:
            os.close(descriptor)
        while _reap(os.WNOHANG):
            pass


def _reap(options: int) -> bool:
    """Whether a process that has ended was waited for, so that its processor time is counted."""
    try:
        return os.waitpid(-1, options)[0] > 0
    except ChildProcessError:
        return False


def _supervised(request: dict[str, Any], descriptors: list[int]) -> Callable[[], object]:
    """In the process that is to run it; its parent tells how it ends, and ends too."""
    *streams, told = descriptors
    child = os.fork()
    if child:
        for stream in streams:
            os.close(stream)
        os.write(told, b"%d\n" % child)
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        os.write(told, b"%d\n" % os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
        os._exit(0)
    os.close(told)
    if request["new_session"]:
        os.setsid()
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    os.environ.clear()
    os.environ.update(request["environment"])
    os.chdir(request["folder"])
    _open_streams()
    return _program(request["arguments"])


def _open_streams() -> None:
    """As the interpreter does where they are no terminal."""
    at_once = bool(os.environ.get("PYTHONUNBUFFERED"))
    sys.stdin = sys.__stdin__ = open(0, closefd=False)  # noqa: SIM115
    sys.stdout = sys.__stdout__ = open(1, "w", closefd=False)  # noqa: SIM115
    sys.stdout.reconfigure(write_through=at_once)
    sys.stderr = sys.__stderr__ = open(2, "w", 1, errors="backslashreplace", closefd=False)  # noqa: SIM115
    if backend := os.environ.get("MPLBACKEND"):
        import matplotlib

        matplotlib.rcParams["backend"] = backend


def _program(arguments: list[str]) -> Callable[[], object]:
    """What ``python`` with these arguments runs: ``-c CODE``, ``-m MODULE`` or a file, as module ``__main__``."""
    kind, *rest = arguments
    if kind == "-m":
        sys.argv = ["-m", *rest[1:]]
        sys.path[0] = os.getcwd()
        return lambda: runpy.run_module(rest[0], run_name="__main__", alter_sys=True)
    main = sys.modules["__main__"] = ModuleType("__main__")
    if kind == "-c":
        sys.argv = ["-c", *rest[1:]]
        sys.path[0] = ""
        return lambda: exec(rest[0], main.__dict__)
    sys.argv = arguments
    sys.path[0] = os.path.dirname(os.path.abspath(kind))
    main.__file__ = kind
    with open(kind, encoding="utf-8") as file:
        code = compile(file.read(), kind, "exec")
    return lambda: exec(code, main.__dict__)


def end_as(program: Callable[[], object]) -> None:
    """Run a program and end as the interpreter does, but leave what is in memory to the system."""
    try:
        program()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
        if code and not isinstance(end.code, int):
            print(end.code, file=sys.stderr)
    except Exception:
        sys.excepthook(*sys.exc_info())
        code = 1
    threading._shutdown()
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    import_packages()
    gc.freeze()  # or each fork would go through all of it, and copy it
    run = answer(socket.socket(fileno=int(sys.argv[1])))
    if run:
        end_as(run)
    while _reap(0):
        pass
