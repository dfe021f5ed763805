"""Figures of plans and runs, drawn with matplotlib (the optional extra ``plot``).

Every function returns a matplotlib Figure; ``drawing`` writes it. The colours are legible on white and on black.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import MissingPackageError
from armtempo.basics.text import visible
from armtempo.model.joint_unit import DEG, JointUnit
from armtempo.model.parts import Limits
from armtempo.planning.torque import MotorTorques
from armtempo.report import replayed
from armtempo.report.analysis import Curves
from armtempo.report.drawing import PAGE_COLOUR
from armtempo.splines.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#1f77b4", "#d95f02", "#1b9e77", "#b0479a", "#8c6d1f", "#6b6ecf")
LIMIT_COLOUR = "#c0392b"
_LABELS = ("angle (°)", "speed (°/s)", "acceleration (°/s²)", "jerk (°/s³)")
_POINTS = 600
_LEFT, _RIGHT, _BOTTOM, _TOP, _BETWEEN = 0.85, 0.15, 0.5, 0.3, 0.35
"""Inches around a joint's axes, for labels of up to six digits, and between two rows."""


def new_figure(
    rows: int, columns: int, width: float, height: float, share: bool = False
) -> tuple[Figure, Any]:
    """A figure and its axes (rows, columns); ``share``: one time axis for each column, which is twice as fast.

    Raises MissingPackageError without matplotlib.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingPackageError("a figure", "matplotlib", "plot") from None
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, sharex="col" if share else False)


def _joint_figure(rows: int, names: Sequence[str], height: float) -> tuple[Figure, Any]:
    """A figure with a column for each joint and fixed margins, as measuring all labels takes a second."""
    columns, width = len(names), 3.4 * len(names) + 0.6
    figure, axes = new_figure(rows, columns, width, height, share=True)
    figure.set_layout_engine(None)
    wide = (width - _LEFT - _RIGHT - (columns - 1) * (_LEFT + _RIGHT)) / columns
    high = (height - _BOTTOM - _TOP - (rows - 1) * _BETWEEN) / rows
    figure.subplots_adjust(
        _LEFT / width, _BOTTOM / height, 1.0 - _RIGHT / width, 1.0 - _TOP / height,
        wspace=(_LEFT + _RIGHT) / wide, hspace=_BETWEEN / high,
    )  # fmt: skip
    for joint, name in enumerate(names):
        axes[0][joint].set_title(visible(name), parse_math=False)
        axes[-1][joint].set_xlabel("time (s)")
    return figure, axes


def motion(trajectory: Trajectory, limits: Sequence[Limits], names: Sequence[str]) -> Figure:
    """Angle, speed, acceleration and jerk of every joint, which turns, with ``limits`` unless empty (Figs. 5 and 7)."""
    figure, axes = _joint_figure(4, names, 8.0)
    times = np.linspace(0.0, trajectory.duration_s, _POINTS)
    for order in range(4):
        values = trajectory(times, order)
        for joint, axis in enumerate(axes[order]):
            axis.plot(times, values[:, joint], color=COLOURS[joint % len(COLOURS)])
            if limits:
                _mark_limits(axis, limits[joint], order)
    _label(axes, _LABELS, ())
    return figure


def tracking(
    found: Curves,
    trajectory: Trajectory,
    limits: Sequence[Limits],
    names: Sequence[str],
    units: Sequence[JointUnit] = (),
) -> Figure:
    """Measured mean and its standard error as a band, with theory (Figs. 11 and 12), and the planned jerk.

    For a joint without an encoder the command; ``limits`` may be empty.
    """
    figure, axes = _joint_figure(4, names, 8.0)
    times: Array = np.linspace(0.0, max(trajectory.duration_s, found.times_s[-1]), _POINTS)
    if np.array_equal(found.path_s, found.times_s):
        planned = [trajectory(times, order) for order in range(4)]
    else:
        times = times[times <= found.times_s[-1]]
        slower = replayed.theory(trajectory, times, np.interp(times, found.times_s, found.path_s))
        jerk = np.gradient(slower[2], times, axis=0) if len(times) > 1 else np.zeros_like(slower[2])
        planned = [*slower, jerk]
    for order, theory in enumerate(planned):
        for joint, axis in enumerate(axes[order]):
            if order < len(found.mean):
                _draw_mean(axis, found, order, joint)
            axis.plot(times, theory[:, joint], ":", color=PAGE_COLOUR, label="planned")
            if limits:
                _mark_limits(axis, limits[joint], order)
    for axis in axes[0]:
        axis.legend(frameon=False)
    _label(axes, _LABELS, units)
    return figure


def _draw_mean(axis: Axes, found: Curves, order: int, joint: int) -> None:
    colour = COLOURS[joint % len(COLOURS)]
    mean, sem = found.mean[order, :, joint], found.sem[order, :, joint]
    axis.fill_between(found.times_s, mean - sem, mean + sem, color=colour, alpha=0.3, linewidth=0)
    axis.plot(found.times_s, mean, color=colour, label="measured" if found.measured[joint] else "commanded")


def errors(found: Curves, names: Sequence[str], units: Sequence[JointUnit] = ()) -> Figure:
    """Measured, or else commanded, minus planned angle of every repetition, and their mean."""
    figure, axes = _joint_figure(1, names, 2.6)
    for joint, axis in enumerate(axes[0]):
        colour = COLOURS[joint % len(COLOURS)]
        for run in found.each[:, 0, :, joint]:
            axis.plot(found.times_s, run - found.theory[0, :, joint], color=colour, alpha=0.3, linewidth=0.8)
        axis.plot(found.times_s, found.mean[0, :, joint] - found.theory[0, :, joint], color=colour)
    _label(axes, ("error (°)",), units)
    return figure


def torque(found: MotorTorques, enough: float) -> Figure:
    """Ratio of the torque that each motor can hold to the one it needs; dashed at 1 (steps are lost) and ``enough``."""
    figure, ((axis,),) = new_figure(1, 1, 6.8, 2.8)
    for joint, name in enumerate(found.joints):
        colour = COLOURS[joint % len(COLOURS)]
        axis.plot(found.times_s, found.margin[:, joint], color=colour, label=_shown(name))
    for value in (1.0, enough):
        axis.axhline(value, color=LIMIT_COLOUR, linestyle="--", linewidth=0.8)
    axis.set_yscale("log")
    axis.set_ylim(0.5, 20.0)
    axis.set_yticks([0.5, 1, 1.5, 2, 5, 10, 20], ["0.5", "1", "1.5", "2", "5", "10", "20"])
    axis.minorticks_off()
    axis.set(xlabel="time (s)", ylabel="torque held of needed")
    axis.legend(frameon=False, ncols=len(found.joints))
    theme(axis)
    return figure


def overlay(runs: Mapping[str, tuple[Array, Array, Array]], unit: JointUnit = DEG) -> Figure:
    """One joint of several runs: times (K,), mean angle, speed and acceleration (3, K), angle error (K,)."""
    figure, axes = new_figure(4, 1, 4.8, 8.0, share=True)
    for index, (name, (times, mean, error)) in enumerate(runs.items()):
        for axis, values in zip(axes[:, 0], (*mean, error), strict=True):
            axis.plot(times, values, color=COLOURS[index % len(COLOURS)], label=_shown(name))
    axes[0][0].legend(frameon=False)
    axes[-1][0].set_xlabel("time (s)")
    _label(axes, (*_LABELS[:3], "error (°)"), (unit,))
    return figure


def convergence(histories: Mapping[str, Array], polished_s: Mapping[str, float] | None = None) -> Figure:
    """Best value after each iteration of the search (Fig. 6), and where the gradient solver ended after it."""
    figure, axes = new_figure(1, 1, 4.8, 2.6)
    axis = axes[0][0]
    for index, (name, history) in enumerate(histories.items()):
        colour = COLOURS[index % len(COLOURS)]
        axis.plot(history, color=colour, label=_shown(name))
        if polished_s and name in polished_s:
            axis.plot(len(history), polished_s[name], "o", color=colour)
    axis.set_xlabel("iteration")
    axis.set_ylabel("best fitness (s)")
    axis.legend(frameon=False)
    theme(axis)
    return figure


def _shown(name: str) -> str:
    """A name for a legend; matplotlib omits names that begin with an underscore."""
    return f" {name}" if name.startswith("_") else name


def _mark_limits(axis: Axes, limits: Limits, order: int) -> None:
    """Dashed lines at plus and minus the limit of this order (not of the angle)."""
    if order == 0:
        return
    limit = (limits.speed_deg_s, limits.acceleration_deg_s2, limits.jerk_deg_s3)[order - 1]
    for value in (-limit, limit):
        axis.axhline(value, color=LIMIT_COLOUR, linestyle="--", linewidth=0.8)


def _label(axes: Any, labels: Sequence[str], units: Sequence[JointUnit]) -> None:
    """The labels beside the rows; small numbers get a common power of ten, as they would be longer than the margin.

    ``units``: of the columns; (): all in degrees.
    """
    for row, label in zip(axes, labels, strict=False):
        for axis, unit in zip(row, units or (DEG,) * len(row), strict=True):
            axis.set_ylabel(
                label if unit is DEG else label.replace(DEG.what, unit.what).replace("°", unit.name)
            )
            axis.ticklabel_format(axis="y", scilimits=(-2, 6))
            theme(axis)


def theme(axis: Axes) -> None:
    """Give grid, ticks, labels, title and legend of a finished plot the page's colour."""
    axis.grid(alpha=0.25)
    axis.tick_params(colors=PAGE_COLOUR)
    for label in (axis.title, axis.xaxis.label, axis.yaxis.label):
        label.set_color(PAGE_COLOUR)
    for spine in axis.spines.values():
        spine.set_color(PAGE_COLOUR)
    legend = axis.get_legend()
    if legend is not None:
        for text in legend.get_texts():
            text.set_color(PAGE_COLOUR)
