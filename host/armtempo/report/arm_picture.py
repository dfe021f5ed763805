"""Pictures of an arm: its home posture, the range of each driven joint, and its path in 3-D."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.kinematics import Geometry, all_frames, forward
from armtempo.kinematics.chain import outline_mm
from armtempo.model.arm import Arm
from armtempo.model.workspace import FAR_MM, Workspace
from armtempo.planning.workspace_check import Bodies
from armtempo.report.drawing import PAGE_COLOUR
from armtempo.report.plots import COLOURS, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ZOOM = 0.9
_LOWEST_DEG, _HIGHEST_DEG = 15.0, 65.0
"""Range of the view's elevation: near 0 heights overlap, near 90 degrees they vanish."""
HOME, LOW, HIGH, GROUND = "#333333", "#1f77b4", "#d95f02", "#9a9a9a"
_MOST_COLUMNS = 4
_ARC_POINTS = 60
_CAPSULE_ALPHA = 0.15
_TICK = 0.08
"""Length of the tool's x axis, as a fraction of the arm's height and width."""


def postures(chains_mm: Array, tool_path_mm: Array) -> Figure:
    """The arm along its path (Fig. 10): joint origins (P, joints + 1, 3), tool path (K, 3)."""
    figure, _ = new_figure(1, 1, 4.8, 4.4)
    figure.clear()
    axis: Any = figure.add_subplot(projection="3d")
    for chain in chains_mm[1:-1]:
        axis.plot(*chain.T, "-o", color=COLOURS[0], alpha=0.3, markersize=2, linewidth=1)
    for name, chain, colour in (("start", chains_mm[0], COLOURS[2]), ("end", chains_mm[-1], COLOURS[0])):
        axis.plot(*chain.T, "-o", color=colour, markersize=3.5, linewidth=2.5)
        axis.text(*chain[-1], f"  {name}", color=PAGE_COLOUR, fontweight="bold")
    axis.plot(*tool_path_mm.T, color=COLOURS[1], linewidth=1.8)
    axis.text(*chains_mm[0][0], "  base", color=PAGE_COLOUR)
    points = np.concatenate([*chains_mm, tool_path_mm])
    axis.view_init(*view_deg(points))
    _equal_scales(axis, points)
    _theme(axis)
    return figure


def view_deg(points: Array) -> tuple[float, float]:
    """Elevation and azimuth of the view on points (N, 3) along the direction of their least scatter."""
    _, _, directions = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    least = directions[-1] * (1.0 if directions[-1][2] >= 0.0 else -1.0)
    flat = np.hypot(least[0], least[1])
    azimuth = np.degrees(np.arctan2(least[1], least[0])) if flat > 1e-6 else -60.0
    elevation = np.degrees(np.arctan2(least[2], flat))
    return float(np.clip(elevation, _LOWEST_DEG, _HIGHEST_DEG)), float(azimuth)


def _equal_scales(axis: Any, points: Array) -> None:
    """Give the three axes the same scale; no side of the box is shorter than a third of the longest."""
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    sides = np.ptp(points, axis=0)
    sides = 1.1 * np.maximum(sides, max(sides.max(), 1.0) / 3)
    for set_limits, at, side in zip(
        (axis.set_xlim, axis.set_ylim, axis.set_zlim), middle, sides, strict=True
    ):
        set_limits(at - side / 2, at + side / 2)
    axis.set_box_aspect(sides, zoom=_ZOOM)


def _theme(axis: Any) -> None:
    for part, name in ((axis.xaxis, "x"), (axis.yaxis, "y"), (axis.zaxis, "z")):
        part.set_pane_color((0.5, 0.5, 0.5, 0.08))
        part.set_label_text(f"{name} (mm)")
        part.label.set_color(PAGE_COLOUR)
        part.labelpad = 8 if name == "y" else 3
    axis.tick_params(colors=PAGE_COLOUR, labelsize=8)
    axis.locator_params(nbins=5)


if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_AXES_SHOWN = 0.1
"""Length of a frame's axes, as a fraction of the arm's extent."""


def arm_picture(arm: Arm) -> Figure:
    """One field for the home posture from the side and from above, one for each driven joint.

    Each joint is viewed along its axis, with x, or else y, to the right. Raises MissingPackageError without
    matplotlib.
    """
    count = 2 + len(arm.driven)
    columns = min(_MOST_COLUMNS, (count + 1) // 2 if count > 3 else count)
    rows = -(-count // columns)
    figure, axes = new_figure(rows, columns, 4.2 * columns, 4.3 * rows + 0.5)
    fields = list(axes.flat)
    extent = np.ptp(outline_mm(arm, np.array(arm.all_home_deg)), axis=0)
    size = float(extent.max()) or 1.0
    _home(fields[0], arm, "home, from the side", (int(extent[1] > extent[0]), 2), size)
    _home(fields[1], arm, "home, from above", (0, 1), size)
    for axis, index in zip(fields[2:], arm.driven_indices, strict=False):
        _joint(axis, arm, index, size)
    for axis in fields[count:]:
        axis.set_axis_off()
    _explain(figure, arm)
    return figure


def _home(axis: Axes, arm: Arm, title: str, seen: tuple[int, int], size: float) -> None:
    """The home posture; ``seen``: which of x, y, z point to the right and up."""
    _draw(axis, arm, np.array(arm.all_home_deg), np.eye(3)[list(seen)], HOME, size)
    _draw_workspace(axis, arm, seen)
    _draw_capsules(axis, arm, seen)
    _draw_frames(axis, arm, seen, _AXES_SHOWN * size)
    if seen[1] == 2:
        axis.axhline(0.0, color=GROUND, linewidth=0.8, zorder=0)
    axis.set_xlabel(f"{'xyz'[seen[0]]} (mm)")
    axis.set_ylabel(f"{'xyz'[seen[1]]} (mm)")
    _frame(axis, title)


def _draw_workspace(axis: Axes, arm: Arm, seen: tuple[int, int]) -> None:
    """The boxes, and the walls as lines."""
    from scipy.spatial import ConvexHull  # here, as few arms have boxes

    workspace = arm.workspace or Workspace()
    for box in workspace.keep_out:
        corners = box.corners_mm[:, list(seen)]
        axis.fill(*corners[ConvexHull(corners).vertices].T, color=HIGH, alpha=0.25, zorder=0)
        axis.annotate(box.name, tuple(corners.min(axis=0)), fontsize=7, color=HIGH)
    for place, draw in zip(seen, (axis.axvline, axis.axhline), strict=True):
        for end in (workspace.low_mm[place], workspace.high_mm[place]):
            if abs(end) < FAR_MM:
                draw(end, color=HIGH, linewidth=1.0, zorder=0)


def _draw_frames(axis: Axes, arm: Arm, seen: tuple[int, int], length: float) -> None:
    """The frames of the arm file: their x axes solid, their y axes dotted, their names at their origins."""
    for each in arm.frames:
        pose = arm.frame(each.name)
        for column, style in ((0, "-"), (1, ":")):
            ends = pose[:3, 3] + np.outer([0.0, length], pose[:3, column])
            axis.plot(*ends[:, list(seen)].T, style, color=GROUND, linewidth=1.2)
        axis.annotate(each.name, tuple(pose[list(seen), 3]), fontsize=7, color=GROUND)


def _draw_capsules(axis: Axes, arm: Arm, seen: tuple[int, int]) -> None:
    """The links' capsules at the home posture, as segments with round ends."""
    bodies = Bodies(arm)
    half = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _ARC_POINTS)
    for radius, start, end in zip(bodies.radius_mm, *bodies.ends(np.array([arm.home_deg])), strict=True):
        if radius:
            way = (end - start)[0, list(seen)]
            turn = half + np.arctan2(way[1], way[0])
            round_end = radius * np.column_stack([np.cos(turn), np.sin(turn)])
            edge = np.concatenate([end[0, list(seen)] + round_end, start[0, list(seen)] - round_end])
            axis.fill(*edge.T, color=HOME, alpha=_CAPSULE_ALPHA, linewidth=0.0, zorder=0)


def _joint(axis: Axes, arm: Arm, index: int, size: float) -> None:
    joint, home = arm.joints[index], np.array(arm.all_home_deg)
    before = all_frames(Geometry.of(arm), np.radians(home).tolist())[index]
    view = _view(before[:3, 0 if joint.slides else 2])  # a sliding joint from the side
    low, high = joint.range_deg
    for angle, colour in ((low, LOW), (high, HIGH), (joint.home_deg, HOME)):
        angles = home.copy()
        angles[index] = angle
        _draw(axis, arm, angles, view, colour, size)
    swept = np.repeat(home[None], _ARC_POINTS, axis=0)
    swept[:, index] = np.linspace(low, high, _ARC_POINTS)
    axis.plot(*(outline_mm(arm, swept)[:, -1] @ view.T).T, ":", color=GROUND, linewidth=1.2, zorder=1)
    axis.plot(*(view @ before[:3, 3]), "o", markersize=11, markerfacecolor="none", color=HOME)
    if abs(before[2, 2]) < 1e-6:
        axis.axhline(0.0, color=GROUND, linewidth=0.8, zorder=0)
    sign = joint.unit.sign
    _frame(axis, f"{joint.name}: {low:g}{sign} to {high:g}{sign}, home {joint.home_deg:g}{sign}")


def _view(direction: Array) -> Array:
    """Right and up, (2, 3), of a view along ``direction``, or against it; up is the base's z axis, or y."""
    up = np.array([0.0, 0.0, 1.0]) if abs(direction[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    up = up - (up @ direction) * direction
    up /= np.linalg.norm(up)
    right = np.cross(up, direction)
    return np.array([right if right[np.argmax(np.abs(right))] > 0.0 else -right, up])


def _draw(axis: Axes, arm: Arm, angles_deg: Array, view: Array, colour: str, size: float) -> None:
    """The arm's outline, a dot at each frame, and the tool's x axis."""
    points = outline_mm(arm, angles_deg) @ view.T
    order = 3 if colour == HOME else 2
    axis.plot(*points.T, color=colour, linewidth=2.6, solid_capstyle="round", zorder=order)
    axis.plot(*points[::2].T, "o", color=colour, markersize=4.5, zorder=order)
    tool = forward(Geometry.of(arm), np.radians(angles_deg))
    tick = np.array([tool[:3, 3], tool[:3, 3] + _TICK * size * tool[:3, 0]]) @ view.T
    axis.plot(*tick.T, color=colour, linewidth=1.2, zorder=order)


def _frame(axis: Any, title: str) -> None:
    axis.set_title(title, fontsize=10)
    axis.set_aspect("equal", adjustable="datalim")
    axis.margins(0.08)
    axis.grid(color="#dddddd", linewidth=0.5)
    axis.set_axisbelow(True)


def _explain(figure: Figure, arm: Arm) -> None:
    from matplotlib.lines import Line2D

    lines = [
        Line2D([], [], color=colour, linewidth=2.6, label=label)
        for colour, label in ((HOME, "home"), (LOW, "low end"), (HIGH, "high end"))
    ]
    lines.append(Line2D([], [], color=GROUND, linestyle=":", label="tool's path"))
    lines.append(
        Line2D([], [], color=HOME, linestyle="", marker="o", markerfacecolor="none", label="its axis")
    )
    figure.legend(handles=lines, loc="outside lower center", ncols=5, frameon=False)
    figure.suptitle(
        f"{arm.name}: each joint seen along its axis{', sliding ones from the side' if arm.slides else ''}, "
        "the others at their home angles; lengths in mm"
    )
