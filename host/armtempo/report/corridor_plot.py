"""Motion time against corridor, as table and figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from armtempo.basics.text import aligned
from armtempo.planning.free.corridor_curve import CorridorTime
from armtempo.report import plots

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def lines(points: Sequence[CorridorTime], unit: str) -> list[str]:
    """One string a line."""
    first = points[0].total_s
    rows = [["corridor", "time", "saved"], [unit, "s", "%"]]
    for point in points:
        name = "free" if point.corridor is None else f"{point.corridor:.4g}"
        rows.append([name, f"{point.total_s:.4f}", f"{100.0 * (1.0 - point.total_s / first):.2f}"])
    return aligned(rows, (10, 10, 8))


def csv(points: Sequence[CorridorTime], unit: str) -> str:
    """A line for each corridor; that of the free path is empty."""
    head = f"corridor_{unit},time_s\n"
    return head + "".join(
        f"{'' if point.corridor is None else repr(point.corridor)},{point.total_s!r}\n" for point in points
    )


def figure(points: Sequence[CorridorTime], unit: str, name: str) -> Figure:
    """The curve; lines for the spline itself and for the free path. MissingPackageError without matplotlib."""
    drawn, grid = plots.new_figure(1, 1, 6.4, 4.0)
    axes = grid[0][0]
    inner = [(point.corridor, point.total_s) for point in points if point.corridor]
    axes.plot(*zip(*inner, strict=True), marker="o", markersize=3, label="in a corridor")
    for point in points:
        if not point.corridor:
            label = "free" if point.corridor is None else "on the spline"
            axes.axhline(
                point.total_s, linestyle=":" if point.corridor is None else "--", label=label, linewidth=1
            )
    axes.set_xscale("log")
    axes.set_xlabel(f"corridor ({'mm, tool' if unit == 'mm' else 'degrees, any joint'})")
    axes.set_ylabel("motion time (s)")
    axes.set_title(name)
    axes.legend()
    plots.theme(axes)
    return drawn
