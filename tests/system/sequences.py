"""A sequence on a virtual board: short motions of the shipped arm with a gripper, and what its pins did."""

from __future__ import annotations

from collections.abc import Sequence as Several
from dataclasses import replace
from pathlib import Path

import armtempo
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.sequence import Sequence
from armtempo.model.sequence_plan import SequencePlan
from armtempo.simulator import InjectedFault, edgelog
from armtempo_shared.limits import TICK_HZ

from tests.system.pulses import PINS

FOLDER = shipped.arm_path().parent / "pick_and_place"
SHIPPED = Arm.load(FOLDER / "arm.toml")
ARM = replace(SHIPPED, safety=replace(SHIPPED.safety, estop_fitted=True))
GRIPPER, PART = "B8", "D0"
"""Pins of the arm's output and input."""
ESTOP = "E15"
SMALL = """
name = "{name}"
start = "home"
[posture.pick]
angles_deg = {pick}
[posture.place]
angles_deg = {place}
[[step]]
repeat = {times}
[[step]]
goto = "pick"
[[step]]
wait_input = "part"
timeout_s = 1
on_timeout = "{on_timeout}"
[[step]]
output = "gripper"
to = "closed"
wait_s = 0.02
[[step]]
goto = "place"
[[step]]
output = "gripper"
to = "open"
wait_s = 0.02
[[step]]
goto = "home"
[[step]]
count = "parts"
[[step]]
end = "repeat"
"""


def small(
    folder: Path,
    times: int | str,
    on_timeout: str = "stop",
    name: str = "small",
    arm: Arm = ARM,
    size: float = 1.0,
) -> SequencePlan:
    """A pick and place over fractions of a degree, or ``size`` times as far."""
    path = folder / f"{name}.toml"
    value = f'"{times}"' if isinstance(times, str) else times
    pick, place = (
        [round(home + size * by, 3) for home, by in zip(arm.home_deg, away, strict=True)]
        for away in ((0.6, -0.3, 0.5), (-0.5, 0.2, -0.4))
    )
    path.write_text(SMALL.format(name=name, times=value, on_timeout=on_timeout, pick=pick, place=place))
    return armtempo.plan_sequence(arm, Sequence.load(path, arm))


def part_lies_there() -> InjectedFault:
    """The part is seen from the first motion on."""
    return InjectedFault("input", 0.01, 1, name=PART, level=0)


def pauses_s(power: edgelog.PowerCycle, plan: SequencePlan) -> list[float]:
    """From the planned end of each cycle's last motion to time 0 of the next one's first, seconds."""
    legs = len(plan.legs)
    return [
        (power.starts[n] - power.starts[n - 1]) / TICK_HZ - plan.legs[-1].duration_s
        for n in range(legs, len(power.starts), legs)
    ]


def net_steps(power: edgelog.PowerCycle, arm: Arm = ARM) -> list[int]:
    """Where the pins have moved the joints since power-up, in steps."""
    found = []
    for (step, direction), joint in zip(PINS, arm.driven, strict=True):
        ticks, levels = power.pins.get(step, ((), ()))
        turns, after = power.pins.get(direction, ((), ()))
        found.append(_net(list(ticks), list(levels), list(turns), list(after)) * joint.motor.direction)
    return found


def _net(ticks: Several[int], levels: Several[int], turns: Several[int], after: Several[int]) -> int:
    position = at = 0
    level = 0 if not len(after) else 1 - int(after[0])
    for tick, risen in zip(ticks, levels, strict=True):
        while at < len(turns) and turns[at] <= tick:
            level = int(after[at])
            at += 1
        if risen:
            position += 1 if level else -1
    return position
