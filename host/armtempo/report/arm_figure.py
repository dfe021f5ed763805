"""The arm along its path, drawn in three dimensions from where most of it can be seen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.report.drawing import PAGE_COLOUR
from armtempo.report.plots import COLOURS, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ZOOM = 0.9
_LOWEST_DEG, _HIGHEST_DEG = 15.0, 65.0
"""Elevations of the view: not along the floor, where heights overlap, nor from above, where they are lost."""


def postures(chains_mm: Array, tool_path_mm: Array) -> Figure:
    """The arm along its path (Fig. 10): chains (P, joints + 1, 3) of joint origins, tool path (K, 3)."""
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
    """Elevation and azimuth from which points (N, 3) are spread most: along the direction of their least scatter."""
    _, _, directions = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    least = directions[-1] * (1.0 if directions[-1][2] >= 0.0 else -1.0)
    flat = np.hypot(least[0], least[1])
    azimuth = np.degrees(np.arctan2(least[1], least[0])) if flat > 1e-6 else -60.0
    elevation = np.degrees(np.arctan2(least[2], flat))
    return float(np.clip(elevation, _LOWEST_DEG, _HIGHEST_DEG)), float(azimuth)


def _equal_scales(axis: Any, points: Array) -> None:
    """A millimetre is as long along all three axes; no side of the box is less than a third of the longest."""
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
