"""Curves of all joints over time."""

from __future__ import annotations

import numpy as np
from nicegui import ui

from armtempo.basics.arrays import Array
from armtempo.model.arm import Arm
from armtempo.panel import words

COLOURS = ("#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377")
"""Paul Tol's bright scheme."""
DASHES = ("solid", "dashed", "dotted")
_GRID = {"lineStyle": {"color": "rgba(128, 128, 128, 0.3)"}}
ORDER_LIMIT = {1: "speed_deg_s", 2: "acceleration_deg_s2", 3: "jerk_deg_s3"}


class CurveChart:
    """One chart; ``order`` 0: angle, 1: speed, 2: acceleration, 3: jerk, whose limits are drawn."""

    def __init__(self, arm: Arm, title: str, order: int) -> None:
        self._arm, self._order = arm, order
        options = {
            "animation": False,
            "grid": {"left": 55, "right": 15, "top": 30, "bottom": 25},
            "legend": {"top": 2, "right": 5, "left": 55, "type": "scroll", "align": "left"},
            "tooltip": {"trigger": "axis"},
            "xAxis": {
                "type": "value",
                "name": words.TIME_S,
                "nameGap": 4,
                "max": "dataMax",
                "axisLabel": {"showMaxLabel": False},
                "splitLine": _GRID,
            },
            "yAxis": {"type": "value", "scale": True, "splitLine": _GRID},
            "series": [],
        }
        self._place = ui.element("div").classes("full-width")
        self._place.set_visibility(False)  # until there is something to show
        with self._place:
            ui.label(title).classes("text-caption")
            self.chart = ui.echart(options, renderer="svg").classes("armtempo-chart")

    def show(self, times_s: Array, values: Array, reference: Array | None = None) -> None:
        """A curve for each joint: times (N,), values (N, J); ``reference``, (N, J), is dotted."""
        joints = range(values.shape[1])
        series = [self._curve(number, times_s, values[:, number]) for number in joints]
        if reference is not None:
            series += [self._curve(number, times_s, reference[:, number], of_plan=True) for number in joints]
        self._place.set_visibility(True)
        self.chart.options["series"] = series
        self.chart.update()

    def mark(self, time_s: float) -> None:
        """Show a cursor at a time of the plan."""
        self.chart.run_chart_method(
            "setOption", {"xAxis": {"axisPointer": {"value": time_s, "status": "show"}}}, timeout=0.0
        )

    def _curve(self, number: int, times_s: Array, values: Array, of_plan: bool = False) -> dict[str, object]:
        points = np.column_stack((times_s, values)).round(4).tolist()
        curve: dict[str, object] = {
            "name": self._arm.driven[number].name,  # one entry of the legend for both
            "type": "line",
            "showSymbol": False,
            "color": COLOURS[number % len(COLOURS)],
            "data": points,
        }
        if of_plan:
            return {**curve, "lineStyle": {"type": "dotted", "width": 4, "opacity": 0.5}}
        return {**curve, "lineStyle": {"type": DASHES[number // len(COLOURS)]}, **self._limit(number)}

    def _limit(self, number: int) -> dict[str, object]:
        """Lines at a joint's limit, both ways."""
        if self._order not in ORDER_LIMIT:
            return {}
        limit = getattr(self._arm.driven[number].limits, ORDER_LIMIT[self._order])
        style = {"type": "dotted", "color": COLOURS[number % len(COLOURS)], "opacity": 0.5}
        lines = [{"yAxis": value, "lineStyle": style} for value in (limit, -limit)]
        return {"markLine": {"silent": True, "symbol": "none", "label": {"show": False}, "data": lines}}
