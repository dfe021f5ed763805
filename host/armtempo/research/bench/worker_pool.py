"""Where the runs of a comparison are computed: the cores of this machine, or a Dask cluster."""

from __future__ import annotations

import importlib.metadata
import multiprocessing
import os
import re
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from armtempo.basics.errors import ArmtempoError, InputError, MissingPackageError
from armtempo.basics.version import installed_version

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_CONNECT_S = 10


@contextmanager
def local(workers: int | None = None) -> Iterator[Executor]:
    """Processes on this machine, by default one for each core. Leaving by an exception ends them at once."""
    before = set(multiprocessing.active_children())
    context = multiprocessing.get_context("spawn")
    executor = ProcessPoolExecutor(workers, mp_context=context, initializer=_ignore_interrupt)
    try:
        with _one_thread_each():
            yield executor
    except BaseException:
        for process in set(multiprocessing.active_children()) - before:
            process.terminate()
        raise
    finally:
        executor.shutdown()


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """The workers of the Dask scheduler at ``address``.

    Raises MissingPackageError where the extra ``cluster`` is not installed, InputError where the address is none
    or no scheduler answers, ArmtempoError where a worker has no armtempo or another version.
    """
    if not re.fullmatch(r"\w+://.+:\d+", address):  # distributed would hang on it, and complain at the end
        raise InputError(f"--scheduler {address!r} is no address", "write it like tcp://127.0.0.1:8786")
    try:
        distributed: Any = import_module("distributed")
    except ImportError:
        raise MissingPackageError("--scheduler", "distributed", "cluster") from None
    try:
        client = distributed.Client(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"--scheduler {address}: no Dask scheduler answers there ({error})",
            "check the address, or start one with: dask scheduler",
        ) from None
    with client:
        _check_workers(address, client.run(importlib.metadata.version, "armtempo", on_error="return"))
        yield client.get_executor(pure=False)


def _check_workers(address: str, versions: dict[str, object]) -> None:
    """``versions``: of each worker its armtempo version, or the exception where it has none."""
    if not versions:
        raise InputError(
            f"--scheduler {address}: the cluster has no workers",
            f"start some with: dask worker {address}",
        )
    for worker, found in versions.items():
        if found != installed_version():
            what = "no armtempo" if isinstance(found, Exception) else f"armtempo {found}"
            raise ArmtempoError(
                f"worker {worker} has {what}, here is {installed_version()}",
                "install this version on all workers",
            )


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Processes started within compute linear algebra in one thread each, so that they do not compete for cores."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _ignore_interrupt() -> None:
    """Ctrl-C reaches every process of the terminal; the workers leave it to the main one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
