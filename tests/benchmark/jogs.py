"""How close moves by hand come to ruckig's optimum for the same limits: ``python -m tests.benchmark.jogs``.

For every shipped arm, joint and percent of the speed: the way of a held jog after 0.1 to 2 s over that of ruckig's
velocity interface; the duration of steps of 0.1 to 100 degrees over ruckig's; and the time to rest after a release at
these times over the shortest, of the same limits too. It needs ruckig. ``--table``: the ways in the tests instead;
``--lines``: instead, jogs of AR4's tool at full speed over the fastest motion that the planner finds on the same line,
within the same limits (half a minute). ``--first``: instead, when the first step of a jog comes.
"""

from __future__ import annotations

import argparse
import math
import time
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from armtempo.basics.errors import InputError
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.planning import brake_time, move_law, planner
from armtempo.planning.jog import jog_motion
from armtempo.planning.jog.jog_motion import JogMove
from armtempo.planning.move_law import MoveLimits
from armtempo.splines.trajectory import JointSpline, Trajectory

if TYPE_CHECKING:
    import ruckig

TIMES_S = (0.1, 0.2, 0.5, 1.0, 2.0)
PERCENTS = (1, 2, 5, 10, 25, 50, 75, 100)
STEPS_DEG = (0.1, 1.0, 10.0, 100.0)
LONG_DEG = 400.0
ELBOW_DEG = (20.0, 10.0, -20.0, 15.0, 40.0, 30.0)
LINES_MM = (1.0, 10.0, -50.0)


def main() -> None:
    """Print the ratios, or the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--lines", action="store_true")
    parser.add_argument("--first", action="store_true")
    options = parser.parse_args()
    if options.first:
        for name in shipped.files():
            first_steps(name, Arm.load(name))
        return
    if options.lines:
        lines(Arm.load("ar4"))
        return
    table = options.table
    for name in shipped.files():
        arm = Arm.load(name)
        if table:
            tabulate(name, arm)
        else:
            compare(name, arm)


def tabulate(name: str, arm: Arm) -> None:
    """Print the rows of one arm."""
    speeds, accelerations, jerks = np.array([joint.limits.values for joint in arm.driven]).T
    joint = int(np.argmax(speeds * jerks / accelerations**2))
    print(f'    "{name}": ({joint}, {{')
    for percent in (1, 5, 25, 100):
        ways = held_deg(limits_of(arm, joint, percent / 100))
        print(f"        {percent}: ({', '.join(f'{way:.5g}' for way in ways)}),")
    print("    }),")


def compare(name: str, arm: Arm) -> None:
    """Print the worst ratios of one arm."""
    ways, steps, rests = [], [], []
    for joint, driven in enumerate(arm.driven):
        for percent in PERCENTS:
            limits = limits_of(arm, joint, percent / 100)
            law = move_law.law(LONG_DEG, move_law.of_joints([driven.limits], [1.0], percent / 100))
            spline = JointSpline(move_law.DEGREE, 1, law.distance, law.time_s)
            ways.append(spline(np.array(TIMES_S)) / held_deg(limits))
            brakes = brake_time.of_motion(Trajectory(name, (spline,), True), [driven.limits])
            for time_s in TIMES_S:
                shortest_s = rest_s(limits, float(spline(time_s, 1)), float(spline(time_s, 2)))
                rests.append(float(brakes.rest_s(time_s)) / shortest_s)
            for step in STEPS_DEG:
                found = move_law.law(step, move_law.of_joints([driven.limits], [1.0], percent / 100))
                last_s = JointSpline(move_law.DEGREE, 1, found.distance, found.time_s).duration_s
                steps.append(last_s / max(step_s(limits, step), move_law.SHORTEST_S))
    low, rest = np.min(ways, axis=0), np.array(rests)
    print(f"{name}: way over ruckig's at least {', '.join(f'{ratio:.3f}' for ratio in low)};", end=" ")
    print(f"steps at most {max(steps):.3f};", end=" ")
    print(
        f"rest: median {np.median(rest):.2f}, nine in ten {np.quantile(rest, 0.9):.2f}, most {rest.max():.2f}"
    )


def first_step_s(arm: Arm, trajectory: Trajectory) -> float:
    """When the first motor makes a step, from the motion's time 0."""
    times = np.linspace(0.0, min(trajectory.duration_s, 1.0), 10_001)
    moved = np.rint(arm.transmission.steps(trajectory(times))) != np.rint(
        arm.transmission.steps(trajectory(0.0))
    )
    return float(times[np.argmax(moved.any(axis=1))])


def first_steps(name: str, arm: Arm) -> None:
    """Print when jogs of an arm make their first step: of joints from home, of AR4's tool."""
    found = []
    moves = [JogMove(sign * math.inf, joint=joint) for joint in range(len(arm.driven)) for sign in (1, -1)]
    here = arm.transmission.angles_of_steps(arm.transmission.whole_steps(arm.home_deg))
    if name == "ar4":
        here = arm.transmission.angles_of_steps(arm.transmission.whole_steps(ELBOW_DEG))
        moves += [JogMove(sign * math.inf, axis=axis) for axis in ("x", "y", "tool-z") for sign in (1, -1)]
    for move in moves:
        for speed in (0.25, 1.0):
            with suppress(InputError):  # at the end of its range
                motion = jog_motion.plan("jog", arm, here.tolist(), move, speed)
                found.append(1000 * first_step_s(arm, motion.trajectory))
    print(f"{name}: {min(found):.0f} to {max(found):.0f} ms, of {len(found)}", flush=True)


def lines(arm: Arm) -> None:
    """Print the ratio of each line, and the processor time of both plans."""
    joints = [
        replace(
            joint,
            limits=replace(
                joint.limits,
                acceleration_deg_s2=move_law.ACCELERATION * joint.limits.acceleration_deg_s2,
                jerk_deg_s3=move_law.JERK * joint.limits.jerk_deg_s3,
            ),
        )
        for joint in arm.joints
    ]
    limited = replace(arm, joints=tuple(joints))
    steps = np.array([joint.steps_per_deg for joint in arm.driven])
    here_deg = (np.rint(ELBOW_DEG * steps) / steps).tolist()
    for axis in ("x", "y", "tool-z"):
        for by in LINES_MM:
            begin_s = time.process_time()
            jog = jog_motion.plan("jog", arm, here_deg, JogMove(by, axis=axis), 1.0)
            middle_s = time.process_time()
            fastest = planner.straight_line(limited, here_deg, jog.end_deg.tolist())
            duration_s = jog.trajectory.duration_s
            print(
                f"{axis} {by:g} mm: {duration_s:.3f} s, {duration_s / fastest.duration_s:.3f} of the "
                f"fastest; planned in {middle_s - begin_s:.2f} and {time.process_time() - middle_s:.2f} s",
                flush=True,
            )


def limits_of(arm: Arm, joint: int, speed: float) -> MoveLimits:
    """The limits of a jog, without what its record asks for."""
    most = arm.driven[joint].limits
    return MoveLimits(
        speed * most.speed_deg_s,
        move_law.ACCELERATION * most.acceleration_deg_s2,
        move_law.JERK * most.jerk_deg_s3,
    )


def _input(limits: MoveLimits) -> ruckig.InputParameter:
    import ruckig

    given = ruckig.InputParameter(1)
    given.max_velocity, given.max_acceleration, given.max_jerk = (
        [limits.speed],
        [limits.acceleration],
        [limits.jerk],
    )
    return given


def _solved(given: ruckig.InputParameter) -> ruckig.Trajectory:
    import ruckig

    found = ruckig.Trajectory(1)
    ruckig.Ruckig(1).calculate(given, found)
    return found


def held_deg(limits: MoveLimits) -> np.ndarray:
    """Ruckig's way after TIMES_S from rest to the speed."""
    import ruckig

    given = _input(limits)
    given.control_interface = ruckig.ControlInterface.Velocity
    given.target_velocity = [limits.speed]
    found = _solved(given)
    return np.array([found.at_time(time_s)[0][0] for time_s in TIMES_S])


def rest_s(limits: MoveLimits, speed: float, acceleration: float) -> float:
    """Ruckig's shortest time to rest."""
    import ruckig

    given = _input(limits)
    given.control_interface = ruckig.ControlInterface.Velocity
    given.current_velocity, given.current_acceleration = [speed], [acceleration]
    return float(_solved(given).duration)


def step_s(limits: MoveLimits, step: float) -> float:
    """Ruckig's time for a step."""
    given = _input(limits)
    given.target_position = [step]
    return float(_solved(given).duration)


if __name__ == "__main__":
    main()
