"""A SCARA draws a star: the tool's positions are via points, and the joints follow.

Writes pen.png, the star as planned and as drawn. Usage: python pen.py [PORT]; without a port on a virtual board.
Needs the extra 'plot'.
"""

import math
import sys

import armtempo
import matplotlib
import numpy as np

matplotlib.use("Agg")
import itertools

from matplotlib import pyplot

CENTRE_MM, RADIUS_MM, POINTS = (230.0, 120.0), 50.0, 5

port = sys.argv[1] if len(sys.argv) > 1 else "sim"
arm = armtempo.Arm.load("scara")

# every second corner of a pentagon, and the middles of the sides between, so that they stay nearly straight
corners = [
    (
        CENTRE_MM[0] + RADIUS_MM * math.sin(4 * math.pi * corner / POINTS),
        CENTRE_MM[1] + RADIUS_MM * math.cos(4 * math.pi * corner / POINTS),
    )
    for corner in range(POINTS + 1)
]
star_mm = np.array(
    [
        (1 - share) * np.array(begin) + share * np.array(end)
        for begin, end in itertools.pairwise(corners)
        for share in (0.0, 0.25, 0.5, 0.75)
    ]
    + [corners[-1]]
)
via = tuple(armtempo.Pose.of_angles([x, y, 0.0], {}) for x, y in star_mm)  # only the position is asked for
plan = armtempo.plan(arm, armtempo.Job("star", via=via))
print("\n".join(armtempo.summary(plan)))

with armtempo.connect(port, arm) as board:
    board.home(arm)
    board.goto(plan)
    run = board.run(plan)

times_s = np.linspace(0.0, plan.total_s, 2000)
tool_mm = armtempo.forward(arm, plan.trajectory(times_s))[:, :2, 3]
sent_mm = armtempo.forward(arm, run.samples["commanded_deg"])[:, :2, 3]
figure, axes = pyplot.subplots(figsize=(5, 5))
axes.plot(*tool_mm.T, label="planned")
axes.plot(*sent_mm.T, ".", label="sent, every 0.1 s")
axes.plot(*star_mm.T, "k+", label="via points")
axes.set(xlabel="x, mm", ylabel="y, mm", aspect="equal")
axes.legend()
figure.savefig("pen.png", dpi=120)
print("wrote pen.png")
