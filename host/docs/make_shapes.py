"""Writes ``shared/armtempo_shared/shapes.py``: ``python host/docs/make_shapes.py``.

Its shapes are laws of moves by hand over 1 deg in 1 s, with their times for braking and changes of speed.
"""

from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np
from armtempo.model.parts import Limits
from armtempo.planning import brake_time, move_law
from armtempo.splines import extremes
from armtempo.splines.trajectory import Trajectory
from armtempo_shared.limits import TICK_HZ
from armtempo_shared.motion import EVEN_RAMP, RAMP_SHAPE_BIT

MODULE = Path(__file__).parents[2] / "shared" / "armtempo_shared" / "shapes.py"
RAMPS = ((0.5, False), (0.5, True), (0.35, True), (0.2, True), (0.1, True))
"""Fraction of the time for each ramp of speed, and whether a third of the ramp has constant acceleration."""
HEAD = '''"""Shapes of moves from rest to rest: splines of distance and time, and their ramps; see ``rest_to_rest.py``.

Written by host/docs/make_shapes.py.
"""

POINT_BITS = 30
"""Fraction bits of control points, of a way from 0 to 1 and of a time from 0 to 1."""
FACTOR_BITS = 10
"""Fraction bits of the largest speed, acceleration and jerk."""
RAMP_BITS = 10
"""The length of a ramp counts in 2 ** -RAMP_BITS of the move's time."""
SHAPES = (
'''
DESCRIPTION = '''\
"""Little endian, each: 4 I, speed, acceleration and jerk of a move over 1 in time 1, at most, the latter two over
the fractions of the limits that moves by hand use, and e of a motion record; i, control points of the distance, then of
the time; H, entries of ramps to rest and of others as in a motion record."""
'''


def law(ramp: float, has_constant: bool) -> Trajectory:
    """The law as a motion over about 1 deg, of one joint."""
    speed = 1.0 / (1.0 - ramp)
    acceleration, jerk = (1.5, 4.5) if has_constant else (2.0, 4.0)
    limits = move_law.MoveLimits(speed, acceleration * speed / ramp, jerk * speed / ramp**2)
    found = move_law.law(1.0, limits)
    times = found.time_s / found.trajectory("", [found.distance]).duration_s
    return move_law.MoveLaw(found.distance, times).trajectory("shape", [found.distance])


def text(motion: Trajectory) -> str:
    """The shape as source."""
    (joint,) = motion.joints
    (most,) = extremes.of_joints(motion.joints)
    fractions = (1.0, move_law.ACCELERATION, move_law.JERK)
    limits = [value / part for value, part in zip(most.values, fractions, strict=True)]
    brakes = brake_time.of_motion(motion, [Limits(*limits)])
    unit = 1024 * 2**brakes.unit_bits / TICK_HZ
    shapes = np.append(brakes.shapes, EVEN_RAMP) << RAMP_SHAPE_BIT
    factors = [math.ceil(value * 1024) for value in limits]
    points = [
        round(value * 2**30)
        for row in (joint.angle_points_deg, joint.time_points_s)
        for value in row.tolist()
    ]
    ramps = np.concatenate(
        [
            np.ceil(brakes.to_rest * unit).astype(int) + shapes,
            np.ceil(brakes.others * unit).astype(int),
        ]
    ).tolist()
    data = struct.pack(f"<4I{len(points)}i{len(ramps)}H", *factors, brakes.edge_bits, *points, *ramps)
    lines = [
        '    b"' + "".join(f"\\x{byte:02x}" for byte in data[at : at + 25]) + '"'
        for at in range(0, len(data), 25)
    ]
    return "\n".join(lines) + ",\n"


def main() -> None:
    """Write the module."""
    MODULE.write_text(HEAD + "".join(text(law(*ramp)) for ramp in RAMPS) + ")\n" + DESCRIPTION)


if __name__ == "__main__":
    main()
