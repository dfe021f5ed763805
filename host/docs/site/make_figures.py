"""The figures of the pages, in host/docs/images: ``python host/docs/site/make_figures.py [NAME…]``, all without a name.

Each is made by armtempo itself, and what it shows is computed then, not drawn. Needs the extra 'plot'.
"""

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import armtempo
import numpy as np
from armtempo import optimise
from armtempo.kinematics import chain
from armtempo.model import engine_pins
from armtempo.model.workspace import FAR_MM, KeepOut, Workspace
from armtempo.report import plots, run_report
from armtempo.report.arm_picture import arm_picture
from armtempo.report.evaluation import evaluate
from armtempo.simulator import LaunchOptions, edgelog, launch
from armtempo_shared.limits import TICK_HZ
from matplotlib.figure import Figure

IMAGES = Path(__file__).parents[1] / "images"
ANIMATE = Path(__file__).parents[2] / "examples" / "animate.py"
PANEL = Path(__file__).with_name("make_panel_picture.py")
ARM = armtempo.Arm.paper()
POSTURE_DEG = np.array([40.0, -50.0, 20.0, 30.0, 40.0, 10.0])
DPI = 110
TOOL = ["-m", "armtempo"]


def solutions() -> Figure:
    """The eight postures in which the paper's arm has its tool in one pose, whatever its ranges."""
    wanted = armtempo.forward(ARM, POSTURE_DEG)
    figure = Figure(figsize=(9.6, 5.4), layout="constrained")
    for number, found in enumerate(armtempo.inverse(ARM, wanted), 1):
        axes = figure.add_subplot(2, 4, number, projection="3d")
        line = chain.outline_mm(ARM, found.angles_deg)
        axes.plot(*line.T, "o-", linewidth=2.5, markersize=3, color=plots.COLOURS[0])
        axes.plot(*line[-1:].T, "o", color=plots.LIMIT_COLOUR, markersize=6)
        axes.set(xlim=(-350, 350), ylim=(-350, 350), zlim=(-250, 450))
        axes.set(xticklabels=[], yticklabels=[], zticklabels=[])
        axes.set_box_aspect((1, 1, 1), zoom=1.05)
        usable = "usable" if found.usable else "beyond a range"
        axes.set_title(f"{found.branch}: {usable}", fontsize=8)
    return figure


def motion() -> Figure:
    """The feeding motion with one time axis for all joints, next to its limits."""
    from dataclasses import replace

    job = replace(armtempo.Job.paper(), timing="shared", refine="auto", polish=True)
    plan = armtempo.plan(ARM, job)
    joints = ARM.driven
    return plots.motion(plan.trajectory, [joint.limits for joint in joints], [joint.name for joint in joints])


GLUING = """
name = "glue"
speed_mm_s = 60
acceleration_mm_s2 = 400
[[via]]
position_mm = [240, 60, 300]
rpy_deg = [180, 0, 90]
[[via]]
position_mm = [320, 60, 300]
rpy_deg = [180, 0, 90]
line = true
[[via]]
position_mm = [320, -60, 300]
rpy_deg = [180, 0, 90]
line = true
blend_mm = 25
[[via]]
position_mm = [240, -60, 300]
rpy_deg = [180, 0, 90]
line = true
[[via]]
position_mm = [240, 60, 300]
rpy_deg = [180, 0, 90]
arc_through_mm = [210, 0, 300]
"""


def lines() -> Figure:
    """A seam of lines, a cut corner and an arc for the AR4: the tool from above, and its speed."""
    arm = armtempo.Arm.load("ar4")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "glue.toml"
        file.write_text(GLUING, encoding="utf-8")
        plan = armtempo.plan(arm, file)
    times = np.linspace(0.0, plan.total_s, 4001)
    way = armtempo.forward(arm, plan.trajectory(times))[:, :2, 3]
    corners = armtempo.forward(arm, plan.via_deg)[:, :2, 3]
    speed = np.linalg.norm(np.diff(way, axis=0), axis=1) / times[1]
    figure, grid = plots.new_figure(1, 2, 9.6, 3.6)
    seam, speeds = grid[0]
    seam.plot(*way.T, color=plots.COLOURS[0])
    seam.plot(*corners.T, "o", color=plots.COLOURS[1], markersize=4)
    for number, corner in enumerate(corners[:-1]):
        seam.annotate(f"P{number}", corner, textcoords="offset points", xytext=(5, 5), fontsize=8)
    seam.set(aspect="equal", xlabel="x (mm)", ylabel="y (mm)")
    speeds.plot(times[1:], speed, color=plots.COLOURS[0])
    speeds.axhline(60.0, color=plots.LIMIT_COLOUR, linestyle="--", linewidth=1.0)
    speeds.set(xlabel="time (s)", ylabel="speed of the tool (mm/s)")
    for axes in (seam, speeds):
        plots.theme(axes)
    return figure


def workspace() -> Figure:
    """An arm and a box between two via points: the tool on a free path without it and with it."""
    radii_mm = (45.0, 40.0, 35.0, 30.0, 30.0, 25.0)
    bare = armtempo.Arm.load("parol6")
    joints = (replace(joint, radius_mm=radius) for joint, radius in zip(bare.joints, radii_mm, strict=True))
    bare = replace(bare, joints=tuple(joints))
    box = KeepOut("feeder", (-40.0, 130.0, 0.0), (40.0, 300.0, 290.0))
    arm = replace(bare, workspace=Workspace((box,), low_mm=(-FAR_MM, -FAR_MM, 0.0)))
    vias = np.tile(arm.home_deg, (2, 1))
    vias[:, 0] += (-33.0, 33.0)
    vias[:, 1] += 25.0
    figure = arm_picture(arm)
    for each, line in ((bare, ":"), (arm, "-")):
        plan = armtempo.plan(each, armtempo.Job("around", via_deg=vias.tolist(), path="free"))
        way = armtempo.forward(arm, plan.trajectory(np.linspace(0.0, plan.total_s, 400)))[:, :3, 3]
        for field, seen in ((0, [1, 2]), (1, [0, 1])):
            figure.axes[field].plot(*way[:, seen].T, line, color=plots.COLOURS[1])
    return figure


def searches() -> Figure:
    """How the six searches close in on the least of a narrow curved valley in five dimensions (Rosenbrock's)."""

    def valley(x: Any) -> Any:
        return (100.0 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1.0 - x[:, :-1]) ** 2).sum(axis=1)

    histories = {}
    for name in optimise.ALGORITHMS:
        settings = optimise.Settings(name, population=20, iterations=300)
        runs = [
            optimise.minimise(valley, [(-2.0, 2.0)] * 5, np.random.default_rng(seed), settings).history
            for seed in range(9)
        ]
        histories[name] = np.median(runs, axis=0)
    figure = plots.convergence(histories)
    figure.axes[0].set(yscale="log", ylabel="best value, median of 9 seeds")
    return figure


def steps() -> Figure:
    """Where joint 2 of the feeding motion turns: the angle, and the steps that the virtual board made of it."""
    plan = armtempo.plan(ARM, armtempo.Job.paper())
    joint = ARM.driven[1]
    turn_s = _slowest(plan, 1)
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "edges"
        with launch(LaunchOptions(edge_log=log)) as process, armtempo.connect(process.port, ARM) as board:
            board.home(ARM, plan)
            board.run(plan, out=Path(folder) / "runs")
        pins = edgelog.read(log)[-1].motion()
    ticks, levels = pins[engine_pins.table()["STEP"][1][0]]
    times_s = np.asarray(ticks)[np.asarray(levels) == 1] / TICK_HZ
    inside = np.abs(times_s - turn_s) < 0.07
    begin_steps = round(float(plan.trajectory(0.0)[1]) * joint.steps_per_deg)
    dense_s = np.linspace(turn_s - 0.07, turn_s + 0.07, 2001)
    exact = plan.trajectory(dense_s)[:, 1] * joint.steps_per_deg
    figure, grid = plots.new_figure(1, 1, 7.2, 3.4)
    axes = grid[0][0]
    axes.plot(dense_s, exact, color=plots.COLOURS[0], label="angle of the plan, in steps")
    directions = np.sign(np.diff(plan.trajectory(np.concatenate([times_s, times_s[-1:] + 1e-4]))[:, 1]))
    made = begin_steps + np.cumsum(np.where(times_s < turn_s, directions[0], -directions[0]))
    axes.step(times_s[inside], made[inside], where="post", color=plots.COLOURS[1], label="steps made")
    axes.set_xlabel("time (s)")
    axes.set_ylabel("steps")
    axes.legend(frameon=False)
    plots.theme(axes)
    return figure


def tracking() -> Figure:
    """The demo's motion, measured and planned."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, *TOOL, "demo"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        (leg,) = evaluate(Path(folder) / "runs" / "feed-001").legs
        return run_report.figures(leg)["tracking"][0]


def _slowest(plan: Any, joint: int) -> float:
    """When a joint turns, seconds: the first change of its speed's sign."""
    times = np.linspace(0.2, plan.total_s - 0.2, 4001)
    speeds = plan.trajectory(times, 1)[:, joint]
    return float(times[np.flatnonzero(np.diff(np.sign(speeds)))[0]])


def _by_command(name: str, made: str, *commands: list[str]) -> None:
    """A figure that a command writes, as ``made`` below the folder in which it runs."""
    with tempfile.TemporaryDirectory() as folder:
        for command in commands:
            subprocess.run([sys.executable, *command], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        (found,) = Path(folder).glob(made)
        shutil.copy(found, IMAGES / name)


DRAWN: dict[str, Callable[[], Figure]] = {
    "solutions.png": solutions,
    "motion.png": motion,
    "lines.png": lines,
    "workspace.png": workspace,
    "searches.png": searches,
    "steps.png": steps,
    "tracking.png": tracking,
}
BY_COMMAND: dict[str, tuple[Any, ...]] = {
    "arm.gif": ("arm.gif", [str(ANIMATE)]),
    "panel.png": ("panel.png", [str(PANEL)]),
    "ar4.png": ("ar4.png", [*TOOL, "check", "--arm", "ar4", "--picture", "ar4.png"]),
}


def main(names: list[str]) -> None:
    """Make the figures of these names, or all."""
    for name in names or [*DRAWN, *BY_COMMAND]:
        if name in DRAWN:
            DRAWN[name]().savefig(IMAGES / name, dpi=DPI)
        else:
            made, *commands = BY_COMMAND[name]
            _by_command(name, made, *commands)
        print(f"wrote {IMAGES / name}")


if __name__ == "__main__":
    main(sys.argv[1:])
