"""Figures of plans and runs, drawn with matplotlib (the optional extra ``plot``).

Every function returns a matplotlib Figure; ``save`` writes it as PNG or SVG, ``inline_svg`` gives it as
text for a page. Colours are legible on white and on black; on a page, axes and text take the colour of the page's text.
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from armtempo.arrays import Array
from armtempo.errors import MissingPackageError
from armtempo.model.arm import Limits
from armtempo.runs.analysis import Curves
from armtempo.splines.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#1f77b4", "#d95f02", "#1b9e77", "#b0479a", "#8c6d1f", "#6b6ecf")
LIMIT_COLOUR = "#c0392b"
_PAGE_COLOUR = "#010203"
"""Stands for the page's text colour until ``inline_svg`` replaces it."""
_LABELS = ("angle (°)", "speed (°/s)", "acceleration (°/s²)", "jerk (°/s³)")
_POINTS = 600


def new_figure(rows: int, columns: int, width: float, height: float) -> tuple[Figure, Any]:
    """A figure and its axes, an array (rows, columns).

    Raises MissingPackageError where matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingPackageError("a figure", "matplotlib", "plot") from None
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False)


def motion(trajectory: Trajectory, limits: Sequence[Limits], names: Sequence[str]) -> Figure:
    """Angle, speed, acceleration and jerk of every joint with their limits (Figs. 5 and 7)."""
    figure, axes = new_figure(4, len(names), 3.4 * len(names) + 0.6, 8.0)
    times = np.linspace(0.0, trajectory.duration_s, _POINTS)
    for order in range(4):
        values = trajectory(times, order)
        for joint, axis in enumerate(axes[order]):
            axis.plot(times, values[:, joint], color=COLOURS[joint % len(COLOURS)])
            _mark_limits(axis, limits[joint], order)
    _label(axes, names, _LABELS)
    return figure


def tracking(found: Curves, trajectory: Trajectory, limits: Sequence[Limits], names: Sequence[str]) -> Figure:
    """Measured mean with its standard error as a band, against theory (Figs. 11 and 12)."""
    figure, axes = new_figure(3, len(names), 3.4 * len(names) + 0.6, 6.5)
    times = np.linspace(0.0, max(trajectory.duration_s, found.times_s[-1]), _POINTS)
    for order in range(3):
        theory = trajectory(times, order)
        for joint, axis in enumerate(axes[order]):
            colour = COLOURS[joint % len(COLOURS)]
            mean, sem = found.mean[order, :, joint], found.sem[order, :, joint]
            axis.fill_between(found.times_s, mean - sem, mean + sem, color=colour, alpha=0.3, linewidth=0)
            axis.plot(found.times_s, mean, color=colour, label="measured")
            axis.plot(times, theory[:, joint], ":", color=_PAGE_COLOUR, label="theory")
            _mark_limits(axis, limits[joint], order)
    axes[0][0].legend(frameon=False)
    _label(axes, names, _LABELS)
    return figure


def errors(found: Curves, names: Sequence[str]) -> Figure:
    """Measured minus planned angle of every repetition and their mean, over time."""
    figure, axes = new_figure(1, len(names), 3.4 * len(names) + 0.6, 2.6)
    for joint, axis in enumerate(axes[0]):
        colour = COLOURS[joint % len(COLOURS)]
        for run in found.each[:, 0, :, joint]:
            axis.plot(found.times_s, run - found.theory[0, :, joint], color=colour, alpha=0.3, linewidth=0.8)
        axis.plot(found.times_s, found.mean[0, :, joint] - found.theory[0, :, joint], color=colour)
    _label(axes, names, ("error (°)",))
    return figure


def overlay(runs: Mapping[str, tuple[Array, Array, Array]]) -> Figure:
    """One joint of several runs: times (K,), mean angle, speed, acceleration (3, K), angle error (K,)."""
    figure, axes = new_figure(4, 1, 7.5, 8.0)
    for index, (name, (times, mean, error)) in enumerate(runs.items()):
        for axis, values in zip(axes[:, 0], (*mean, error), strict=True):
            axis.plot(times, values, color=COLOURS[index % len(COLOURS)], label=name)
    axes[0][0].legend(frameon=False)
    _label(axes, ("",), (*_LABELS[:3], "error (°)"))
    return figure


def convergence(histories: Mapping[str, Array]) -> Figure:
    """Best value after each iteration of the search (Fig. 6)."""
    figure, axes = new_figure(1, 1, 6.4, 3.0)
    axis = axes[0][0]
    for index, (name, history) in enumerate(histories.items()):
        axis.plot(history, color=COLOURS[index % len(COLOURS)], label=name)
    axis.set_xlabel("iteration")
    axis.set_ylabel("best fitness (s)")
    axis.legend(frameon=False)
    theme(axis)
    return figure


def postures(chains_mm: Array, tool_path_mm: Array) -> Figure:
    """The arm along its path in 3-D (Fig. 10): chains (P, 7, 3) of joint origins, tool path (K, 3)."""
    figure, _ = new_figure(1, 1, 6.4, 5.2)
    figure.clear()
    axis: Any = figure.add_subplot(projection="3d")
    for index, chain in enumerate(chains_mm):
        share = index / max(1, len(chains_mm) - 1)
        axis.plot(*chain.T, "-o", color=COLOURS[0], alpha=0.25 + 0.75 * share, markersize=3)
    axis.plot(*tool_path_mm.T, color=COLOURS[1], linewidth=2)
    axis.set_xlabel("x (mm)")
    axis.set_ylabel("y (mm)")
    axis.set_zlabel("z (mm)")
    axis.set_aspect("equal")
    for part in (axis.xaxis, axis.yaxis, axis.zaxis):
        part.set_pane_color((0.5, 0.5, 0.5, 0.08))
        part.label.set_color(_PAGE_COLOUR)
    axis.tick_params(colors=_PAGE_COLOUR)
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write the figure as its suffix says: PNG on white, SVG without a background."""
    _lay_out(figure)
    if path.suffix == ".svg":
        path.write_text(_svg(figure).replace(_PAGE_COLOUR, "#222222"), encoding="utf-8")
    else:
        figure.savefig(path, dpi=150, facecolor="white")


def inline_svg(figure: Figure, name: str, description: str) -> str:
    """The figure as an ``<svg>`` element in the page's colour, with a description for screen readers."""
    text = _svg(figure)
    text = text[text.index("<svg") :].replace(_PAGE_COLOUR, "currentColor")
    width = re.search(r'width="([\d.]+)pt"', text)
    drawn = f"{float(width.group(1)) * 4 / 3:.0f}px" if width else "none"
    style = f"--drawn: {drawn}; max-width: {drawn}"
    text = re.sub(r'(width|height)="[\d.]+pt" ', "", text, count=2)
    text = re.sub(r'(\bid=")', rf"\g<1>{name}-", text)
    text = re.sub(r'(xlink:href="#|url\(#)', rf"\g<1>{name}-", text)
    return text.replace("<svg ", f'<svg role="img" aria-label="{escape(description)}" style="{style}" ', 1)


def _lay_out(figure: Figure) -> None:
    """Fix the layout: with a layout engine left, each file would be drawn twice."""
    if figure.get_layout_engine() is not None:
        figure.draw_without_rendering()
        figure.set_layout_engine(None)


@lru_cache(maxsize=8)
def _svg(figure: Figure) -> str:
    from matplotlib import rc_context

    _lay_out(figure)
    buffer = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "armtempo"}):
        figure.savefig(buffer, format="svg", transparent=True, metadata={"Date": None})
    return re.sub(r' d="[^"]*"', _rounded, buffer.getvalue())


def _rounded(path: re.Match[str]) -> str:
    """Coordinates to a hundredth of a point: half the size, no visible difference."""
    return re.sub(r"(\.\d\d)\d+", r"\1", path.group())


def _mark_limits(axis: Axes, limits: Limits, order: int) -> None:
    """Dashed lines at plus and minus the limit of this order; none for the angle."""
    if order == 0:
        return
    limit = (limits.speed_deg_s, limits.acceleration_deg_s2, limits.jerk_deg_s3)[order - 1]
    for value in (-limit, limit):
        axis.axhline(value, color=LIMIT_COLOUR, linestyle="--", linewidth=0.8)


def _label(axes: Any, names: Sequence[str], labels: Sequence[str]) -> None:
    for joint, name in enumerate(names):
        axes[0][joint].set_title(name)
        axes[-1][joint].set_xlabel("time (s)")
    for row, label in zip(axes, labels, strict=False):
        row[0].set_ylabel(label)
        for axis in row:
            theme(axis)


def theme(axis: Axes) -> None:
    """Give grid, ticks, labels, title and legend of a finished drawing the page's colour."""
    axis.grid(alpha=0.25)
    axis.tick_params(colors=_PAGE_COLOUR)
    for label in (axis.title, axis.xaxis.label, axis.yaxis.label):
        label.set_color(_PAGE_COLOUR)
    for spine in axis.spines.values():
        spine.set_color(_PAGE_COLOUR)
    legend = axis.get_legend()
    if legend is not None:
        for text in legend.get_texts():
            text.set_color(_PAGE_COLOUR)
