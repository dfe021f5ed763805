"""The job: what to plan and how."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, InitVar, dataclass, field
from pathlib import Path

from armtempo.formats import json_codec
from armtempo.model.arm import Arm
from armtempo.model.tool_pose import Pose

GRADIENT = "gradient"
"""The optimiser that is no population search: gradients from several starts."""

PATHS = ("through", "free")
TIMINGS = ("shared", "per-joint")
AUTO = "auto"

REFINE, POPULATION, ITERATIONS, STARTS = (1, 64), (4, 100_000), (1, 1_000_000), (1, 1000)
"""Least and largest values of these settings."""


@dataclass(frozen=True)
class Stop:
    """A rest at via point ``via``, counted from 0, for ``dwell_s``."""

    via: int
    dwell_s: float = 0.0


@dataclass(frozen=True)
class Job:
    """A motion to plan: through ``via`` in order, from rest to rest.

    ``Job(name, via_deg=rows)`` is a short way to say ``via`` where every via point is given by angles.
    """

    name: str
    via: tuple[tuple[float, ...] | Pose, ...] = ()
    """Each entry: the driven joints' angles in degrees, (J,), or a pose."""
    stops: tuple[Stop, ...] = field(default=(), metadata=json_codec.ADDED)
    """Via points between the ends where the motion comes to rest, in order."""
    path: str = field(default="through", metadata=json_codec.ADDED)
    """``"through"``: the spline of Eqs. (13) and (14); ``"free"``: it may bend between the via points."""
    corridor_deg: float | None = field(default=None, metadata=json_codec.ADDED)
    corridor_mm: float | None = field(default=None, metadata=json_codec.ADDED)
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
    starts: int = field(default=3, metadata=json_codec.ADDED)
    """Starts of the gradient solver, where it searches."""
    seed: int = 1
    bounds_s: tuple[float, float] | None = None
    """Range of a time interval in the search (the paper: 0.1 to 3); None: follows from the job."""
    polish: bool = True
    """Whether gradients finish what the search has found."""
    source: str = ""
    _: KW_ONLY
    via_deg: InitVar[Sequence[Sequence[float]] | None] = None

    def __post_init__(self, via_deg: Sequence[Sequence[float]] | None) -> None:
        if via_deg is not None:
            rows = tuple(tuple(float(angle) for angle in row) for row in via_deg)
            object.__setattr__(self, "via", rows)

    @classmethod
    def load(cls, path: Path | str, arm: Arm) -> Job:
        """The job described by a TOML file, for this arm.

        Raises InputError, naming file, key and value, for anything missing, unknown or not allowed.
        """
        from armtempo.model import job_file

        return job_file.load(path, arm)

    @classmethod
    def from_csv(
        cls, path: Path | str, arm: Arm, radians: bool = False, tolerance_deg: float | None = None
    ) -> Job:
        """A job through the via points of a CSV file: a line for each point, a column for each driven joint.

        It has the file's name. A table with a column ``time_s``, as ``Plan.to_csv`` writes, is a sampled motion and
        thinned to ``tolerance_deg`` (0.1 unless given), and its joints pass the points together. Raises InputError
        with line and value for what is no angle.
        """
        from armtempo.model import exchange

        file = Path(path)
        found = exchange.via_from_csv(file, arm, radians, tolerance_deg)
        timing = cls.timing if found.thinned_to_deg is None else "shared"
        return cls(file.stem, via_deg=found.via_deg.tolist(), timing=timing)

    @classmethod
    def paper(cls, arm: Arm | None = None) -> Job:
        """The job that ships with armtempo: the paper's feeding motion, for its arm or ``arm``."""
        from armtempo.model import job_file

        return job_file.load(job_file.default_path(), arm or Arm.paper())
