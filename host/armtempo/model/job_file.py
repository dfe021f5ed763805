"""The job file: a job described in TOML."""

from __future__ import annotations

import string
from dataclasses import replace
from pathlib import Path

from armtempo_shared.limits import MAX_NAME, MAX_SEGMENTS

from armtempo.errors import InputError
from armtempo.formats import toml_table
from armtempo.formats.toml_table import Table
from armtempo.model import pose_table
from armtempo.model.arm import Arm
from armtempo.model.job import ITERATIONS, POPULATION, REFINE, Job
from armtempo.model.tool_pose import Pose
from armtempo.optimise import ALGORITHMS


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
    low, high = top.numbers("bounds_s", 2, Job.bounds_s)
    if not 0.0 < low < high:
        raise top.fail("bounds_s", "two times in seconds above 0, the shorter first")
    parameters = top.table("parameters")
    job = Job(
        name=_name(top),
        via=_vias(top, arm),
        degree=top.choice("degree", (3, 5), Job.degree),
        timing=top.choice("timing", ("per-joint", "shared"), Job.timing),
        refine=top.integer("refine", Job.refine, least=REFINE[0], most=REFINE[1]),
        optimiser=top.choice("optimiser", tuple(ALGORITHMS), Job.optimiser),
        population=top.integer("population", Job.population, least=POPULATION[0], most=POPULATION[1]),
        iterations=top.integer("iterations", Job.iterations, least=ITERATIONS[0], most=ITERATIONS[1]),
        parameters=parameters.rest() if parameters else {},
        seed=top.integer("seed", Job.seed, least=0, most=2**63 - 1),
        bounds_s=(low, high),
        polish=top.boolean("polish", Job.polish),
        source=top.file,
    )
    top.done()
    return job


def _name(top: Table) -> str:
    name = top.text("name")
    allowed = string.ascii_letters + string.digits + "-_"
    if len(name) > MAX_NAME or any(letter not in allowed for letter in name):
        raise top.fail("name", f"at most {MAX_NAME} of the characters a-z A-Z 0-9 - _")
    return name


def _vias(top: Table, arm: Arm) -> tuple[tuple[float, ...] | Pose, ...]:
    """``via_deg``: lists of angles; or ``via``: tables with ``angles_deg`` or a pose."""
    if top.has("via_deg") == top.has("via"):
        raise top.fail("via_deg", "given, or else [[via]] tables, but not both")
    if top.has("via_deg"):
        rows = top.array("via_deg", "a list of at least 2 lists of angles")
        named = Table({f"via_deg[{n}]": row for n, row in enumerate(rows, 1)}, top.file)
        vias: list[tuple[float, ...] | Pose] = [
            _angles(named, f"via_deg[{n}]", arm) for n in range(1, len(rows) + 1)
        ]
    else:
        tables = enumerate(top.tables("via"), 1)
        vias = [_via(table, f"{top.file}: via[{n}]", arm) for n, table in tables]
    if len(vias) < 2:
        raise InputError(f"{top.file}: {len(vias)} via point is not a motion; at least 2 are needed")
    if len(vias) - 1 > MAX_SEGMENTS:
        raise InputError(f"{top.file}: {len(vias)} via points; the board holds at most {MAX_SEGMENTS + 1}")
    return tuple(vias)


def _via(table: Table, where: str, arm: Arm) -> tuple[float, ...] | Pose:
    forms = [key for key in ("angles_deg", "matrix", "position_mm") if table.has(key)]
    if len(forms) != 1:
        raise InputError(f"{where}: exactly one of angles_deg, matrix and position_mm is needed")
    if forms == ["angles_deg"]:
        angles = _angles(table, "angles_deg", arm)
        table.done()
        return angles
    posture = table.numbers("posture_deg", len(arm.joints)) if table.has("posture_deg") else None
    pose = pose_table.read(table, where)
    table.done()
    return replace(pose, posture_deg=posture)


def _angles(table: Table, key: str, arm: Arm) -> tuple[float, ...]:
    angles = table.numbers(key, len(arm.driven))
    for joint, angle in zip(arm.driven, angles, strict=True):
        low, high = joint.range_deg
        if not low <= angle <= high:
            raise table.fail(key, f"within the range of {joint.name}, {low:g} to {high:g} degrees")
    return angles
