"""Curves: limits named, measured and planned told apart."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
from armtempo.panel.charts import CurveChart
from armtempo.panel.panel_board import PanelBoard

from tests.host.panel.fakes import ARM
from tests.host.panel.pages import pages


def shown(operator: PanelBoard, most: float) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """The series of a chart of speeds up to ``most`` with a plan, and its axis; joint 3 has a limit of its own."""
    joints = list(ARM.joints)
    for number, limit in enumerate((60.0, 60.0, 99.0)):
        at = ARM.driven_indices[number]
        joints[at] = replace(joints[at], limits=replace(ARM.driven[number].limits, speed_deg_s=limit))
    with pages(operator) as page, page.client:
        chart = CurveChart(replace(ARM, joints=tuple(joints)), "speed", 1)
        curves = most * np.ones((5, 3))
        chart.show(np.arange(5.0), curves, curves)
        return chart.chart.options["series"], chart.chart.options["yAxis"]


def test_limits_are_named_once_for_the_joints_that_have_them(operator: PanelBoard) -> None:
    series, axis = shown(operator, 50.0)
    labels = [
        line["label"]["formatter"] for one in series for line in one.get("markLine", {}).get("data", ())
    ]
    assert labels[::2] == ["limit of joint 1, joint 2", "limit of joint 3"]
    assert axis["max"] >= 99.0
    assert axis["min"] == -axis["max"]


def test_a_limit_that_is_far_off_does_not_flatten_the_curves(operator: PanelBoard) -> None:
    _, axis = shown(operator, 1.0)
    assert axis["max"] is None


def test_planned_curves_have_names_of_their_own(operator: PanelBoard) -> None:
    series, _ = shown(operator, 50.0)
    names = [one["name"] for one in series]
    assert names == [f"joint {n}" for n in (1, 2, 3)] + [f"joint {n}, planned" for n in (1, 2, 3)]
    assert {one["lineStyle"]["type"] for one in series[3:]} == {"dotted"}


def test_a_curve_is_one_text_of_numbers(operator: PanelBoard) -> None:
    """NiceGUI watches each item of a list, and the loop that stops the arm waits for thousands of them."""
    series, _ = shown(operator, 50.0)
    assert json.loads(series[0][":data"]) == [[time, 50.0] for time in range(5)]
