"""The job: what to plan and how, as read from its TOML file."""

from __future__ import annotations

import string
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from armtempo_shared.limits import MAX_NAME, MAX_SEGMENTS

from armtempo.errors import InputError
from armtempo.formats import toml_table
from armtempo.formats.toml_table import Table
from armtempo.model import pose
from armtempo.model.arm import Arm

GRADIENT = "gradient"
OPTIMISERS = ("acs", "cs", "ga", "iaga", "pso", "hpso", GRADIENT)
"""Names of the search algorithms (Table 4), and gradients from several starts."""

PATHS = ("through", "free")
TIMINGS = ("shared", "per-joint")
AUTO = "auto"

REFINE, POPULATION, ITERATIONS, STARTS = (1, 64), (4, 100_000), (1, 1_000_000), (1, 1000)
"""Least and most of these settings."""

MOST_DWELL_S = 600.0

Rows = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Pose:
    """A tool pose to pass: 4 x 4 homogeneous matrix rows, lengths in mm."""

    matrix: Rows
    posture_deg: tuple[float, ...] | None = None
    """Which solution to prefer; None: nearest to the one before."""
    tolerance_mm: float = 0.0
    tolerance_deg: float = 0.0
    """How far a free path may pass from it."""


@dataclass(frozen=True)
class Stop:
    """A rest at via point ``via``, counted from 0, for ``dwell_s``."""

    via: int
    dwell_s: float = 0.0


@dataclass(frozen=True)
class Job:
    """A motion to plan: through ``via`` in order, from rest to rest."""

    name: str
    via: tuple[tuple[float, ...] | Pose, ...]
    """Each entry: the driven joints' angles in degrees, or a pose."""
    stops: tuple[Stop, ...] = ()
    """Via points between the ends where the motion comes to rest, in order."""
    path: str = "through"
    """``"through"``: the spline of Eqs. (13) and (14); ``"free"``: it may bend between the via points."""
    corridor_deg: float | None = None
    corridor_mm: float | None = None
    """How far a free path may leave the one through the via points: any joint, or the tool; None: at will."""
    degree: int = 5
    timing: str = "shared"
    """``"shared"``: one time axis for all joints; ``"per-joint"`` (the paper): one for each."""
    refine: int | str = AUTO
    """Segments of the time axis per segment of the path (of a free path: pieces of both from via point to via
    point); ``"auto"``: as many as pay and fit the board's record."""
    optimiser: str = "acs"
    population: int = 10
    iterations: int = 500
    parameters: Mapping[str, float | str | bool] = field(default_factory=dict)
    """Further parameters of the optimiser, by its own names."""
    starts: int = 3
    """Starts of the gradient solver, where it searches."""
    seed: int = 1
    bounds_s: tuple[float, float] | None = None
    """Range of a time interval in the search (the paper: 0.1 to 3); None: follows from the job."""
    polish: bool = True
    """Whether gradients finish what the search has found."""
    source: str = ""


def default_path() -> Path:
    """The job file that ships with armtempo: the paper's feeding motion."""
    return Path(__file__).parents[1] / "data" / "feeding.toml"


def load_job(path: Path | str, arm: Arm) -> Job:
    """The job described by a TOML file, for this arm.

    Raises InputError, naming file, key and value, for anything missing, unknown or not allowed.
    """
    return of_table(toml_table.read(path), arm)


def of_table(top: Table, arm: Arm) -> Job:
    """The job described by the top table of a TOML file; errors as in ``load_job``."""
    parameters = top.table("parameters")
    vias, stops = _vias(top, arm)
    job = Job(
        name=_name(top),
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
    return top.choice("refine", (AUTO, *range(least, most + 1)), allowed=f"{AUTO!r} or {least} to {most}")


def _bounds(top: Table) -> tuple[float, float] | None:
    if not top.has("bounds_s"):
        return None
    low, high = top.numbers("bounds_s", 2)
    if not 0.0 < low < high:
        raise top.fail("bounds_s", "two times in seconds above 0, the shorter first")
    return low, high


def _name(top: Table) -> str:
    name = top.text("name")
    allowed = string.ascii_letters + string.digits + "-_"
    if len(name) > MAX_NAME or any(letter not in allowed for letter in name):
        raise top.fail("name", f"at most {MAX_NAME} of the characters a-z A-Z 0-9 - _")
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
            _angles(named, f"via_deg[{n}]", arm) for n in range(1, len(rows) + 1)
        ]
    else:
        tables = top.tables("via")
        stops = [_stop(table, n, len(tables)) for n, table in enumerate(tables) if _stops(table)]
        vias = [_via(table, f"{top.file}: via[{n}]", arm) for n, table in enumerate(tables, 1)]
    if len(vias) < 2:
        raise InputError(f"{top.file}: {len(vias)} via point is not a motion; at least 2 are needed")
    if len(vias) - 1 > MAX_SEGMENTS:
        raise InputError(f"{top.file}: {len(vias)} via points; the board holds at most {MAX_SEGMENTS + 1}")
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
        raise table.fail("stop", "left out at the first and the last via point: the motion rests there anyway")
    return Stop(via, dwell_s)


def _via(table: Table, where: str, arm: Arm) -> tuple[float, ...] | Pose:
    forms = [key for key in ("angles_deg", "matrix", "position_mm") if table.has(key)]
    if len(forms) != 1:
        raise InputError(f"{where}: exactly one of angles_deg, matrix and position_mm is needed")
    if forms == ["angles_deg"]:
        angles = _angles(table, "angles_deg", arm)
        table.done()
        return angles
    posture = table.numbers("posture_deg", len(arm.joints)) if table.has("posture_deg") else None
    matrix = _matrix(table) if forms == ["matrix"] else _turned(table, where)
    tolerance_mm = table.number("tolerance_mm", 0.0, least=0.0)
    tolerance_deg = table.number("tolerance_deg", 0.0, least=0.0, most=90.0)
    table.done()
    return Pose(matrix, posture, tolerance_mm, tolerance_deg)


def _matrix(table: Table) -> Rows:
    given = table.array("matrix", "the 4 rows of a pose, lengths in mm")
    if len(given) != 4:
        raise table.fail("matrix", "4 rows of 4 numbers")
    rows = Table({f"row {n}": row for n, row in enumerate(given, 1)}, table.file, "matrix ")
    return tuple(rows.numbers(f"row {n}", 4) for n in range(1, 5))


def _turned(table: Table, where: str) -> Rows:
    """A pose given as a position with roll, pitch and yaw or with a quaternion."""
    position = table.numbers("position_mm", 3)
    if table.has("rpy_deg") == table.has("quaternion"):
        raise InputError(f"{where}: position_mm goes with one of rpy_deg and quaternion")
    if table.has("rpy_deg"):
        found = pose.from_rpy(position, table.numbers("rpy_deg", 3), where)
    else:
        found = pose.from_quaternion(position, table.numbers("quaternion", 4), f"{where}.quaternion")
    return tuple(tuple(row) for row in found.tolist())


def _angles(table: Table, key: str, arm: Arm) -> tuple[float, ...]:
    angles = table.numbers(key, len(arm.driven))
    for joint, angle in zip(arm.driven, angles, strict=True):
        low, high = joint.range_deg
        if not low <= angle <= high:
            raise table.fail(key, f"within the range of {joint.name}, {low:g} to {high:g} degrees")
    return angles
