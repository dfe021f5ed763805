"""Transmissions of a URDF that couple two joints, as rows of an arm file's table [coupling].

The classes of ROS (``transmission_interface``), with motor turns m, joint angles j, reductions n of the joints and a
of the actuators: a differential has m1 = a1 (n1 j1 + n2 j2) and m2 = a2 (n1 j1 - n2 j2); a four-bar linkage, or a belt
that the first joint carries along, has m1 = a1 n1 j1 and m2 = a2 (j1 + n2 j2). Reductions of actuators are gear ratios.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

_DIFFERENTIAL, _FOUR_BAR = "DifferentialTransmission", "FourBarLinkageTransmission"
_SIMPLE = "SimpleTransmission"


@dataclass(frozen=True)
class Coupling:
    """A transmission between two motors and two joints of a chain."""

    name: str
    joints: tuple[str, str]
    rows: tuple[tuple[float, float], tuple[float, float]]
    """Of the motors, by the angles of the two joints."""
    gear_ratios: tuple[float, float]
    """Of the motors; negative: it turns the other way."""


def of_file(path: Path, names: Sequence[str]) -> tuple[tuple[Coupling, ...], tuple[str, ...]]:
    """The couplings of joints of these names in a URDF, and what is said of transmissions that cannot be used."""
    found, doubts = [], []
    for element in ElementTree.parse(path).iter("transmission"):
        kind = _kind(element)
        joints = [joint.get("name", "") for joint in _in_order(element, "joint")]
        if kind == _SIMPLE or len(set(joints)) < 2 or not set(joints) & set(names):
            continue
        name = element.get("name", "")
        coupling = _coupling(element, name, kind, joints) if set(joints) <= set(names) else None
        if coupling is None:
            doubts.append(
                f"transmission {name!r} couples {' and '.join(map(repr, joints))} in a way that an arm file of this "
                "chain cannot say: write [coupling] by hand"
            )
        else:
            found.append(coupling)
    return tuple(found), tuple(doubts)


def _kind(element: ElementTree.Element) -> str:
    """The class, in the forms of ROS 1 and 2, without its package."""
    text = element.get("type") or element.findtext("type") or element.findtext("plugin") or ""
    return text.strip().rpartition("/")[2]


def _in_order(element: ElementTree.Element, what: str) -> list[ElementTree.Element]:
    """The joints or actuators, by their roles where they have them."""
    return sorted(element.findall(what), key=lambda one: one.get("role") or one.findtext("role") or "")


def _coupling(element: ElementTree.Element, name: str, kind: str, joints: list[str]) -> Coupling | None:
    """None for another class, or one that has not two joints and two actuators, or a reduction that is none."""
    if kind not in (_DIFFERENTIAL, _FOUR_BAR):
        return None
    try:
        first, second = map(_reduction, _in_order(element, "joint"))
        motor, other = map(_reduction, _in_order(element, "actuator"))
    except ValueError:
        return None
    if not all(0.0 < abs(ratio) < math.inf for ratio in (first, second, motor, other)):
        return None
    rows = ((first, second), (first, -second)) if kind == _DIFFERENTIAL else ((first, 0.0), (1.0, second))
    return Coupling(name, (joints[0], joints[1]), rows, (motor, other))


def _reduction(one: ElementTree.Element) -> float:
    text = one.findtext("mechanicalReduction") or one.findtext("mechanical_reduction") or "1"
    return float(text)
