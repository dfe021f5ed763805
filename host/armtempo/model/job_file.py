"""The job file: a job described in TOML."""

from __future__ import annotations

import string
from dataclasses import replace
from pathlib import Path

from armtempo_shared.limits import MAX_NAME, MAX_SEGMENTS

from armtempo.basics.errors import InputError
from armtempo.formats import toml_table
from armtempo.formats.toml_table import Table
from armtempo.model import pose_table
from armtempo.model.arm import Arm
from armtempo.model.job import (
    AUTO,
    GRADIENT,
    ITERATIONS,
    PATHS,
    POPULATION,
    REFINE,
    STARTS,
    TIMINGS,
    Job,
    Stop,
)
from armtempo.model.tool_pose import Pose
from armtempo.optimise import ALGORITHMS

MOST_DWELL_S = 600.0
OPTIMISERS = (*ALGORITHMS, GRADIENT)
"""Names that a job may give as its optimiser."""


def default_path() -> Path:
    """The job file that ships with armtempo: the paper's feeding motion."""
    return Path(__file__).parents[1] / "data" / "feeding.toml"


def load(path: Path | str, arm: Arm) -> Job:
    """The job described by a TOML file, for this arm.

    Raises InputError, naming file, key and value, for anything missing, unknown or not allowed.
    """
    return of_table(toml_table.read(path), arm)


def of_table(top: Table, arm: Arm) -> Job:
    """The job described by the top table of a TOML file; errors as in ``load``."""
    parameters = top.table("parameters")
    vias, stops = _vias(top, arm)
    job = Job(
        name=name_of(top),
        via=vias,
        stops=stops,
        path=top.choice("path", PATHS, Job.path),
        corridor_deg=_corridor(top, "corridor_deg"),
        corridor_mm=_corridor(top, "corridor_mm"),
        degree=top.choice("degree", (3, 5), Job.degree),
        timing=top.choice("timing", TIMINGS, Job.timing),
        refine=_refine(top),
        optimiser=top.choice("optimiser", OPTIMISERS, Job.optimiser),
        population=top.integer("population", Job.population, least=POPULATION[0], most=POPULATION[1]),
        iterations=top.integer("iterations", Job.iterations, least=ITERATIONS[0], most=ITERATIONS[1]),
        parameters=parameters.rest() if parameters else {},
        starts=top.integer("starts", Job.starts, least=STARTS[0], most=STARTS[1]),
        seed=top.integer("seed", Job.seed, least=0, most=2**63 - 1),
        bounds_s=_bounds(top),
        polish=top.boolean("polish", Job.polish),
        source=top.file,
    )
    top.done()
    return job


def _corridor(top: Table, key: str) -> float | None:
    return top.number(key, least=0.0) if top.has(key) else None


def _refine(top: Table) -> int | str:
    if not top.has("refine"):
        return Job.refine
    least, most = REFINE
    choices = (AUTO, *range(least, most + 1))
    chosen: int | str = top.choice("refine", choices, allowed=f"{AUTO!r} or {least} to {most}")
    return chosen


def _bounds(top: Table) -> tuple[float, float] | None:
    if not top.has("bounds_s"):
        return None
    low, high = top.numbers("bounds_s", 2)
    if not 0.0 < low < high:
        raise top.fail("bounds_s", "two times in seconds above 0, the shorter first")
    return low, high


def name_of(top: Table, longest: int = MAX_NAME, key: str = "name") -> str:
    """The ``name`` of a job or sequence, or what else the board is to keep as a name."""
    name = top.text(key)
    allowed = string.ascii_letters + string.digits + "-_"
    if len(name) > longest or any(letter not in allowed for letter in name):
        raise top.fail(key, f"at most {longest} of the characters a-z A-Z 0-9 - _")
    return name


def _vias(top: Table, arm: Arm) -> tuple[tuple[tuple[float, ...] | Pose, ...], tuple[Stop, ...]]:
    """``via_deg``: lists of angles; or ``via``: tables with ``angles_deg`` or a pose, and stops among them."""
    if top.has("via_deg") == top.has("via"):
        raise top.fail("via_deg", "given, or else [[via]] tables, but not both")
    stops: list[Stop] = []
    if top.has("via_deg"):
        rows = top.array("via_deg", "a list of at least 2 lists of angles")
        named = Table({f"via_deg[{n}]": row for n, row in enumerate(rows, 1)}, top.file)
        vias: list[tuple[float, ...] | Pose] = [
            angles(named, f"via_deg[{n}]", arm) for n in range(1, len(rows) + 1)
        ]
    else:
        tables = top.tables("via")
        stops = [_stop(table, n, len(tables)) for n, table in enumerate(tables) if _stops(table)]
        vias = [_via(table, f"{top.file}: via[{n}]", arm) for n, table in enumerate(tables, 1)]
    if len(vias) < 2:
        raise InputError(f"{top.file}: {len(vias)} via point is not a motion", "at least 2 are needed")
    if len(vias) - 1 > MAX_SEGMENTS:
        raise InputError(f"{top.file}: {len(vias)} via points", f"the board holds at most {MAX_SEGMENTS + 1}")
    return tuple(vias), tuple(stops)


def _stops(table: Table) -> bool:
    """Whether the motion is to rest at this via point."""
    stops = table.boolean("stop", False)
    if table.has("dwell_s") and not stops:
        raise table.fail("dwell_s", "given with stop = true only")
    return stops


def _stop(table: Table, via: int, count: int) -> Stop:
    dwell_s = table.number("dwell_s", 0.0, least=0.0, most=MOST_DWELL_S)
    if via in (0, count - 1):
        raise table.fail(
            "stop", "left out at the first and the last via point: the motion rests there anyway"
        )
    return Stop(via, dwell_s)


def _via(table: Table, where: str, arm: Arm) -> tuple[float, ...] | Pose:
    forms = [key for key in ("angles_deg", "matrix", "position_mm", "posture") if table.has(key)]
    if len(forms) != 1:
        raise InputError(
            f"{where}: exactly one of angles_deg, matrix, position_mm and posture is needed",
            "leave all but one of them out",
        )
    if forms == ["posture"]:
        name = table.text("posture")
        table.done()
        return _named(name, where, arm)
    if forms == ["angles_deg"]:
        found = angles(table, "angles_deg", arm)
        table.done()
        return found
    posture = table.numbers("posture_deg", len(arm.joints)) if table.has("posture_deg") else None
    pose = pose_table.read(table, where)
    table.done()
    return replace(pose, posture_deg=posture)


def _named(name: str, where: str, arm: Arm) -> tuple[float, ...] | Pose:
    """A posture of the arm file."""
    try:
        return arm.posture(name).where
    except InputError as error:
        raise InputError(f"{where}: {error.problem}", error.hint) from None


def angles(table: Table, key: str, arm: Arm) -> tuple[float, ...]:
    """Angles of the driven joints in degrees, (J,), each within its range."""
    found = table.numbers(key, len(arm.driven))
    for joint, angle in zip(arm.driven, found, strict=True):
        low, high = joint.range_deg
        if not low <= angle <= high:
            raise table.fail(key, f"within the range of {joint.name}, {low:g} to {high:g} degrees")
    return found
