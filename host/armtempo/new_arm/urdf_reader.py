"""A serial chain of revolute joints from a URDF file, read by yourdfpy (the optional extra ``urdf``)."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.atomic_file import os_reason
from armtempo.basics.errors import InputError, MissingPackageError
from armtempo.model.joint_unit import DEG, SLIDE_MM, JointUnit, is_range_doubtful, is_speed_doubtful
from armtempo.model.joint_unit import MM as MM_UNIT
from armtempo.model.parts_file import MAX_ANGLE_DEG
from armtempo.new_arm import urdf_bodies, urdf_transmissions
from armtempo.new_arm.urdf_bodies import Body
from armtempo.new_arm.urdf_transmissions import Coupling

MM = 1000.0
"""Millimetres in the URDF's unit, the metre."""

CONTINUOUS_DEG = (-180.0, 180.0)
"""Range of a continuous joint, which has none in a URDF."""

_SLIDING = "prismatic"
_WHEEL_JOINTS = 2
"""An axle with its steering; a chain with at most this many joints is an arm only if each has limits."""
_REASONS = {
    "floating": "it is free in all directions, and a motor turns about one axis",
    "planar": "it moves in a plane, and a motor turns about one axis",
}
_FAR_M = 10.0
"""Farther from joint to joint than the links of any small arm."""
_MOST = 8
"""Largest number of candidates in a message."""


@dataclass(frozen=True)
class ChainJoint:
    """One revolute or prismatic joint at joint angles 0, in the base link's frame."""

    name: str
    point_mm: Array
    """(3,): a point of its axis, of a sliding joint any."""
    direction: Array
    """(3,): along its axis, of length 1."""
    range_deg: tuple[float, float]
    """Of a sliding joint in mm, as its speed."""
    speed_deg_s: float | None
    continuous: bool
    body: Body | None
    """The body up to the next joint; None without a mass."""
    is_linked: bool = False
    """Whether a linkage turns it by minus the angle of the joint before, so that its link keeps its direction."""
    slides: bool = False
    narrowed_by: str = ""
    """Name of the joint that a linkage turns with this one, and whose limits are narrower."""

    @property
    def unit(self) -> JointUnit:
        """Of its range and speed."""
        return MM_UNIT if self.slides else DEG


@dataclass(frozen=True)
class Chain:
    """The joints from a base link to a tip link."""

    robot: str
    base: str
    tip: str
    joints: tuple[ChainJoint, ...]
    zero_pose: Array
    """(4, 4): the tip link's frame in the base link's, all joints at 0; lengths in mm."""
    model: Any
    """The reader's own robot, for its forward kinematics."""
    couplings: tuple[Coupling, ...] = ()
    """Transmissions that turn two of its joints together."""
    unclear: tuple[str, ...] = ()
    """What is said of other such transmissions, and of lengths and angles that may have another unit."""

    @property
    def doubts(self) -> tuple[str, ...]:
        """Joints whose limits are probably in degrees."""
        turning = [joint for joint in self.joints if not joint.slides]
        ranges = (
            "joint {!r}: its limits, {:.4g} to {:.4g} rad, are {:.5g} to {:.5g} degrees: are they in degrees?".format(
                joint.name, *map(math.radians, joint.range_deg), *joint.range_deg
            )
            for joint in turning
            if is_range_doubtful(joint.range_deg)
        )
        speeds = (
            f"joint {joint.name!r}: its speed, {math.radians(joint.speed_deg_s):.4g} rad/s, is {joint.speed_deg_s:.5g} "
            "degrees/s: is it in degrees/s?"
            for joint in turning
            if joint.speed_deg_s is not None and is_speed_doubtful(joint.speed_deg_s)
        )
        return (*ranges, *speeds)

    @property
    def narrowed(self) -> tuple[str, ...]:
        """What is said of ranges that are narrower than in the file."""
        return tuple(
            f"joint {joint.name!r}: its range is {joint.range_deg[0]:.5g} to {joint.range_deg[1]:.5g} degrees, by the "
            f"limits of {joint.narrowed_by!r}, which it turns"
            for joint in self.joints
            if joint.narrowed_by
        )

    @property
    def linked(self) -> tuple[int, ...]:
        """Indices of the joints that a linkage turns."""
        return tuple(index for index, joint in enumerate(self.joints) if joint.is_linked)

    @property
    def sliding(self) -> tuple[int, ...]:
        """Indices of the joints that slide."""
        return tuple(index for index, joint in enumerate(self.joints) if joint.slides)

    def poses(self, angles_rad: Array) -> Array:
        """The tip's poses by the reader's forward kinematics: (K, 4, 4) in mm for angles (K, joints) in rad, of sliding
        joints as the kinematics have them.

        Those of joints that a linkage turns are 0.
        """
        moving = [(index, joint.name) for index, joint in enumerate(self.joints) if not joint.is_linked]
        poses = np.empty((len(angles_rad), 4, 4))
        values = angles_rad.copy()
        values[:, list(self.sliding)] *= SLIDE_MM / MM
        for number, angles in enumerate(values):
            self.model.update_cfg({name: angles[index] for index, name in moving})  # the others follow
            poses[number] = _transform(self.model, self.tip, self.base)
        return poses


def read(path: Path, base: str | None = None, tip: str | None = None) -> Chain:
    """The chain from link ``base`` (None: the root) to link ``tip`` (None: see ``_tip``).

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
    _refuse(path, joints)
    moving = [joint for joint in joints if joint.type != "fixed"]
    _refuse_wheels(path, moving)
    if not moving:
        raise InputError(
            f"{path}: no joint between {joints[0].parent!r} and {joints[-1].child!r} turns or slides",
            "choose another chain with --base and --tip",
        )
    first, last = joints[0].parent, joints[-1].child
    model.update_cfg({joint.name: 0.0 for joint in moving if joint.mimic is None})
    found = _narrowed(path, moving, map(partial(_joint, model, first), moving, [*moving[1:], None]))
    names = [joint.name for joint in moving if joint.mimic is None and joint.type != _SLIDING]
    couplings, unclear = urdf_transmissions.of_file(path, names)
    zero = _transform(model, last, first)
    doubtful = _doubtful_origins(root, {joint.name for joint in joints})
    return Chain(model.robot.name, first, last, found, zero, model, couplings, (*unclear, *doubtful))


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
    last = tip or _tip(path, model.robot.joints, first)
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


def _refuse(path: Path, joints: list[Any]) -> None:
    """Raise InputError naming every joint that an arm file cannot describe."""
    reasons = [f"\n  joint {joint.name!r}: {reason}" for joint, reason in _reasons(joints) if reason]
    if reasons:
        raise InputError(
            f"{path}: this chain does not fit an arm file:{''.join(reasons)}",
            "choose another chain with --base and --tip, or change the URDF",
        )


def _refuse_wheels(path: Path, moving: list[Any]) -> None:
    """Raise InputError for a chain that is probably a wheel."""
    endless = [joint.name for joint in moving if joint.type == "continuous"]
    if endless and (len(endless) == len(moving) or len(moving) <= _WHEEL_JOINTS):
        raise InputError(
            f"{path}: turning without end, as wheels do: {', '.join(map(repr, endless))}; this chain is not an arm",
            "choose another chain with --base and --tip; a joint of an arm gets limits (type='revolute') in the URDF",
        )


def _reasons(chain: Sequence[Any]) -> Iterator[tuple[Any, str]]:
    """The joints of a chain, and why each does not fit; empty if it does."""
    before = None
    for joint in chain:
        yield joint, _reason(joint, before)
        before = before if joint.type == "fixed" else joint


def _reason(joint: Any, before: Any) -> str:
    """Why a joint does not fit; ``before``: the joint that moves before it in the chain."""
    if joint.type == "fixed":
        return ""
    if joint.type not in ("revolute", "continuous", _SLIDING):
        return _REASONS.get(joint.type, f"its type is {joint.type!r}")
    if joint.axis is not None and not 0.0 < np.linalg.norm(joint.axis) < math.inf:
        return "its axis has no direction"
    if joint.mimic is not None:
        if joint.type == _SLIDING or (before is not None and before.type == _SLIDING):
            return f"it mimics {joint.mimic.joint!r}, and one of them slides; an arm file has no such linkage"
        return _mimic_reason(joint.mimic, before)
    if joint.type == _SLIDING:
        return _stroke_reason(joint.limit)
    return "" if joint.type == "continuous" else _range_reason(joint.limit)


def _mimic_reason(mimic: Any, before: Any) -> str:
    factor = 1.0 if mimic.multiplier is None else mimic.multiplier
    if before is not None and before.name == mimic.joint and before.mimic is None and factor == -1.0:
        return ""  # a parallelogram
    return (
        f"it mimics {mimic.joint!r} by a factor of {factor:g}; an arm file has only linkages that turn a joint by "
        "minus the angle of the one before it, which moves by itself"
    )


def _range_reason(limit: Any) -> str:
    if limit is None or limit.lower is None or limit.upper is None:
        return "it has no limits; add <limit lower= upper=> with the angles in rad that it may turn to"
    if not limit.lower < limit.upper:
        return f"its limits {limit.lower:g} to {limit.upper:g} rad are no range; correct them"
    if max(abs(limit.lower), abs(limit.upper)) > math.radians(MAX_ANGLE_DEG):
        return f"its limits {limit.lower:g} to {limit.upper:g} rad are more than {MAX_ANGLE_DEG:g} degrees"
    return ""


def _stroke_reason(limit: Any) -> str:
    """Why the limits of a sliding joint are no range."""
    if limit is None or limit.lower is None or limit.upper is None:
        return "it has no limits; add <limit lower= upper=> with the positions in m that it may slide to"
    if not limit.lower < limit.upper:
        return f"its limits {limit.lower:g} to {limit.upper:g} m are no range; correct them"
    if MM * max(abs(limit.lower), abs(limit.upper)) > MAX_ANGLE_DEG:
        return f"its limits {limit.lower:g} to {limit.upper:g} m are more than {MAX_ANGLE_DEG / MM:g} m"
    return ""


def _joint(model: Any, base: str, joint: Any, after: Any) -> ChainJoint:
    frame = _transform(model, joint.child, base)
    axis = np.array([1.0, 0.0, 0.0]) if joint.axis is None else np.asarray(joint.axis, dtype=np.float64)
    limit, continuous, slides = joint.limit, joint.type == "continuous", joint.type == _SLIDING
    if joint.mimic is not None:
        low_high = (0.0, 0.0)
    elif slides:
        low_high = (MM * limit.lower, MM * limit.upper)
    else:
        low_high = CONTINUOUS_DEG if continuous else (math.degrees(limit.lower), math.degrees(limit.upper))
    speed = None
    if limit is not None and limit.velocity:
        speed = MM * limit.velocity if slides else math.degrees(limit.velocity)
    direction = frame[:3, :3] @ (axis / np.linalg.norm(axis))
    body = urdf_bodies.of_joint(model, base, joint, after)
    is_linked = joint.mimic is not None
    return ChainJoint(
        joint.name, frame[:3, 3], direction, low_high, speed, continuous, body, is_linked, slides
    )


def _narrowed(path: Path, moving: Sequence[Any], found: Iterable[ChainJoint]) -> tuple[ChainJoint, ...]:
    """The joints, those that turn others by a linkage within the limits of these too."""
    joints = list(found)
    for number, joint in enumerate(moving):
        limit = joint.limit
        if joint.mimic is None or joint.type == "continuous" or limit is None:
            continue
        if limit.lower is None or limit.upper is None:
            continue
        offset, before = joint.mimic.offset or 0.0, joints[number - 1]
        low, high = (math.degrees(offset - end) for end in (limit.upper, limit.lower))
        kept = max(low, before.range_deg[0]), min(high, before.range_deg[1])
        if not kept[0] < kept[1]:
            raise InputError(
                f"{path}: the limits of {joint.name!r}, which mimics {before.name!r}, leave that no range",
                f"correct the limits of one of them; {joint.name!r} may do without",
            )
        if kept != before.range_deg:
            joints[number - 1] = replace(before, range_deg=kept, continuous=False, narrowed_by=joint.name)
    return tuple(joints)


def _transform(model: Any, link: str, base: str) -> Array:
    """The frame of ``link`` in that of ``base``, in mm."""
    pose: Array = np.array(model.get_transform(link, base), dtype=np.float64)
    pose[:3, 3] *= MM
    return pose


class _Candidate(NamedTuple):
    """A possible tool link."""

    link: str
    turning: tuple[str, ...]
    """The revolute joints before it."""
    joints: int
    """Number of joints before it."""


def _tip(path: Path, joints: Sequence[Any], first: str) -> str:
    """The parent link of the fingers, or the only leaf below ``first``.

    Raises InputError if the tool is ambiguous, with the candidates and the revolute joints before them, best first.
    """
    below = [*_below(joints, first)]
    fingers = _fingers(joints)
    flanges = {
        chain[-1].parent
        for chain in below
        if [joint.name for joint in chain if joint.name in fingers] == [chain[-1].name]
    }
    candidates = [*_candidates(below)]
    if len(flanges) == 1 and flanges & {candidate.link for candidate in candidates}:
        return str(flanges.pop())
    parents = {joint.parent for joint in joints}
    ends = [chain[-1].child for chain in below if chain[-1].child not in parents]
    if len(ends) == 1:
        return str(ends[0])
    candidates.sort(key=lambda candidate: (-len(candidate.turning), candidate.joints))
    words = [f"{candidate.link} ({', '.join(candidate.turning)})" for candidate in candidates[:_MOST]]
    more = f", and {len(candidates) - _MOST} more" if len(candidates) > _MOST else ""
    raise InputError(
        f"{path}: which link of the robot is the tool is not clear",
        f"choose with --tip, the joints that turn on its chain in brackets: {', '.join(words) or 'none'}{more}",
    )


def _below(joints: Sequence[Any], first: str) -> Iterator[list[Any]]:
    """The chain to each link below ``first``, in the order of the file."""
    above = {joint.child: joint for joint in joints}
    for joint in joints:
        chain = [joint]
        while chain[0].parent != first and chain[0].parent in above and len(chain) <= len(above):
            chain.insert(0, above[chain[0].parent])
        if chain[0].parent == first:
            yield chain


def _fingers(joints: Sequence[Any]) -> set[str]:
    """Names of the joints of grippers: side by side, they slide, or one mimics the other.

    A joint that mimics one of its own chain, as a linkage does, and one that slides alone are parts of the arm.
    """
    above = {joint.child: joint for joint in joints}
    before_of = {joint.name: {each.name for each in _before(joint, above)} for joint in joints}
    slides = [joint.name for joint in joints if joint.type == "prismatic"]
    found = set()
    for joint in joints:
        before = before_of[joint.name]
        master = None if joint.mimic is None else joint.mimic.joint
        if master is not None and master not in before and joint.name not in before_of[master]:
            found |= {joint.name, master}
        if joint.name in slides:
            after = {name for name, above_it in before_of.items() if joint.name in above_it}
            if set(slides) - before - after - {joint.name}:
                found.add(joint.name)
    return found


def _before(joint: Any, above: Mapping[str, Any]) -> list[Any]:
    """The joints from the root to this one, without it."""
    found: list[Any] = []
    while joint.parent in above and len(found) <= len(above):
        joint = above[joint.parent]
        found.append(joint)
    return found


def _candidates(chains: Sequence[list[Any]]) -> Iterator[_Candidate]:
    """Links on whose chain something turns, and nothing is there that an arm file cannot describe."""
    for chain in chains:
        turning = tuple(joint.name for joint in chain if joint.type != "fixed")
        if turning and not any(reason for _, reason in _reasons(chain)):
            yield _Candidate(chain[-1].child, turning, len(chain))
