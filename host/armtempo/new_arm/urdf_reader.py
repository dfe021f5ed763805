"""A serial chain of revolute and prismatic joints from a URDF file, read by yourdfpy (the optional extra ``urdf``)."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from armtempo.basics.atomic_file import os_reason
from armtempo.basics.errors import InputError, MissingPackageError
from armtempo.basics.text import is_number
from armtempo.new_arm import urdf_bodies, urdf_refusals, urdf_tip, urdf_transmissions
from armtempo.new_arm.urdf_chain import MM, Chain, ChainJoint, transform
from armtempo.new_arm.urdf_refusals import SLIDING

CONTINUOUS_DEG = (-180.0, 180.0)
"""Range of a continuous joint, which has none in a URDF."""

_FAR_M = 10.0
"""Farther from joint to joint than the links of any small arm."""


def read(path: Path, base: str | None = None, tip: str | None = None) -> Chain:
    """The chain from link ``base`` (None: the root) to link ``tip`` (None: see ``urdf_tip``).

    Raises MissingPackageError without yourdfpy, InputError if the file is not a URDF, there is no such chain,
    or an arm file cannot describe one of its joints (with all reasons).
    """
    urdf = _reader()
    root = _checked(path)
    try:
        with np.errstate(all="ignore"):  # it divides by the length of an axis that has none
            model = urdf.load(str(path), load_meshes=False, build_scene_graph=True)
    except Exception as error:  # the reader raises various errors: KeyError, ValueError, AttributeError
        raise InputError(
            f"{path}: is XML, but not a URDF that can be read ({type(error).__name__}: {error})",
            "try it with another URDF tool, such as check_urdf, which names the place",
        ) from None
    if not model.robot.joints:
        raise InputError(f"{path}: this robot has no joints, so there is no chain", "give another file")
    joints = _path(path, model, base, tip)
    urdf_refusals.check(path, joints)
    moving = [joint for joint in joints if joint.type != "fixed"]
    urdf_refusals.check_wheels(path, moving)
    if not moving:
        raise InputError(
            f"{path}: no joint between {joints[0].parent!r} and {joints[-1].child!r} turns or slides",
            "choose another chain with --base and --tip",
        )
    first, last = joints[0].parent, joints[-1].child
    model.update_cfg({joint.name: 0.0 for joint in moving if joint.mimic is None})
    found = _narrowed(path, moving, map(partial(_joint, model, first), moving, [*moving[1:], None]))
    names = [joint.name for joint in moving if joint.mimic is None and joint.type != SLIDING]
    couplings, unclear = urdf_transmissions.of_file(path, names)
    zero = transform(model, last, first)
    doubtful = _doubtful_origins(root, {joint.name for joint in joints})
    unread = [text for text in map(unread_numbers, moving) if text]
    unclear = (*unclear, *doubtful, *unread)
    return Chain(model.robot.name, first, last, found, zero, model, couplings, unclear)


def _reader() -> Any:
    try:
        from yourdfpy import URDF
    except ImportError:
        raise MissingPackageError("reading URDF", "yourdfpy", "urdf") from None
    return URDF


def _checked(path: Path) -> ElementTree.Element:
    """The file's outermost element; InputError unless it is a robot in valid XML, as the reader repairs errors."""
    try:
        root = ElementTree.fromstring(path.read_bytes())
    except FileNotFoundError:
        raise InputError(f"{path}: no such file", "check the path") from None
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read: {os_reason(error)}", "make it readable, or give a copy"
        ) from None
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(f"{path}: not valid XML: {error}", "correct the file there") from None
    if root.tag != "robot":
        raise InputError(f"{path}: its outermost element is <{root.tag}>, not <robot>", "give a URDF file")
    if root.get("name") is None:
        raise InputError(f"{path}: its <robot> element has no name", 'give it one: <robot name="my_arm">')
    values = [value for element in root.iter() for value in element.attrib.values()]
    for kind in ("link", "joint"):
        twice = [
            name
            for name, count in Counter(each.get("name") for each in root.findall(kind)).items()
            if count > 1
        ]
        if twice:
            raise InputError(f"{path}: two {kind}s are called {twice[0]!r}", "give each a name of its own")
    joints = {joint.get("name"): joint.find("mimic") for joint in root.findall("joint")}
    for name, mimic in joints.items():
        master = None if mimic is None else mimic.get("joint")
        if mimic is not None and (master == name or master not in joints):
            what = "itself" if master == name else f"{master!r}, which this robot does not have"
            raise InputError(f"{path}: joint {name!r} mimics {what}", "correct its <mimic>, or take it out")
    unfilled = next((value for value in values if "$(" in value or "${" in value), "")
    if unfilled or any("xacro" in element.tag for element in root.iter()):
        left = f", with {unfilled!r} still to be filled in" if unfilled else ""
        raise InputError(
            f"{path}: is a xacro file{left}",
            f"make a URDF of it first: xacro {path} > robot.urdf (xacro is a part of ROS)",
        )
    check(path, root)
    return root


def _doubtful_origins(root: ElementTree.Element, names: set[str]) -> list[str]:
    """What is said of these joints' places, which were probably in mm, and directions, in degrees."""
    doubts = []
    for joint in root.findall("joint"):
        name, origin = joint.get("name"), joint.find("origin")
        if origin is None or name not in names:
            continue
        xyz, rpy = (origin.get(key, "") for key in ("xyz", "rpy"))
        if max((abs(float(value)) for value in xyz.split()), default=0.0) > _FAR_M:
            doubts.append(f"joint {name!r}: its xyz, {xyz}: is it in mm? A URDF has metres; correct it there")
        if max((abs(float(value)) for value in rpy.split()), default=0.0) > math.tau:
            doubts.append(
                f"joint {name!r}: its rpy, {rpy}: is it in degrees? A URDF has radians; correct it there"
            )
    return doubts


def _path(path: Path, model: Any, base: str | None, tip: str | None) -> list[Any]:
    """The joints from base to tip, base first."""
    links = [link.name for link in model.robot.links]
    for option, link in (("--base", base), ("--tip", tip)):
        if link is not None and link not in links:
            raise InputError(
                f"{path}: has no link {link!r} for {option}", f"give one of its links: {', '.join(links)}"
            )
    above = {joint.child: joint for joint in model.robot.joints}
    first = base or model.base_link
    last = tip or urdf_tip.find(path, model.robot.joints, first)
    joints: list[Any] = []
    link = last
    while link != first:
        if link not in above or len(joints) > len(above):
            raise InputError(
                f"{path}: no chain leads from link {first!r} to {last!r}", "choose --base and --tip"
            )
        joints.insert(0, above[link])
        link = above[link].parent
    if not joints:
        raise InputError(f"{path}: base and tip are the same link, {first!r}", "choose --base and --tip")
    return joints


def _joint(model: Any, base: str, joint: Any, after: Any) -> ChainJoint:
    frame = transform(model, joint.child, base)
    axis = np.array([1.0, 0.0, 0.0]) if joint.axis is None else np.asarray(joint.axis, dtype=np.float64)
    limit, continuous, slides = joint.limit, joint.type == "continuous", joint.type == SLIDING
    low_high, narrowed_by = CONTINUOUS_DEG, ""
    if joint.mimic is not None:
        low_high = (0.0, 0.0)
    elif (ends := range_ends(joint)) is not None:
        low_high = (
            (MM * ends.low, MM * ends.high) if slides else (math.degrees(ends.low), math.degrees(ends.high))
        )
        narrowed_by = SOFT if ends.are_soft else ""
        continuous = False
    speed = None
    if limit is not None and limit.velocity:
        speed = MM * limit.velocity if slides else math.degrees(limit.velocity)
    direction = frame[:3, :3] @ (axis / np.linalg.norm(axis))
    body = urdf_bodies.of_joint(model, base, joint, after)
    is_linked = joint.mimic is not None
    return ChainJoint(
        joint.name, frame[:3, 3], direction, low_high, speed, continuous, body, is_linked, slides, narrowed_by
    )


def _narrowed(path: Path, moving: Sequence[Any], found: Iterable[ChainJoint]) -> tuple[ChainJoint, ...]:
    """The joints, those that turn others by a linkage within the limits of these too."""
    joints = list(found)
    for number, joint in enumerate(moving):
        ends = range_ends(joint) if joint.mimic is not None else None
        if ends is None:
            continue
        offset, before = joint.mimic.offset or 0.0, joints[number - 1]
        low, high = (math.degrees(offset - end) for end in (ends.high, ends.low))
        kept = max(low, before.range_deg[0]), min(high, before.range_deg[1])
        if not kept[0] < kept[1]:
            raise InputError(
                f"{path}: the limits of {joint.name!r}, which mimics {before.name!r}, leave that no range",
                f"correct the limits of one of them; {joint.name!r} may do without",
            )
        if kept != before.range_deg:
            by = f"the limits of {joint.name!r}, which its linkage turns"
            joints[number - 1] = replace(before, range_deg=kept, continuous=False, narrowed_by=by)
    return tuple(joints)


# ends of the range
SOFT = "the soft limits of its safety_controller"


class Ends(NamedTuple):
    """In the URDF's unit, rad or m."""

    low: float
    high: float
    are_soft: bool
    """Whether one of them is a soft limit."""


def range_ends(joint: Any) -> Ends | None:
    """The ends of a joint's range; None without limits, as of a continuous joint."""
    hard, soft = joint.limit, _soft(joint)
    known = joint.type != "continuous" and hard is not None and None not in (hard.lower, hard.upper)
    if soft is None or not soft[0] < soft[1]:
        return Ends(hard.lower, hard.upper, False) if known else None
    if not known:
        return Ends(*soft, True)
    low, high = max(hard.lower, soft[0]), min(hard.upper, soft[1])
    if not low < high:
        return Ends(hard.lower, hard.upper, False)
    return Ends(low, high, (low, high) != (hard.lower, hard.upper))


def unread_numbers(joint: Any) -> str:
    """What is said of soft limits that leave no range; "" if there is nothing."""
    soft, found = _soft(joint), range_ends(joint)
    if soft is None or joint.mimic is not None:
        return ""
    if soft[0] < soft[1] and (found is None or max(found.low, soft[0]) < min(found.high, soft[1])):
        return ""
    return (
        f"joint {joint.name!r}: the soft limits of its safety_controller, {soft[0]:g} to {soft[1]:g}, leave it no "
        "range and are not used; correct them"
    )


def _soft(joint: Any) -> tuple[float, float] | None:
    """The soft limits; None if they are not given, 0 being what is left out."""
    controller = joint.safety_controller
    low, high = (getattr(controller, key, None) or 0.0 for key in ("soft_lower_limit", "soft_upper_limit"))
    return (low, high) if low or high else None


# numbers, looked at before
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
