"""Tools of an arm: where the point of each is, and what it adds to the last link."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from armtempo.basics import toml_section
from armtempo.basics.arguments import checked_fields
from armtempo.basics.errors import InputError
from armtempo.basics.toml_section import key
from armtempo.basics.toml_table import Table
from armtempo.model import frame, outputs_file, pose, tool_pose
from armtempo.model.parts import NOTHING
from armtempo.model.parts_file import MAX_LENGTH_MM
from armtempo.model.tool_pose import Rows, rows_of

KIND = "tool"
"""The tables [tool.NAME] of an arm file."""


@checked_fields
@dataclass(frozen=True)
class ArmTool:
    """A tool on the frame after the last row."""

    name: str
    matrix: Rows
    """Pose of its point in that frame: 4 rows of 4, lengths in mm."""
    centre_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Of mass, in that frame."""
    mass_kg: float = field(default=0.0, metadata=key("of it, at `centre_mm`", 0.0, 1e3))
    radius_mm: float = field(
        default=0.0,
        metadata=key("of the capsule around it, from the frame after the last row to its point", 0.0, 1e4),
    )

    def __post_init__(self) -> None:
        """Raise InputError for a name that is not allowed, a matrix that is no pose, or figures that nothing has."""
        check_name(self.name)
        object.__setattr__(self, "matrix", rows_of(pose.checked(self.matrix, f"{KIND}.{self.name}")))
        toml_section.check(self)

    @property
    def length_mm(self) -> float:
        """Distance of its point from the frame after the last row."""
        return float(sum(row[3] ** 2 for row in self.matrix[:3]) ** 0.5)


def check_name(name: str, place: str = "") -> None:
    """Raise InputError, which begins with ``place``, for a name that no tool may have."""
    if name == NOTHING:
        raise InputError(f"{place}{KIND}.{name}: {name!r} means no tool", "choose another name")
    outputs_file.check_name(f"{place}{KIND}.{name}", name)


def check(tools: Sequence[ArmTool], where: str) -> None:
    """Raise InputError, which begins with ``where``, for two of a name."""
    names = [each.name for each in tools]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{where}: two tools are called {name!r}", "give each a name of its own")


def read(top: Table) -> tuple[ArmTool, ...]:
    """The tables [tool.NAME] of an arm file; raises InputError, with file, key and value, for invalid ones."""
    return tuple(_tool(name, table) for name, table in outputs_file.named(top, KIND))


def _tool(name: str, table: Table) -> ArmTool:
    check_name(name, f"{table.file}: ")
    if table.has("approach"):
        raise InputError(
            f"{table.file}: {table.place}approach does not say how a tool is turned about its own z axis",
            frame.WHOLE_ORIENTATION,
        )
    matrix = tool_pose.given(table, f"{table.file}: {KIND}.{name}").matrix
    middle = tuple(0.5 * row[3] for row in matrix[:3])
    return toml_section.read(
        ArmTool,
        table,
        name=name,
        matrix=matrix,
        centre_mm=table.numbers("centre_mm", 3, middle, most=MAX_LENGTH_MM),
    )
