"""Every public call with wrong types and values: an error of armtempo's that says what to do, and no other."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, cast

import armtempo
import numpy as np
import pytest
from armtempo.encoding import encoded_plan
from armtempo.robot.motions import Motions
from armtempo.robot.outputs import BoardIO
from armtempo.robot.position import ArmPosition
from armtempo.robot.store import BoardStore

ARM = armtempo.Arm.paper()
JOB = armtempo.Job(
    "small", via_deg=[(0, -60, 40), (5, -58, 41)], population=4, iterations=1, refine=1, path="through"
)
NOWHERE = "/no/such/port"
WRONG = (
    *(object(), b"x", 1 + 2j, {1}, lambda *_: 0),
    *(None, True, 0, 3, -1, 10**30, 0.5, -2.5, math.nan, math.inf),
    *("", "x", "no such", "two\nlines", "\0", "\ud800", Path("/no/such/file.json"), "missing.json"),
    *([], [[]], [1.0, 2.0], [1, "x"], [[1, 2, 3], [4]], {}, {"x": object()}),
    *(np.zeros((2, 2)), np.array(["x"])),
)
GIVEN_BY_US = {"Board", "BoardState", "Plan", "Run", "SharedBoard", "Stopped"}
GIVEN_BY_US |= {"StopRequest", "Trajectory", "Watcher", "Result", "VirtualBoard"}
"""Classes that a user makes no objects of, or without arguments."""
USERS_OWN = {"minimise.function", "minimise.rng", "launch.options"}
"""What these raise or start is the user's affair."""
NO_CALLS = {"BoardState.of_json", "StopRequest.ask", "StopRequest.check"}
NO_CALLS |= {"Arm.of_table", "Job.of_table", "Plan.of_job", "Sequence.of_table", "Arm.read_posture"}
NO_CALLS |= {f"Watcher.{name}" for name in ("begin", "on_sample", "on_state", "end")}


class Gone:
    """Stands for a board or program that is no longer there."""

    def __getattr__(self, name: str) -> Any:
        if name in ("info", "rate"):
            raise armtempo.LinkError("gone", "start it")
        return self

    def __call__(self, *_: object, **__: object) -> Any:
        raise armtempo.LinkError("gone", "start it")


@pytest.fixture(scope="module")
def plan() -> armtempo.Plan:
    """A small one."""
    return armtempo.plan(ARM, JOB)


@pytest.fixture(scope="module")
def objects(plan: armtempo.Plan) -> dict[str, Any]:
    """One of each class that has methods."""
    board = armtempo.Board(cast(Any, Gone()), NOWHERE)
    board.arm = ARM
    sequence = armtempo.Sequence("s", (armtempo.Goto("home"), armtempo.Wait(1.0)))
    return {
        "Arm": ARM,
        "Job": JOB,
        "Board": board,
        "SharedBoard": armtempo.SharedBoard(cast(Any, Gone())),
        "Plan": plan,
        "Pose": armtempo.Pose.of_angles([300, 0, 300], {}),
        "Spline": armtempo.Spline.through([0, 1, 2]),
        "Trajectory": plan.trajectory,
        "Sequence": sequence,
        "Output": armtempo.Output("gripper", "switch", "PE9", 0.0),
    }


@cache
def good(plan: armtempo.Plan) -> dict[str, Any]:
    """A value that fits, by the name of a parameter."""
    alike = (
        ("x", "name old output input counter"),
        (1.0, "angle_deg wait_s to mass_kg speed_deg_s acceleration_deg_s2 jerk_deg_s3 at_s"),
        (0, "raw d_mm a_mm alpha_deg theta_offset_deg value number row"),
        (1, "channel joint via"),
        (None, "posture options start_deg"),
        ([0, -60, 40], "angles_deg where"),
        ([0, 1, 2], "points"),
        (0.5, "fraction u time_s"),
    )
    return {name: value for value, names in alike for name in names.split()} | {
        "arm": ARM,
        "ask": bool,
        "job": JOB,
        "plan": plan,
        "new": "y",
        "path": "/no/such/file",
        "program": "/no/such/file.py",
        "port": NOWHERE,
        "folders": [NOWHERE],
        "pose": np.eye(4),
        "poses": [np.eye(4)],
        "matrix": np.eye(4).tolist(),
        "position": [1, 2, 3],
        "direction": [0, 0, 1],
        "control_points": [0] * 8,
        "joints": (),
        "algorithm": "acs",
        "load": "nothing",
        "pallet": "tray",
        "tool": "nothing",
        "first": armtempo.Pose.of_matrix(np.eye(4)),
        "target": "home",
        "steps_per_rev": 200,
        "microsteps": 16,
        "gear_ratio": 10.0,
        "counts_per_rev": 4000,
        "range_deg": (-10, 10),
        "kind": "switch",
        "pin": "PE9",
        "safe": 0.0,
        "bounds": [(0, 1)],
        "frame": "base",
        "function": lambda x: (x**2).sum(1),
        "rng": np.random.default_rng(1),
        "limits": armtempo.Limits(10, 10, 10),
        "motor": armtempo.Motor(1, 200, 16, 10),
        "sequence": armtempo.Sequence("s", (armtempo.Wait(1.0),)),
        "steps": (armtempo.Wait(1.0),),
        "motion": encoded_plan.of_plan(plan),  # once: to find its brake time takes a while
    }


def public() -> Iterator[tuple[str, str]]:
    """Class or module, and name, of every public call."""
    for name in armtempo.__all__:
        value = getattr(armtempo, name)
        if isinstance(value, ModuleType):
            yield from ((name, inner) for inner in value.__all__ if inner not in GIVEN_BY_US)
        elif inspect.isclass(value) and not issubclass(value, Exception):
            if name not in GIVEN_BY_US:
                yield "", name
            for inner, member in inspect.getmembers(value, inspect.isroutine):
                if (inner == "__call__" or inner[0] != "_") and f"{name}.{inner}" not in NO_CALLS:
                    assert member
                    yield name, inner
        elif inspect.isroutine(value):
            yield "", name


def called(where: str, name: str, objects: dict[str, Any]) -> Callable[..., Any] | None:
    """What to call; None for what is no call, or cannot be one without a recorded run."""
    owner = getattr(armtempo, where) if where else armtempo
    if inspect.isclass(owner) and not inspect.ismethod(getattr(owner, name)):
        owner = objects.get(where)
    found = getattr(owner, name, None)
    return found if inspect.isroutine(found) or inspect.isclass(found) else None


def refusal(call: Callable[..., Any], values: dict[str, Any], several: bool) -> armtempo.ArmtempoError | None:
    """The error that a call ends with; None without one."""
    try:
        made = call(*values.values()) if several else call(**values)
    except armtempo.ArmtempoError as error:
        return error
    if isinstance(made, armtempo.SharedBoard):  # of another program on this machine
        made.close()
    return None


@pytest.mark.slow
@pytest.mark.xdist_group("public calls")
def test_wrong_types_and_values_are_refused_in_words(
    objects: dict[str, Any], plan: armtempo.Plan, tmp_path: Path, monkeypatch: Any
) -> None:
    for where, name in public():
        monkeypatch.chdir(tmp_path)
        monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))  # no other program's board is found
        call = called(where, name, objects)
        if call is None:
            continue
        parameters = inspect.signature(call).parameters.values()
        needed = {
            one.name for one in parameters if one.default is one.empty and one.kind is not one.VAR_POSITIONAL
        }
        values = {key: value for key, value in good(plan).items() if key in needed}
        assert needed <= values.keys(), f"no value is known for {needed - values.keys()}"
        for parameter in parameters:
            if f"{name}.{parameter.name}" in USERS_OWN:
                continue
            for number, wrong in enumerate(WRONG):
                said = refusal(
                    call, {**values, parameter.name: wrong}, parameter.kind is parameter.VAR_POSITIONAL
                )
                shown = f"{name}({parameter.name}={wrong!r})"
                assert said is None or (said.problem and said.hint), f"{shown}: {said}"
                assert number or said or parameter.annotation in ("Any", "object"), f"{shown} is taken"


def test_the_board_has_every_method_of_its_roles() -> None:
    for role in (BoardStore, ArmPosition, BoardIO, Motions):
        for name, method in vars(role).items():
            if inspect.isfunction(method) and not name.startswith("_"):
                own = getattr(armtempo.Board, name)
                assert inspect.signature(own) == inspect.signature(method), name
                assert own.__doc__ == method.__doc__, name
    roles = {type(value) for value in vars(armtempo.Board(cast(Any, Gone()), NOWHERE)).values()}
    assert {BoardStore, ArmPosition, BoardIO, Motions} <= roles
