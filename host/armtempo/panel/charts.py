"""Curves of all joints over time."""

from __future__ import annotations

from nicegui import ui

from armtempo.basics.arrays import Array
from armtempo.model.arm import Arm

COLOURS = ("#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377")
"""Paul Tol's bright scheme."""
DASHES = ("solid", "dashed", "dotted")
ORDER_LIMIT = {1: "speed_deg_s", 2: "acceleration_deg_s2", 3: "jerk_deg_s3"}


class CurveChart:
    """One chart; ``order`` 0: angle, 1: speed, 2: acceleration, 3: jerk, whose limits are drawn."""

    def __init__(self, arm: Arm, title: str, order: int) -> None:
        self._arm, self._order = arm, order
        options = {
            "title": {"text": title, "textStyle": {"fontSize": 13}},
            "animation": False,
            "grid": {"left": 55, "right": 15, "top": 35, "bottom": 25},
            "legend": {"top": 2, "right": 5},
            "tooltip": {"trigger": "axis"},
            "xAxis": {"type": "value", "max": "dataMax"},
            "yAxis": {"type": "value", "scale": True},
            "series": [],
        }
        self.chart = ui.echart(options).classes("w-full h-48")

    def show(self, times_s: Array, values: Array) -> None:
        """A curve for each joint: times (N,), values (N, J)."""
        self.chart.options["series"] = [
            {
                "name": joint.name,
                "type": "line",
                "showSymbol": False,
                "color": COLOURS[number % len(COLOURS)],
                "lineStyle": {"type": DASHES[number // len(COLOURS)]},
                "data": [
                    [round(float(t), 4), round(float(v), 4)]
                    for t, v in zip(times_s, values[:, number], strict=True)
                ],
                **self._limit(number),
            }
            for number, joint in enumerate(self._arm.driven)
        ]
        self.chart.update()

    def _limit(self, number: int) -> dict[str, object]:
        """Lines at a joint's limit, both ways."""
        if self._order not in ORDER_LIMIT:
            return {}
        limit = getattr(self._arm.driven[number].limits, ORDER_LIMIT[self._order])
        style = {"type": "dotted", "color": COLOURS[number % len(COLOURS)], "opacity": 0.5}
        lines = [{"yAxis": value, "lineStyle": style} for value in (limit, -limit)]
        return {"markLine": {"silent": True, "symbol": "none", "label": {"show": False}, "data": lines}}
