"""The arm as it goes through a motion: arm.gif, as long as the motion, ten pictures a second.

Usage: python animate.py [ARM TRAJECTORY]; without them the paper's feeding motion. Needs the extra 'plot'.
"""

import sys

import armtempo
import matplotlib
import numpy as np
from armtempo.kinematics import chain

matplotlib.use("Agg")
from matplotlib import animation, pyplot

RATE_HZ = 10

arm = armtempo.Arm.load(sys.argv[1]) if len(sys.argv) > 2 else armtempo.Arm.paper()
plan = armtempo.Plan.load(sys.argv[2]) if len(sys.argv) > 2 else armtempo.plan(arm, armtempo.Job.paper())
times_s = np.arange(0.0, plan.total_s + 1.0, 1.0 / RATE_HZ)  # and a second of rest
angles_deg = np.tile(arm.all_home_deg, (len(times_s), 1))
angles_deg[:, list(arm.driven_indices)] = plan.trajectory(np.minimum(times_s, plan.total_s))
tool_mm = armtempo.forward(arm, angles_deg)[:, :3, 3]
outline_mm = chain.outline_mm(arm, angles_deg)  # (times, corners of the links, 3)

figure = pyplot.figure(figsize=(4.2, 4.2))
axes = figure.add_subplot(projection="3d")
corners_mm = outline_mm.reshape(-1, 3)
low, high = corners_mm.min(axis=0) - 30.0, corners_mm.max(axis=0) + 30.0
axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
axes.set_box_aspect(high - low, zoom=1.2)
axes.set(xlabel="x", ylabel="y", zlabel="z", xticklabels=[], yticklabels=[], zticklabels=[])
(links,) = axes.plot([], [], [], "o-", linewidth=4, markersize=6, color="#444444")
(trace,) = axes.plot([], [], [], linewidth=1.5, color="#d95f02")


def draw(number: int) -> None:
    """One picture: the links, and where the tool has been."""
    links.set_data_3d(*outline_mm[number].T)
    trace.set_data_3d(*tool_mm[: number + 1].T)


film = animation.FuncAnimation(figure, draw, frames=len(times_s))
film.save("arm.gif", writer=animation.PillowWriter(fps=RATE_HZ), dpi=80)
print(f"wrote arm.gif, {plan.total_s:.2f} s of {plan.job.name}")
