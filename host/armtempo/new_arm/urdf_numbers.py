"""The numbers of a URDF's joints and bodies, looked at before the reader, whose errors name no place."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from armtempo.basics.errors import InputError
from armtempo.basics.text import is_number

_OF_JOINTS = {
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "limit": {"lower": 1, "upper": 1, "velocity": 1, "effort": 1},
    "mimic": {"multiplier": 1, "offset": 1},
    "safety_controller": {"soft_lower_limit": 1, "soft_upper_limit": 1},
}
"""How many numbers are in the attributes of a joint's elements."""
_OF_LINKS = {
    "inertial/origin": {"xyz": 3, "rpy": 3},
    "inertial/mass": {"value": 1},
    "inertial/inertia": dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 1),
}
_MAY_BE_ENDLESS = ("velocity", "effort", "lower", "upper")
"""Infinite limits are no range, which is said later, or no limit."""


def check(path: Path, root: ElementTree.Element) -> None:
    """Raise InputError, naming the first, for attributes that are not the numbers which a URDF has there."""
    for kind, elements in (("joint", _OF_JOINTS), ("link", _OF_LINKS)):
        for part in root.findall(kind):
            for place, attributes in elements.items():
                for element in part.findall(place):
                    for key, count, value in _given(element, attributes):
                        if problem := _problem(key, count, value):
                            where = f"{path}: {kind} {part.get('name')!r}: <{element.tag}> {key}={value!r}"
                            raise InputError(f"{where} {problem}", "correct it there")


def _given(element: ElementTree.Element, attributes: dict[str, int]) -> Iterator[tuple[str, int, str]]:
    for key, count in attributes.items():
        if (value := element.get(key)) is not None:
            yield key, count, value


def _problem(key: str, count: int, value: str) -> str:
    """Why a value is not what it should be; empty if it is."""
    words = value.split()
    if len(words) != count or not all(map(is_number, words)):
        return "is not a number" if count == 1 else f"is not {count} numbers, with blanks between them"
    numbers = [float(word) for word in words]
    if not all(
        math.isfinite(number) or (key in _MAY_BE_ENDLESS and math.isinf(number)) for number in numbers
    ):
        return "is not finite"
    return "is below 0" if key == "velocity" and numbers[0] < 0.0 else ""
