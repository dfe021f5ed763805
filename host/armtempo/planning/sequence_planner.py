"""Planning a sequence: every motion time-optimally, from the end of the one before."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from armtempo_shared import sequence as record

from armtempo.basics.errors import ArmtempoError, InputError
from armtempo.basics.progress import Progress
from armtempo.model import steps as kinds
from armtempo.model.arm import Arm
from armtempo.model.leg import SequenceRow
from armtempo.model.plan import Plan, check_size
from armtempo.model.posture import ArmPosture
from armtempo.model.sequence import Sequence
from armtempo.model.steps import Step
from armtempo.model.tool_pose import BASE, Pose
from armtempo.planning import planner, via_points
from armtempo.planning.sequence_motions import Angles, NamedAngles, SequenceMotions, to_angles
from armtempo.planning.via_points import Place

_THEN = {kinds.NEXT: record.NEXT_THEN, kinds.FAULT: record.FAULT_THEN}


def plan(arm: Arm, sequence: Sequence, progress: Progress | None = None) -> Plan:
    """All different motions of a sequence, and the rows that the board executes.

    Raises InputError, naming file and step, if a motion does not begin at the end of the one before, or the
    sequence has no effect; PlanError if a motion cannot be planned.
    """
    arm = arm.with_tool(sequence.tool)
    motions = SequenceMotions(arm, progress)
    compiler = _Compiler(motions)
    source = sequence.source or f"sequence {sequence.name!r}"
    start = motions.posture(sequence.start, f"{source}: start: ") if sequence.start else _End(None, "")
    rows, _ = compiler.rows(sequence.steps, start.angles_deg, start.name)
    if not rows:
        raise InputError(f"{source}: the sequence has no effect", "add a step that moves, sets or waits")
    check_size(len(rows), len(motions.legs), len(compiler.counters), source)
    legs = [
        replace(
            leg,
            trajectory=replace(leg.trajectory, name=f"{sequence.name}-{number}"),
            tool=leg.tool if motions.changes_tool else "",
        )
        for number, leg in enumerate(motions.legs, 1)
    ]
    return Plan(
        arm,
        sequence.name,
        tuple(legs),
        tuple(rows),
        planner.versions(),
        tuple(dict.fromkeys(motions.notes)),
        tuple(dict.fromkeys(motions.frames)),
        tuple(dict.fromkeys(name for name, _ in compiler.places)),
        tuple(compiler.counters),
    )


@dataclass(frozen=True)
class _End:
    """The posture after some rows; None if nothing has moved yet."""

    angles_deg: Angles | None
    name: str


@dataclass
class _Compiler:
    motions: SequenceMotions
    counters: list[str] = field(default_factory=list)
    places: dict[tuple[str, str], list[Place]] = field(default_factory=dict)
    """Of each pallet that is used, and tool."""
    _present: dict[str, int] = field(default_factory=dict)
    """Index of the present place of each pallet that a repeat goes through."""
    _depth: int = 0

    def rows(self, steps: tuple[Step, ...], here: Angles | None, name: str) -> tuple[list[SequenceRow], _End]:
        """The rows of some steps from a posture on, and the posture after them."""
        end = _End(here, name)
        found: list[SequenceRow] = []
        for step in steps:
            if isinstance(step, kinds.Repeat):
                rows, end = self._repeat(step, end)
            elif isinstance(step, kinds.EachPlace):
                rows, end = self._each_place(step, end)
            elif isinstance(step, kinds.ToPlace):
                rows, end = self._place(step, end)
            elif isinstance(step, kinds.Goto):
                rows, end = self._goto(step, end)
            elif isinstance(step, kinds.RunMotion):
                rows, end = self._run(step, end)
            elif isinstance(step, kinds.Hold):
                rows = self._hold(step)
            elif isinstance(step, kinds.UseTool):
                rows = self._use_tool(step)
            else:
                rows = [self._still(step)]
            found += rows
        return found, end

    def _hold(self, step: kinds.Hold) -> list[SequenceRow]:
        """The following motions are planned with the load, which is not sent to the board."""
        try:
            self.motions.arm.holding(step.load)
        except InputError as error:
            raise InputError(f"{step.where}{error.problem}", error.hint) from None
        self.motions.holds = step.load
        return []

    def _use_tool(self, step: kinds.UseTool) -> list[SequenceRow]:
        """The following motions are planned with the tool, of which the board knows nothing."""
        try:
            self.motions.arm = self.motions.arm.with_tool(step.tool)
        except InputError as error:
            raise InputError(f"{step.where}{error.problem}", error.hint) from None
        self.motions.changes_tool = True
        return []

    def _repeat(self, step: kinds.Repeat, before: _End) -> tuple[list[SequenceRow], _End]:
        """The rows of a repeat; its first pass is separate if it starts at another posture."""
        outermost = not self._depth
        self._depth += 1
        first, end = self.rows(step.steps, before.angles_deg, before.name)
        if not first:
            raise InputError(
                f"{step.where}repeat: nothing is repeated", "put steps between repeat and its end"
            )
        apart = before.angles_deg is not None and end.angles_deg != before.angles_deg
        rows, last = self.rows(step.steps, end.angles_deg, end.name) if end.angles_deg else (first, end)
        apart = apart or rows != first
        self._depth -= 1
        times = step.times - apart if step.times else 0
        if apart and step.times == 1:
            return first, end
        words = f"{step.times} times" if step.times else "for ever"
        begin = SequenceRow(record.REPEAT, 0, int(apart and outermost), times, step.step, f"repeat {words}")
        close = SequenceRow(record.END, 0, int(outermost), 0, step.step, "end of repeat")
        return [*(first if apart else ()), begin, *rows, close], last

    def _each_place(self, step: kinds.EachPlace, end: _End) -> tuple[list[SequenceRow], _End]:
        """The rows of each place, one after the other, as each has its own motions."""
        places = self._places(step)
        last = step.last or len(places)
        if not 1 <= step.first <= last <= len(places):
            raise InputError(
                f"{step.where}repeat: places {step.first} to {last} of the {len(places)} of pallet {step.pallet!r}",
                "give a first that is not behind the last",
            )
        if step.pallet in self._present:
            raise InputError(
                f"{step.where}repeat: it is within another repeat for pallet {step.pallet!r}",
                "repeat it once",
            )
        if not step.steps:
            raise InputError(
                f"{step.where}repeat: nothing is repeated", "put steps between repeat and its end"
            )
        outermost = not self._depth
        self._depth += 1
        found: list[SequenceRow] = []
        for index in range(step.first - 1, last)[:: -1 if step.reverse else 1]:
            self._present[step.pallet] = index
            rows, end = self.rows(step.steps, end.angles_deg, end.name)
            found.append(SequenceRow(record.REPEAT, 0, 0, 1, step.step, places[index].name))
            found += rows
            found.append(SequenceRow(record.END, 0, int(outermost), 0, step.step, "end of place"))
        del self._present[step.pallet]
        self._depth -= 1
        return found, end

    def _places(self, step: kinds.EachPlace | kinds.ToPlace) -> list[Place]:
        """The places of a pallet, with the angles above them; PlanError names one that cannot be reached."""
        try:
            pallet = self.motions.arm.pallet(step.pallet)
            if pallet.frame != BASE:
                self.motions.frames.append(pallet.frame)
            key = step.pallet, self.motions.tool
            if key not in self.places:
                self.places[key] = via_points.places(self.motions.arm, pallet)
        except ArmtempoError as error:
            raise type(error)(f"{step.where}repeat: {error.problem}", error.hint) from error
        return self.places[key]

    def _place(self, step: kinds.ToPlace, here: _End) -> tuple[list[SequenceRow], _End]:
        """To the point above a place and down to it, or up from it."""
        key = "leave" if step.leave else "place"
        index = self._present.get(step.pallet)
        if index is None:
            raise InputError(
                f"{step.where}{key} = {step.pallet!r}: it is not within a repeat for this pallet",
                f'put it between repeat = "{step.pallet}" and its end',
            )
        place = self._places(step)[index]
        above = _End(place.above_deg, f"above {place.name}")
        where = f"{step.where}{key}: "
        if step.leave:
            return self._straight_to(above.name, place.above_deg, here, step, where)
        over = kinds.Goto(ArmPosture(above.name, place.above_deg), where=step.where, step=step.step)
        rows, end = self._goto(over, here)
        down, end = self._straight_to(place.name, place.pose, end, step, f"{where}{place.name}: ")
        return [*rows, *down], end

    def _goto(self, step: kinds.Goto, here: _End) -> tuple[list[SequenceRow], _End]:
        if step.line:
            return self._line(step, here)
        target = self._target(step)
        if here.angles_deg is None or here.angles_deg == target.angles_deg:
            return [], _End(target.angles_deg, target.name)
        leg = self.motions.joint_move(here.angles_deg, target.angles_deg, f"{step.where}goto: ")
        return [_move(leg, step.step, f"goto {target.name}")], _End(target.angles_deg, target.name)

    def _line(self, step: kinds.Goto, here: _End) -> tuple[list[SequenceRow], _End]:
        """A straight line of the tool; to a pose in the present branch of the arm."""
        posture = self.motions.arm.posture(step.target) if isinstance(step.target, str) else step.target
        pose = posture.where if isinstance(posture, ArmPosture) else None
        if isinstance(posture, ArmPosture):
            self.motions.note_frame(posture)
        if isinstance(pose, Pose) and isinstance(posture, ArmPosture):
            return self._straight_to(posture.name, pose, here, step, f"{step.where}goto: ")
        target = self._target(step)
        return self._straight_to(target.name, target.angles_deg, here, step, f"{step.where}goto: ")

    def _straight_to(
        self, name: str, to: Angles | Pose, here: _End, step: kinds.Goto | kinds.ToPlace, where: str
    ) -> tuple[list[SequenceRow], _End]:
        """A straight line of the tool to angles (J,), or to a pose."""
        if here.angles_deg is None:
            raise InputError(
                f"{where}a line needs a known start, and the arm's position is not known here",
                "give the sequence a start, or put a goto without line before it",
            )
        if to == here.angles_deg:
            return [], here
        number = self.motions.line(here.angles_deg, to, step.speed_mm_s, where)
        leg = self.motions.legs[number].trajectory
        end = _End(to_angles(leg(leg.duration_s)) if isinstance(to, Pose) else to, name)
        return [_move(number, step.step, f"line to {name}")], end

    def _run(self, step: kinds.RunMotion, here: _End) -> tuple[list[SequenceRow], _End]:
        motion = self.motions.motion(step.motion)
        trajectory = self.motions.planned(motion, step.where)
        start, end = to_angles(trajectory(0.0)), to_angles(trajectory(trajectory.duration_s))
        if here.angles_deg is not None and not self.motions.same(here.angles_deg, start):
            raise InputError(
                f"{step.where}run: {motion.name} begins at {self.motions.listed(start)}, but the arm is at "
                f"{here.name or self.motions.listed(here.angles_deg)} ({self.motions.listed(here.angles_deg)})",
                f"put a step before it that goes there: goto with the same file as run, {motion.name!r}",
            )
        leg = self.motions.run(motion, trajectory)
        return [_move(leg, step.step, f"run {motion.name}")], _End(end, f"the end of {motion.name}")

    def _target(self, step: kinds.Goto) -> NamedAngles:
        target = step.target
        if isinstance(target, str):
            target = self.motions.arm.posture(target)
        elif isinstance(target, list | tuple):
            if problem := self.motions.arm.angles_problem(target):
                raise InputError(f"{step.where}goto: {problem}", "give one for each joint with a motor")
            target = ArmPosture(self.motions.listed(target), tuple(target))
        if isinstance(target, ArmPosture):
            return self.motions.posture(target, f"{step.where}goto: ")
        motion = self.motions.motion(target)
        trajectory = self.motions.planned(motion, "")
        return NamedAngles(to_angles(trajectory(0.0)), f"the start of {motion.name}")

    def _still(self, step: kinds.SetOutput | kinds.Wait | kinds.WaitInput | kinds.Count) -> SequenceRow:
        """The row of a step without motion."""
        if isinstance(step, kinds.SetOutput):
            output = self.motions.arm.output(step.output)
            raw = self.motions.arm.outputs[output].raw(step.to)
            return SequenceRow(record.OUTPUT, output, raw, 0, step.step, f"output {step.output} {step.to}")
        if isinstance(step, kinds.Wait):
            return SequenceRow(
                record.WAIT, 0, 0, round(step.wait_s * 1000), step.step, f"wait {step.wait_s:g} s"
            )
        if isinstance(step, kinds.Count):
            if step.counter not in self.counters:
                self.counters.append(step.counter)
            number = self.counters.index(step.counter)
            return SequenceRow(record.COUNT, number, 0, 0, step.step, f"count {step.counter}")
        value = int(step.active) | _THEN.get(step.on_timeout, record.STOP_THEN)
        limit = f", at most {step.timeout_s:g} s, then {step.on_timeout}" if step.timeout_s else ""
        words = f"wait for input {step.input}{'' if step.active else ' not'}{limit}"
        return SequenceRow(
            record.WAIT_INPUT,
            self.motions.arm.input(step.input),
            value,
            round(step.timeout_s * 1000),
            step.step,
            words,
        )


def _move(leg: int, step: int, words: str) -> SequenceRow:
    return SequenceRow(record.MOVE, leg, 0, 0, step, words)
