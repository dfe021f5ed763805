"""Planned trajectories and their replays, made once and shared by all whole-system tests."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from tests import interpreters, scripted
from tests.system import replays
from tests.system.replays import Replay

FASTEST = "micropython" if "micropython" in interpreters.AVAILABLE else "cpython"
"""For jobs other than the shipped one: each interpreter has shown there that it makes the same pulses."""
BY_JOB = {
    "shipped": [name for name in interpreters.AVAILABLE if name != scripted.EMULATED],
    "refined": [FASTEST],
    "cubic": [FASTEST],
}
"""The interpreters that replay a job; the emulator, which takes long, makes the same edges in tests/board."""
CASES = [(job, name) for job, names in BY_JOB.items() for name in names]
SAME = [
    pytest.param(
        job, names[0], other, id=f"{job}-{other}", marks=pytest.mark.xdist_group(f"replays of {job}")
    )
    for job, names in BY_JOB.items()
    for other in names[1:]
]
"""Pairs of interpreters that are to make the same of a job."""


def together(job: str) -> pytest.MarkDecorator:
    """Tests of a job's replays run on one worker, which makes each replay once."""
    return pytest.mark.xdist_group(f"replays of {job}")


@pytest.fixture(scope="session")
def plan_file(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Gives the trajectory file of a job of ``replays.JOBS``."""
    folder = tmp_path_factory.mktemp("plans")
    return cache(lambda job: replays.plan_file(job, folder))


@pytest.fixture(scope="session")
def replay_of(
    plan_file: Callable[[str], Path], tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str, str], Replay]:
    """Gives the replay of a job under an interpreter."""
    return cache(
        lambda job, name: replays.replay(plan_file(job), name, tmp_path_factory.mktemp(f"{job}-{name}"))
    )


@pytest.fixture(
    params=[
        pytest.param(
            case, id="-".join(case), marks=[together(case[0])] + [pytest.mark.long] * (case[0] == "cubic")
        )
        for case in CASES
    ]
)
def replay(request: pytest.FixtureRequest, replay_of: Callable[[str, str], Replay]) -> Replay:
    """Each job that is replayed, with its interpreter."""
    return replay_of(*request.param)
