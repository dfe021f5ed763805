"""A film camera's turntable: one joint, half a turn and back, as smooth as the limits say.

Usage: python turntable.py [PORT]; without a port on a virtual board.
"""

import sys
from pathlib import Path

import armtempo

ARM = """
name = "turntable"

[[joint]]
name = "table"
d_mm = 100.0
a_mm = 150.0
alpha_deg = 0.0
range_deg = [-5.0, 365.0]
home_deg = 0.0
limits = { speed_deg_s = 20.0, acceleration_deg_s2 = 10.0, jerk_deg_s3 = 20.0 }
motor = { channel = 1, steps_per_rev = 200, microsteps = 32, gear_ratio = 12.0 }
"""

port = sys.argv[1] if len(sys.argv) > 1 else "sim"
Path("turntable.toml").write_text(ARM, encoding="utf-8")
arm = armtempo.Arm.load("turntable.toml")
plan = armtempo.plan(arm, armtempo.Job("half-turn", via_deg=[[0], [90], [180]], timing="shared"))
print("\n".join(armtempo.summary(plan)))
with armtempo.connect(port, arm) as board:
    board.home(arm)
    run = board.run(plan, repeat=2)  # back along the same path in between
for joint in run.results:
    print(f"{joint.name}: {joint.steps_sent} steps sent, {plan.total_s:.2f} s each way")
