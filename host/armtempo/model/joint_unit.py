"""The unit of a joint: a turning joint is at an angle in degrees, a sliding one at a position in mm.

The program's names say ``_deg`` of every joint's position, speed and limits; of a sliding joint these are in mm, mm/s
and so on. Whatever a user reads or writes asks the joint's unit instead. The kinematics calculate in radians: of a
sliding joint that is the same conversion of its mm, so that 180/pi mm are one "radian" (``SLIDE_MM``).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

REVOLUTE, PRISMATIC = "revolute", "prismatic"
TYPES = (REVOLUTE, PRISMATIC)
SLIDE_MM = math.degrees(1.0)
"""How far a sliding joint moves for a "radian" of the kinematics."""
_KEYS = {
    "friction_nm": "friction_n",
    "viscous_nm_s": "viscous_n_s_m",
    "gravity_torque_nm": "gravity_force_n",
    "inertia_kg_m2": "moved_kg",
}
"""Keys of an arm file that are not alike but for their unit."""


_TURNS_DEG = 720.0
"""No joint of a small arm turns further, as its cables would not."""
_TURN_RAD, _NEAR_RAD = math.tau, 0.002
_FAST_RAD_S = 20.0
"""No joint of an arm turns faster."""


def is_range_doubtful(range_deg: tuple[float, float]) -> bool:
    """Whether the angles were probably degrees that were taken for radians, and converted.

    They are more than two turns, or whole numbers of radians, as nobody writes them, of more than a turn.
    """
    most = max(map(abs, range_deg))
    whole = all(abs(end - round(end)) < _NEAR_RAD for end in map(math.radians, range_deg))
    return most > _TURNS_DEG or (whole and math.radians(most) > _TURN_RAD)


def is_speed_doubtful(speed_deg_s: float) -> bool:
    """Whether a speed was probably in degrees/s, taken for rad/s and converted."""
    return math.radians(speed_deg_s) > _FAST_RAD_S


@dataclass(frozen=True)
class JointUnit:
    """A unit of joints."""

    name: str
    """In tables and keys, and before "/s"."""
    word: str
    """In sentences, after a number and a space."""
    sign: str
    """Right after a number."""
    what: str
    """What a position of a joint is called."""

    def key(self, name: str) -> str:
        """The key of an arm file for a field of a joint or of a part of it, which is named for turning joints."""
        if self is DEG:
            return name
        return _KEYS.get(name, name.replace("_deg", "_mm"))

    def labelled(self, name: str) -> str:
        """A joint's name where a table mixes units: with its unit if that is not degrees."""
        return name if self is DEG else f"{name} ({self.name})"

    def text(self, value: float, digits: int) -> str:
        """A value with ``digits`` decimals, and never -0."""
        return f"{round(value, digits) + 0.0:.{digits}f}{self.sign}"


DEG = JointUnit("deg", "degrees", "°", "angle")
MM = JointUnit("mm", "mm", " mm", "position")


def of_type(kind: str) -> JointUnit:
    """The unit of joints of a type of TYPES."""
    return MM if kind == PRISMATIC else DEG


def names(units: Iterable[JointUnit]) -> str:
    """Their names, each once, for the head of a table."""
    return " or ".join(dict.fromkeys(unit.name for unit in units))


def heads(texts: Mapping[str, str], units: Iterable[JointUnit]) -> dict[str, str]:
    """Heads of a table with their meanings: for joints of other units than degrees with these instead of "°"."""
    signs = " or ".join(dict.fromkeys(unit.sign.strip() for unit in units)) or DEG.sign
    return {head.replace(DEG.sign, signs): text for head, text in texts.items()}


NEUTRAL = {
    "angles_deg": "joints",
    "via_deg": "via_joints",
    "posture_deg": "posture_joints",
    "start_deg": "start_joints",
    "end_deg": "end_joints",
    "commanded_deg": "commanded_joints",
    "angle_deg": "measured_joints",
}
"""Keys of lists of joint positions in files and results, and those that say nothing of the unit: each position is in
its joint's. An arm with a sliding joint has only the latter."""


@dataclass(frozen=True)
class PositionTexts:
    """How positions of an arm's driven joints are called and written."""

    names: tuple[str, ...]
    of_joints: tuple[JointUnit, ...]
    """Their units, (J,)."""
    sliding: tuple[str, ...]
    """Names of the arm's sliding joints, with which lists of positions are not all in degrees."""

    @property
    def units(self) -> str:
        """The units for the head of a table: "deg", "mm", or "deg or mm"."""
        return names(self.of_joints)

    @property
    def unit_words(self) -> str:
        """The same in words: "degrees", "mm", or "degrees or mm"."""
        return " or ".join(dict.fromkeys(unit.word for unit in self.of_joints))

    @property
    def position(self) -> str:
        """What a position of any of the joints is called: "angle", or "position" if a joint slides."""
        return (MM if self.sliding else DEG).what

    @property
    def with_units(self) -> str:
        """What a list of positions holds, in words."""
        return ", ".join(
            f"{name} in {unit.name}" for name, unit in zip(self.names, self.of_joints, strict=True)
        )

    def list_key(self, name: str) -> str:
        """The key of a list of positions in files and results, by its name for arms whose joints all turn."""
        return NEUTRAL[name] if self.sliding else name

    def listed(self, values: Iterable[str], gap: str = ", ") -> str:
        """Positions (J,) as texts in one: with one sign for all if they are angles, else each with its own."""
        given, signs = list(values), [unit.sign for unit in self.of_joints]
        if len({*signs}) <= 1:
            return gap.join(given) + (signs[0] if signs else "")
        return gap.join(value + sign for value, sign in zip(given, signs, strict=True))
