"""Curves of all joints over time."""

from __future__ import annotations

import json

import numpy as np
from nicegui import ui

from armtempo.basics.arrays import Array
from armtempo.model.arm import Arm
from armtempo.model.joint_unit import DEG
from armtempo.panel import words

COLOURS = ("#4477aa", "#ee6677", "#228833", "#a07c00", "#1a9c9c", "#aa3377")
"""Paul Tol's bright scheme."""
DASHES = ("solid", "dashed", "dotted")
_GRID = {"lineStyle": {"color": "rgba(128, 128, 128, 0.3)"}}
_GREY = "#888888"
_PLACES = ("insideStart", "insideMiddle", "insideEnd")
"""Where limits are named, beside each other where they are nearly the same."""
_FAR = 4.0
"""A limit that is this many times as high as the curves is left out: they would be flat."""
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
            ui.label(title.replace(DEG.name, arm.texts.units)).classes("text-caption")
            self.chart = ui.echart(options, renderer="svg").classes("armtempo-chart")

    def show(self, times_s: Array, values: Array, reference: Array | None = None) -> None:
        """A curve for each joint: times (N,), values (N, J); ``reference``, (N, J), is dotted."""
        joints = range(values.shape[1])
        series = [self._curve(number, times_s, values[:, number]) for number in joints]
        self._show_limits(series, float(np.nanmax(np.abs(values), initial=0.0)))
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
        points = json.dumps(np.column_stack((times_s, values)).round(4).tolist())
        curve: dict[str, object] = {
            "name": words.plain(self._arm.driven[number].labelled),
            "type": "line",
            "showSymbol": False,
            "color": COLOURS[number % len(COLOURS)],
            ":data": points,  # as JavaScript: in a list NiceGUI would watch each of thousands of numbers, in 20 ms
        }
        if of_plan:
            name = words.IN_PLAN.format(name=curve["name"])
            return {**curve, "name": name, "lineStyle": {"type": "dotted", "width": 4, "opacity": 0.5}}
        return {**curve, "lineStyle": {"type": DASHES[number // len(COLOURS)]}}

    def _show_limits(self, series: list[dict[str, object]], most: float) -> None:
        """Lines at the limits, both ways, with the names of the joints that have them; the axis has those near."""
        named = self._limits() if self._order in ORDER_LIMIT else {}
        for count, (limit, numbers) in enumerate(named.items()):
            colour = COLOURS[numbers[0] % len(COLOURS)] if len(numbers) == 1 else _GREY
            text = words.LIMIT.format(names=", ".join(str(series[number]["name"]) for number in numbers))
            place = _PLACES[count % len(_PLACES)]
            label = {"formatter": text, "position": f"{place}Top", "color": "inherit", "fontSize": 10}
            style = {"type": "dotted", "color": colour}
            series[numbers[0]]["markLine"] = {
                "silent": True,
                "symbol": "none",
                "data": [
                    {"yAxis": limit, "lineStyle": style, "label": label},
                    {
                        "yAxis": -limit,
                        "lineStyle": style,
                        "label": {**label, "position": f"{place}Bottom"},
                    },
                ],
            }
        seen = max((limit for limit in named if limit < _FAR * most), default=None)
        end = None if seen is None else max(most, seen) * 1.08
        self.chart.options["yAxis"].update(max=end, min=None if end is None else -end)

    def _limits(self) -> dict[float, list[int]]:
        """The joints that have each limit."""
        found: dict[float, list[int]] = {}
        for number, joint in enumerate(self._arm.driven):
            found.setdefault(getattr(joint.limits, ORDER_LIMIT[self._order]), []).append(number)
        return found
