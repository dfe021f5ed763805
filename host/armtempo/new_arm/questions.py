"""The questions of ``armtempo new``, with explanations, examples, and checks of the answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

from armtempo_shared.limits import MAX_ENCODERS, MAX_JOINTS, MAX_STEP_RATE

from armtempo.basics.text import visible
from armtempo.model import joint_unit, shipped
from armtempo.model.joint_unit import PRISMATIC, REVOLUTE
from armtempo.model.parts_file import MAX_ANGLE_DEG, MAX_LENGTH_MM
from armtempo.model.workspace import FAR_MM
from armtempo.new_arm.joint_entry import INTEGERS, JointEntry

STANDARD, MODIFIED = "standard", "modified"
TURNS, SLIDES = "turns", "slides"
NO = "none"
FLOOR, WALLS = "floor_mm", ("x_mm", "y_mm")
"""Keys of the workspace in an arm file."""
CONVENTIONS = """\
    standard (Denavit-Hartenberg)           modified (Craig)

    axis i           axis i+1               axis i-1         axis i
      |                |                      |                |
      |     link i     |                      |    link i-1    |
      o================o--> x i               o================o--> x i
      ^                ^                      ^                ^
    d, theta: here   frame i                a, alpha: here   frame i
                     a, alpha: here                          d, theta: here

    row i: turn theta, go d along axis i;   row i: go a, turn alpha from axis i-1;
           go a, turn alpha to axis i+1            turn theta, go d along axis i
"""
"""The frames of a row in both conventions, and the axes of its four parameters."""

Answers = dict[str, str]
"""Answers by the question's key, in the order of the questions."""
Reader = Callable[[str], object]


class WrongAnswerError(ValueError):
    """What is wrong with an answer, and an example of a right one."""


@dataclass(frozen=True)
class Question:
    """One question; ``read`` returns the answer's value or raises WrongAnswerError."""

    key: str
    text: str
    default: str
    explanation: str
    read: Reader


def following(answers: Mapping[str, str]) -> Question | None:
    """The next question after these answers; None if all are answered."""
    for question in _all(answers):
        if question.key not in answers:
            return question
    return None


def joints(answers: Mapping[str, str]) -> list[JointEntry]:
    """The described joints, base first."""
    found = []
    for number in range(1, int(answers["count"]) + 1):
        of_joint = {
            key.removeprefix(f"{number}."): text
            for key, text in answers.items()
            if key.startswith(f"{number}.")
        }
        name = of_joint.pop("name")
        has_linkage = of_joint.pop("parallel_linkage", "") in _YES
        kind = PRISMATIC if of_joint.pop("type", TURNS) == SLIDES else REVOLUTE
        values = {key: int(text) if key in INTEGERS else float(text) for key, text in of_joint.items()}
        found.append(JointEntry(name, **values, parallel_linkage=has_linkage, type=kind))  # type: ignore[arg-type]
    return found


def _all(answers: Mapping[str, str]) -> list[Question]:
    """The questions as far as the answers determine them."""
    ships = [*shipped.files(), "own"]
    found = [
        Question(
            *("arm", f"which arm ({', '.join(ships)})", "own"),
            "An arm that ships is a beginning, to be changed to your motors and wiring; 'own' asks for each joint.",
            _one_of(ships),
        )
    ]
    if answers.get("arm") == "own":
        found += _own(answers)
    if answers.get("arm") != "own" or ("count" in answers and f"{answers['count']}.speed_deg_s" in answers):
        found += _workspace()
        found.append(
            Question(
                *("port", "port of the board", "sim:board"),
                "'armtempo ports' lists the boards that are connected; sim:board is a virtual one, whose flash is the "
                "folder 'board'.",
                _text,
            )
        )
    return found


def workspace(answers: Mapping[str, str]) -> dict[str, list[float]]:
    """Height of the floor, and the walls, [low, high], by key of the arm file; only those that there are."""
    given = {key: _numbers(1 if key == FLOOR else 2)(answers.get(key, NO)) for key in (FLOOR, *WALLS)}
    return {key: found for key, found in given.items() if found}


def _workspace() -> list[Question]:
    return [
        Question(
            *(FLOOR, f"height of the table or floor, z in mm ({NO}: there is none)", NO),
            "In the frame of the base, whose first joint is at z = 0. Nothing moves the arm below it, by hand neither; "
            "later it is floor_mm of [workspace] in the arm file.",
            _numbers(1),
        ),
        *(
            Question(
                *(key, f"walls, {key[0]} in mm, as in -300 400 ({NO}: there are none)", NO),
                f"Two numbers, the smaller first: the arm stays between them. Later they are {key} of [workspace].",
                _numbers(2),
            )
            for key in WALLS
        ),
    ]


def _numbers(count: int) -> Callable[[str], list[float]]:
    """Reads so many numbers, ascending, or none."""
    example = "0" if count == 1 else "-300 400"

    def read(text: str) -> list[float]:
        if text == NO:
            return []
        try:
            found = [float(one) for one in text.replace(",", " ").split()]
        except ValueError:
            found = []
        fits = len(found) == count and all(abs(one) < FAR_MM for one in found)
        if not fits or any(low >= high for low, high in pairwise(found)):
            what = "a number" if count == 1 else "two numbers, the smaller first"
            raise WrongAnswerError(f"{visible(text)!r}: not {what}; e.g. {example}, or {NO}")
        return found

    return read


def _own(answers: Mapping[str, str]) -> list[Question]:
    found = [
        Question(
            *("count", "how many joints", "3"),
            f"Those that a motor moves, 1 to {MAX_JOINTS}; a gripper is an output, not a joint.",
            _whole(1, MAX_JOINTS),
        ),
        Question(
            *("convention", f"convention of the rows ({STANDARD}, {MODIFIED})", STANDARD),
            f"How the table that you have was written:\n\n{CONVENTIONS}",
            _one_of([STANDARD, MODIFIED]),
        ),
    ]
    if "count" in answers and "convention" in answers:
        for number in range(1, int(answers["count"]) + 1):
            found += _joint(number, answers)
            if f"{number}.speed_deg_s" not in answers:
                break
    return found


def _joint(number: int, answers: Mapping[str, str]) -> list[Question]:
    joint = _Joint(number, answers)
    return [*joint.row(), *joint.linkage(), *joint.travel(), *joint.drive(), *joint.encoder(), *joint.speed()]


class _Joint:
    """The questions about one joint, in their order."""

    def __init__(self, number: int, answers: Mapping[str, str]) -> None:
        self._number = number
        self._answers = answers
        self._name = f"joint {number} of {answers['count']}"
        self._slides = self._is_sliding(number)
        self._unit = joint_unit.of_type(PRISMATIC if self._slides else REVOLUTE)
        self._shaft = "its screw or pulley" if self._slides else "the joint"

    def _is_sliding(self, number: int) -> bool:
        return self._answers.get(f"{number}.type") == SLIDES

    def row(self) -> list[Question]:
        names = [self._answers[f"{other}.name"] for other in range(1, self._number)]
        modified = self._answers["convention"] == MODIFIED
        link = "the axis before to this one" if modified else "this axis to the next one"
        length = _number(-MAX_LENGTH_MM, MAX_LENGTH_MM, "120.5")
        offset = "theta, degrees" if self._slides else "theta where the joint is at 0, degrees"
        added = "The fixed angle about its axis." if self._slides else "Added to the joint's angle."
        d = "d where the joint is at 0, mm" if self._slides else "d, mm"
        return [
            self._ask("name", "name", "Any words; reports and messages use them.", _new_name(names)),
            self._ask(
                *("type", f"how it moves ({TURNS}, {SLIDES})"),
                "About its axis, or along it, as on a rail or a spindle.",
                _one_of([TURNS, SLIDES]),
                TURNS,
            ),
            self._ask("d_mm", d, "Along this joint's axis, from one common normal to the next.", length),
            self._ask("a_mm", "a, mm", f"Length of the common normal from {link}.", length),
            self._ask(
                *("alpha_deg", "alpha, degrees", f"Turn about the common normal from {link}."),
                _number(-180, 180, "-90"),
            ),
            self._ask("theta_offset_deg", offset, added, _number(-360, 360, "-90")),
        ]

    def linkage(self) -> list[Question]:
        if self._number == 1 or self._slides or self._is_sliding(self._number - 1):
            return []
        text = "does a parallelogram turn it, with the motor one link further down (yes, no)"
        explanation = (
            "A parallel linkage, as of palletisers and the EEZYbotARM: the joint's angle is then counted from the link "
            "before the previous one, and stays when the previous joint turns."
        )
        return [self._ask("parallel_linkage", text, explanation, _one_of([*_YES, *_NO]), "no")]

    def travel(self) -> list[Question]:
        least = 0.0 if self._slides else -90.0
        low = float(self._answers.get(f"{self._number}.low_deg", least))
        what, unit = self._unit.what, self._unit.word
        return [
            self._ask(
                *("low_deg", f"lowest {what}, {unit}", "The lower end of the joint's range."),
                _number(-MAX_ANGLE_DEG, MAX_ANGLE_DEG, "-90"),
                str(least),
            ),
            self._ask(
                *("high_deg", f"highest {what}, {unit}", "The upper end of its range."),
                _above(low, what),
                str(max(90.0, low + 90.0)),
            ),
        ]

    def drive(self) -> list[Question]:
        steps, gear = "full steps for a turn of the motor", f"motor turns for a turn of {self._shaft}"
        travel = self._ask(
            *("mm_per_rev", "travel for a turn of its screw or pulley, mm"),
            "The lead of the screw, or the pulley's number of teeth times the pitch of its belt.",
            _number(0.01, 10_000, "8"),
        )
        return [
            self._ask("steps_per_rev", steps, "200 for 1.8 degrees a step.", _whole(4, 10_000)),
            self._ask(
                *("microsteps", "microsteps of the driver", "As its switches or the firmware set them."),
                _whole(1, 256),
            ),
            self._ask(
                *("gear_ratio", gear, "Of gear and belt together; 1 without any."),
                _number(0.1, 10_000, "4.5"),
            ),
            *([travel] if self._slides else []),
        ]

    def encoder(self) -> list[Question]:
        if self._number > MAX_ENCODERS:
            return []
        text = f"encoder counts for a turn of {self._shaft}, all edges (0: none)"
        return [self._ask("encoder_counts", text, "Four times the lines of its disc.", _counts)]

    def speed(self) -> list[Question]:
        """The question about the speed, once steps and gear are known."""
        wanted = ("steps_per_rev", "microsteps", "gear_ratio", *(["mm_per_rev"] if self._slides else []))
        keys = [f"{self._number}.{key}" for key in wanted]
        if not all(key in self._answers for key in keys):
            return []
        steps, micro, gear, *travel = (self._answers[key] for key in keys)
        entry = JointEntry("", steps_per_rev=int(steps), microsteps=int(micro), gear_ratio=float(gear))
        if travel:
            entry = replace(entry, mm_per_rev=float(travel[0]), type=PRISMATIC)
        unit = self._unit
        most = entry.most_speed_deg_s(int(self._answers["count"]))
        return [
            self._ask(
                "speed_deg_s",
                f"speed limit, {unit.word}/s ({entry.steps_per_deg:.5g} steps/{unit.name}; {most:.4g} is easy for the "
                "motor)",
                "Acceleration and jerk begin at 1 and 4 times of it; change all three in the file.",
                _number(0.001, MAX_STEP_RATE / entry.steps_per_deg, "30"),
                f"{min(60.0, float(f'{0.9 * most:.2g}')):g}",
            )
        ]

    def _ask(self, key: str, text: str, explanation: str, read: Reader, default: str = "") -> Question:
        shown = default or str(getattr(JointEntry(f"joint {self._number}"), key))
        return Question(f"{self._number}.{key}", f"{self._name}: {text}", shown, explanation, read)


_YES, _NO = ("yes", "y"), ("no", "n")


def _text(text: str) -> str:
    if not text or visible(text) != text:
        raise WrongAnswerError("it is empty or has control characters")
    return text


def _new_name(names: list[str]) -> Reader:
    def read(text: str) -> str:
        if text in names:
            raise WrongAnswerError(f"another joint has this name; for example {text} 2")
        return _text(text)

    return read


def _one_of(choices: list[str]) -> Reader:
    def read(text: str) -> str:
        if text not in choices:
            raise WrongAnswerError(f"it must be one of {', '.join(choices)}")
        return text

    return read


def _number(least: float, most: float, example: str) -> Reader:
    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            raise WrongAnswerError(f"{text!r} is not a number; write it as {example}") from None
        if not least <= value <= most:
            raise WrongAnswerError(f"it must be from {least:g} to {most:g}, such as {example}")
        return value

    return read


def _whole(least: int, most: int) -> Reader:
    def read(text: str) -> int:
        if not text.isdecimal() or not least <= int(text) <= most:
            raise WrongAnswerError(
                f"it must be a whole number from {least} to {most}, such as {max(least, 3)}"
            )
        return int(text)

    return read


def _counts(text: str) -> int:
    return 0 if text == "0" else int(str(_whole(4, 10_000_000)(text)))


def _above(low: float, what: str) -> Reader:
    def read(text: str) -> float:
        value = float(str(_number(-MAX_ANGLE_DEG, MAX_ANGLE_DEG, "90")(text)))
        if value <= low:
            raise WrongAnswerError(
                f"it must be above the lowest {what}, {low:g}, such as {low + 90:g}; '<' goes back to that"
            )
        return value

    return read
