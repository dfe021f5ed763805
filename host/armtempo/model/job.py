"""The job: via points and settings of a plan, and its file."""

from __future__ import annotations

import string
from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, InitVar, dataclass, field, replace
from pathlib import Path

from armtempo_shared.limits import MAX_NAME, MAX_SEGMENTS

from armtempo.basics import json_codec, toml_table
from armtempo.basics.arguments import checked, checked_fields
from armtempo.basics.errors import InputError
from armtempo.basics.toml_table import Table
from armtempo.model import frame, shipped, tool_segment, via_table
from armtempo.model.arm import Arm
from armtempo.model.posture import given_key
from armtempo.model.tool_pose import BASE, TOLERANCE_DEG, TOLERANCE_MM, Pose, from_table
from armtempo.model.tool_segment import POINTS, ToolSegment
from armtempo.optimise import ALGORITHMS

GRADIENT = "gradient"
"""The optimiser without a population: gradients from several starts."""

PATHS = ("through", "free")
TIMINGS = ("shared", "per-joint")
AUTO = "auto"

REFINE, POPULATION, ITERATIONS, STARTS = (1, 64), (4, 100_000), (1, 1_000_000), (1, 1000)
"""Least and largest values of these settings."""
SEED = (0, 2**63 - 1)
DEGREES = (3, 5)
_BOUNDS = "two times in seconds above 0, the shorter first"
MOST_DWELL_S = 600.0
NAME_RULE = f"at most {MAX_NAME} of the characters a-z A-Z 0-9 - _"
_LETTERS = string.ascii_letters + string.digits + "-_"
OPTIMISERS = (*ALGORITHMS, GRADIENT)
"""Names that a job may give as its optimiser."""


@checked_fields
@dataclass(frozen=True)
class Stop:
    """A stop at via point ``via`` (from 0) for ``dwell_s``."""

    via: int
    dwell_s: float = 0.0


@checked
@checked_fields
@dataclass(frozen=True)
class Job:
    """A motion to plan: through ``via`` in order, from rest to rest.

    ``Job(name, via_deg=rows)`` is a short form of ``via`` if all via points are given by angles.
    """

    name: str
    via: tuple[tuple[float, ...] | Pose, ...] = ()
    """Each entry: the driven joints' angles, degrees (J,), or a pose."""
    stops: tuple[Stop, ...] = field(default=(), metadata=json_codec.ADDED)
    """Via points between the ends at which the motion stops, in order."""
    tool_segments: tuple[ToolSegment, ...] = field(
        default=(), metadata={**json_codec.ADDED, json_codec.KEY: "ways"}
    )
    """Requirements for the tool between via points (lines, arcs, speeds), in order."""
    speed_mm_s: float | None = field(default=None, metadata=json_codec.ADDED)
    acceleration_mm_s2: float | None = field(default=None, metadata=json_codec.ADDED)
    """Limits of the tool for the whole motion."""
    holds: str = field(default="", metadata=json_codec.ADDED)
    """The load of the arm that the tool holds; "": none, and in a sequence what it holds there."""
    tool: str = field(default="", metadata=json_codec.ADDED)
    """The tool of the arm on it, whose point the poses are for; "": the arm's as it is."""
    start_touches: bool = field(default=False, metadata=json_codec.ADDED)
    """Whether it may start where the arm touches something, to move out."""
    path: str = field(default="free", metadata=json_codec.added_as("through"))
    """``"free"``: it may bend between the via points, so it is the fastest; ``"through"``: the spline of Eqs. (13)
    and (14)."""
    corridor_deg: float | None = field(default=None, metadata=json_codec.ADDED)
    corridor_mm: float | None = field(default=None, metadata=json_codec.ADDED)
    """Largest distance of a free path from the spline through the via points, of any joint or of the tool;
    None: no limit."""
    degree: int = 5
    timing: str = "shared"
    """``"shared"``: one time axis for all joints; ``"per-joint"`` (the paper): one for each joint."""
    refine: int | str = AUTO
    """Segments of the time axis per segment of the path (free path: segments of both between two via points);
    ``"auto"``: more as long as they shorten the motion and fit the board's record."""
    optimiser: str = "acs"
    population: int = 10
    iterations: int = 500
    parameters: Mapping[str, float | str | bool] = field(default_factory=dict)
    """Parameters of the optimiser, by its names."""
    starts: int = field(default=3, metadata=json_codec.ADDED)
    """Starts of the gradient solver, if it is the search."""
    seed: int = 1
    bounds_s: tuple[float, float] | None = None
    """Range of a time interval in the search (the paper: 0.1 to 3); None: computed from the job."""
    polish: bool = True
    """Whether a gradient solver finishes the search."""
    source: str = ""
    _: KW_ONLY
    via_deg: InitVar[Sequence[Sequence[float]] | None] = None

    def __post_init__(self, via_deg: Sequence[Sequence[float]] | None) -> None:
        if via_deg is not None:
            object.__setattr__(self, "via", via_deg)
        vias = (via if isinstance(via, Pose) else tuple(map(float, via)) for via in self.via)
        object.__setattr__(self, "via", tuple(vias))
        self._check()

    def _check(self) -> None:
        """Raise InputError for settings that the planner does not know or the board cannot store."""
        if not is_name(self.name):
            raise InputError(f"job {self.name!r}: not a valid name on the board", f"give {NAME_RULE}")
        for key, allowed in (
            ("timing", TIMINGS),
            ("path", PATHS),
            ("degree", DEGREES),
            ("optimiser", OPTIMISERS),
        ):
            if (value := getattr(self, key)) not in allowed:
                raise InputError(
                    f"job {self.name!r}: {key} {value!r} is not allowed",
                    f"give {' or '.join(map(repr, allowed))}",
                )
        if isinstance(self.refine, str) and self.refine != AUTO:
            raise InputError(
                f"job {self.name!r}: refine {self.refine!r} is not allowed", f"give {AUTO!r} or a number"
            )
        if self.bounds_s is not None and not 0.0 < self.bounds_s[0] < self.bounds_s[1]:
            raise InputError(f"job {self.name!r}: bounds_s {self.bounds_s} is not allowed", f"give {_BOUNDS}")
        ranges = {"population": POPULATION, "iterations": ITERATIONS, "starts": STARTS, "seed": SEED}
        if not isinstance(self.refine, str):
            ranges["refine"] = REFINE
        for key, (least, most) in ranges.items():
            if not least <= getattr(self, key) <= most:
                raise InputError(
                    f"job {self.name!r}: {key} {getattr(self, key)} must be a whole number from {least} to {most}",
                    f"give {key} such a number, or leave it out",
                )

    @property
    def frames(self) -> tuple[str, ...]:
        """The frames of the arm in which something of it was given, in order; not the base."""
        given = [via.frame for via in self.via if isinstance(via, Pose)]
        given += [segment.frame for segment in self.tool_segments]
        return tuple(name for name in dict.fromkeys(given) if name != BASE)

    @classmethod
    def of(cls, job: Job | Path | str, arm: Arm) -> Job:
        """The job itself, or the job of a file as in ``load``."""
        return job if isinstance(job, Job) else cls.load(job, arm)

    @classmethod
    def load(cls, path: Path | str, arm: Arm | Path | str) -> Job:
        """The job described by a TOML file, for this arm.

        Raises InputError, naming file, key and value, for anything missing, unknown or not allowed.
        """
        return cls.of_table(toml_table.read(path), Arm.of(arm))

    @classmethod
    def of_table(cls, top: Table, arm: Arm) -> Job:
        """The job described by the top table of a TOML file; errors as in ``load``."""
        parameters = top.table("parameters")
        vias, stops, segments = _vias(top, arm)
        job = cls(
            name=name_of(top),
            via=vias,
            stops=stops,
            tool_segments=segments,
            speed_mm_s=tool_segment.limit(top, "speed_mm_s"),
            acceleration_mm_s2=tool_segment.limit(top, "acceleration_mm_s2"),
            holds=held(top, arm),
            tool=tool_named(top, arm),
            start_touches=top.boolean("start_touches", cls.start_touches),
            path=top.choice("path", PATHS, cls.path),
            corridor_deg=_corridor(top, "corridor_deg"),
            corridor_mm=_corridor(top, "corridor_mm"),
            degree=top.choice("degree", DEGREES, cls.degree),
            timing=top.choice("timing", TIMINGS, cls.timing),
            refine=_refine(top),
            optimiser=top.choice("optimiser", OPTIMISERS, cls.optimiser),
            population=top.integer("population", cls.population, least=POPULATION[0], most=POPULATION[1]),
            iterations=top.integer("iterations", cls.iterations, least=ITERATIONS[0], most=ITERATIONS[1]),
            parameters=parameters.rest() if parameters else {},
            starts=top.integer("starts", cls.starts, least=STARTS[0], most=STARTS[1]),
            seed=top.integer("seed", cls.seed, least=SEED[0], most=SEED[1]),
            bounds_s=_bounds(top),
            polish=top.boolean("polish", cls.polish),
            source=top.file,
        )
        top.done()
        return job

    @classmethod
    def from_csv(
        cls,
        path: Path | str,
        arm: Arm | Path | str,
        radians: bool | None = None,
        tolerance_deg: float | Sequence[float] | None = None,
    ) -> Job:
        """A job through the via points of a CSV file: one line per point, its columns named in the first line.

        A column for each driven joint, or positions and orientations; without a header one for each driven joint in
        their order. ``radians``: unit of columns that do not name theirs; None: degrees, unless that is doubtful.
        Its name is the file's. A table with a time, as ``Plan.to_csv`` writes, is a sampled motion: it is thinned to
        ``tolerance_deg`` (default 0.1; one for all joints, or for each in its unit), with shared timing. Raises
        InputError with line and value for an invalid angle.
        """
        file = Path(path)
        found = via_table.read(file, Arm.of(arm), radians, tolerance_deg)
        return cls.of_table(toml_table.parse(via_table.job_text(file.stem, found), str(path)), Arm.of(arm))

    @classmethod
    def searching(cls) -> Mapping[str, object]:
        """The settings of the search for ``path = "through"``, without effect on a free path, and their defaults."""
        own = ("optimiser", "population", "iterations", "bounds_s", "polish")
        return {**{name: getattr(cls, name) for name in own}, "parameters": {}}

    @classmethod
    def paper(cls, arm: Arm | Path | str | None = None) -> Job:
        """The shipped job: the paper's feeding motion, for its arm or ``arm``."""
        return cls.load(shipped.job_path(), arm or shipped.arm_path())


def held(top: Table, arm: Arm) -> str:
    """``holds``: a load of the arm, or "nothing"; "" if it is not given."""
    return _of_the_arm(top, "holds", arm.holding)


def tool_named(top: Table, arm: Arm) -> str:
    """``tool``: a tool of the arm, or "nothing"; "" if it is not given."""
    return _of_the_arm(top, "tool", arm.with_tool)


def _of_the_arm(top: Table, key: str, find: Callable[[str], object]) -> str:
    top.known(key)
    name = top.text(key) if top.has(key) else ""
    try:
        find(name)
    except InputError as error:
        raise InputError(f"{top.file}: {top.place}{key}: {error.problem}", error.hint) from None
    return name


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
        raise top.fail("bounds_s", _BOUNDS)
    return low, high


def name_of(top: Table, longest: int = MAX_NAME, key: str = "name") -> str:
    """The ``name`` of a job or sequence (or another ``key`` that is a name on the board)."""
    name = top.text(key)
    if not is_name(name, longest):
        raise top.fail(key, NAME_RULE.replace(str(MAX_NAME), str(longest)))
    return name


def is_name(name: str, longest: int = MAX_NAME) -> bool:
    """Whether it is a valid name on the board."""
    return 0 < len(name) <= longest and all(letter in _LETTERS for letter in name)


def _vias(
    top: Table, arm: Arm
) -> tuple[tuple[tuple[float, ...] | Pose, ...], tuple[Stop, ...], tuple[ToolSegment, ...]]:
    """``via_deg`` or ``via_joints``: lists; or ``via``: tables with ``angles_deg``, ``joints`` or a pose, stops and
    lines too.

    Poses and points of arcs are turned into the base.
    """
    default = frame.named(top, arm.frames)
    listed = given_key(top, arm.texts, "via_deg")
    if top.has(listed) == top.has("via"):
        if top.has("via"):
            raise top.misplaced(
                listed, "leave out this list, or the [[via]] tables: both give the via points"
            )
        what = f"a list of at least 2 lists of {arm.texts.position}s"
        raise top.fail(arm.texts.list_key("via_deg"), f"{what}, or else [[via]] tables")
    stops: list[Stop] = []
    segments: list[ToolSegment] = []
    vias: list[tuple[float, ...] | Pose] = []
    if top.has(listed):
        rows = top.array(listed, f"a list of at least 2 lists of {arm.texts.position}s")
        named = Table({f"{listed} P{n}": row for n, row in enumerate(rows)}, top.file)
        vias.extend(read_angles(named, f"{listed} P{n}", arm) for n in range(len(rows)))
    else:
        tables = top.tables("via", lambda n: f"via P{n}")
        stops = [_stop(table, n, len(tables)) for n, table in enumerate(tables) if _stops(table)]
        for n, table in enumerate(tables):
            name = frame.named(table, arm.frames, default)
            segment = tool_segment.read(table, n)
            vias.append(_via(table, name, arm, segment))
            if segment:
                segments.append(frame.segment_in_base(segment, arm.frames, name))
    if len(vias) < 2:
        raise InputError(f"{top.file}: {len(vias)} via point is not a motion", "at least 2 are needed")
    if len(vias) - 1 > MAX_SEGMENTS:
        raise InputError(f"{top.file}: {len(vias)} via points", f"the board holds at most {MAX_SEGMENTS + 1}")
    return tuple(vias), tuple(stops), tuple(segments)


def _stops(table: Table) -> bool:
    """Whether the motion stops at this via point."""
    stops = table.boolean("stop", False)
    if table.has("dwell_s") and not stops:
        raise table.misplaced("dwell_s", "leave it out, or give stop = true too")
    return stops


def _stop(table: Table, via: int, count: int) -> Stop:
    dwell_s = table.number("dwell_s", 0.0, least=0.0, most=MOST_DWELL_S)
    if via in (0, count - 1):
        raise table.misplaced(
            "stop", "leave it out at the first and the last via point: the motion rests there anyway"
        )
    return Stop(via, dwell_s)


def _via(table: Table, name: str, arm: Arm, segment: ToolSegment | None) -> tuple[float, ...] | Pose:
    """A via point; of a pose in the frame ``name``, in the base."""
    where = f"{table.file}: {table.place.removesuffix('.')}"
    listed = given_key(table, arm.texts, "angles_deg")
    forms = [key for key in (listed, "matrix", "position_mm", "posture") if table.has(key)]
    if len(forms) != 1:
        raise InputError(
            f"{where}: exactly one of {arm.texts.list_key('angles_deg')}, matrix, position_mm and posture is needed",
            "leave all but one of them out",
        )
    in_frame = forms[0] in ("matrix", "position_mm") or any(table.has(key) for key in POINTS)
    if table.has("frame") and not in_frame:
        raise table.misplaced("frame", "leave it out: nothing of this via point is given in a frame")
    if forms == ["posture"]:
        name = table.text("posture")
        _done(table, segment)
        return _named(name, where, arm)
    if forms == [listed]:
        found = read_angles(table, listed, arm)
        _done(table, segment)
        return found
    near = given_key(table, arm.texts, "posture_deg")
    posture = table.numbers(near, len(arm.joints)) if table.has(near) else None
    pose = frame.pose_in_base(from_table(table, where), arm.frames, name, where)
    table.done()
    if segment and segment.line:  # its tolerances are read as those of the line
        pose = replace(pose, tolerance_mm=TOLERANCE_MM, tolerance_deg=TOLERANCE_DEG)
    return replace(pose, posture_deg=posture)


def _done(table: Table, segment: ToolSegment | None) -> None:
    if segment and segment.line:
        table.known("tolerance_mm", "tolerance_deg")
    table.done()


def _named(name: str, where: str, arm: Arm) -> tuple[float, ...] | Pose:
    """A posture of the arm file."""
    try:
        return arm.posture(name).where
    except InputError as error:
        raise InputError(f"{where}: {error.problem}", error.hint) from None


def read_angles(table: Table, key: str, arm: Arm) -> tuple[float, ...]:
    """Positions of the driven joints, (J,), each within its range."""
    found = arm.placed(table.numbers(key, len(arm.driven)))
    for joint, angle in zip(arm.driven, found, strict=True):
        low, high = joint.range_deg
        if not low <= angle <= high:
            raise table.fail(key, f"within the range of {joint.name}, {low:g} to {high:g} {joint.unit.word}")
    return found
