"""A user's program for the board: its record, with the arm's names in the board's numbers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from armtempo_shared import program
from armtempo_shared.limits import FULL_OUTPUT, MAX_MOTION_BYTES
from armtempo_shared.wire import record_crc

from armtempo.basics.arrays import Array
from armtempo.basics.errors import ArmtempoError, InputError, PlanError
from armtempo.encoding import encode, encoded_plan, made_with
from armtempo.encoding.encoded_plan import Encoded, MotionKey
from armtempo.kinematics.chain import all_angles_deg
from armtempo.kinematics.of_arm import forward
from armtempo.model import home_switches, program_calls
from armtempo.model.arm import Arm
from armtempo.model.home_switches import HomeSwitch
from armtempo.model.outputs import SWITCH, Output
from armtempo.model.pallet import ArmPallet
from armtempo.model.parts import DrivenJoint
from armtempo.model.plan import Plan
from armtempo.model.posture import HOME
from armtempo.model.user_program import UserProgram
from armtempo.planning import point_to_point, via_points, workspace_check

Places = dict[str, dict[str, list[tuple[Array, Array]]]]
"""By pallet and tool: the driven joints' angles above each place and at it, degrees, (J,) each."""
_SAMPLES = 41


@dataclass(frozen=True, eq=False)
class EncodedProgram:
    """A program that the board stores and runs."""

    program: UserProgram
    arm: Arm
    motions: tuple[Encoded, ...]
    """Those that are uploaded with it."""
    data: bytes
    """The program record (layout: ``armtempo_shared.program``)."""
    places: Places = field(default_factory=dict)

    @property
    def key(self) -> MotionKey:
        """Its identification on the board."""
        return MotionKey(self.program.name, record_crc(self.data))

    @property
    def records(self) -> tuple[tuple[str, bytes], ...]:
        """What the board stores, the motions first: names and records."""
        return (*((motion.name, motion.data) for motion in self.motions), (self.program.name, self.data))

    @property
    def heap_bytes(self) -> int:
        """Heap that it needs on the board."""
        return program.needed_bytes(len(self.program.marked.encode()), bool(self.program.homes))


def motions_beside(found: UserProgram, arm: Arm) -> tuple[Encoded, ...]:
    """The motions that a program names and whose plans are beside it; InputError for one that does not fit the arm."""
    files = {name: found.motion_file(name) for name in found.motions}
    plans = {name: Plan.load_motion(file) for name, file in files.items() if file.is_file()}
    for name, plan in plans.items():
        made_with.check_plan(files[name], plan, arm)
    return tuple(encoded_plan.of_plan(plan, name) for name, plan in plans.items())


def of_program(
    found: UserProgram, arm: Arm, motions: tuple[Encoded, ...] = (), stored: tuple[MotionKey, ...] = ()
) -> EncodedProgram:
    """Encode a program for ``arm``; ``stored``: motions that it runs and the board has.

    Raises InputError if it is too large for the board.
    """
    keys = [*(motion.key for motion in motions), *stored]
    crcs = {key.name: key.crc for key in keys}
    places = places_of(arm, found)
    known = table(arm, found, places)
    contents = {"file": found.file, "motions": crcs, "counters": [*found.counters], **known}
    packed = rows(arm, places)
    try:
        data = program.pack(record_crc(encode.arm_record(arm)), contents, found.marked, packed)
    except program.ProgramError:
        its = f" and {len(packed)} places of pallets" if packed else ""
        raise InputError(
            f"{found.path}: the program and the arm's names{its} take more than the {MAX_MOTION_BYTES} bytes of the "
            "board",
            "make it shorter" + (", or the pallets smaller" if packed else ""),
        ) from None
    return EncodedProgram(found, arm, motions, data, places)


def table(arm: Arm, found: UserProgram, places: Places) -> dict[str, Any]:
    """What the cell of a program must know of an arm, see ``armtempo_shared.program``.

    Postures that the arm cannot take are left out. Raises InputError for an arm with coupled joints: the board knows
    its motors, but no limits of its joints.
    """
    if arm.coupling:
        raise InputError(
            f"arm {arm.name!r} has coupled joints: the board cannot make moves for it",
            "let the host move it (board.goto, 'armtempo run'), or plan a sequence",
        )
    bare = _postures(arm)
    return {
        "limits": encode.move_limits(arm),
        "per_deg": [joint.steps_per_deg for joint in arm.driven],
        "postures": bare,
        "outputs": {
            output.name: [number, *output.range, _states(output)] for number, output in enumerate(arm.outputs)
        },
        "inputs": {entry.name: number for number, entry in enumerate(arm.inputs)},
        "pallets": _shapes(arm, places),
        "tools": {tool: _others(bare, _postures(arm.with_tool(tool))) for tool in found.tools},
        "homing": _homing(arm) if found.homes else {},
        **({"taken": program_calls.taken(arm)} if found.takes else {}),
    }


def _homing(arm: Arm) -> dict[str, Any]:
    """How the board homes an arm by itself (``armtempo_shared.program``)."""
    return {
        "fast": encode.move_limits(arm, home_switches.FAST),
        "slow": encode.move_limits(arm, home_switches.SLOW),
        "groups": [
            [_home_switch(arm.driven[joint], joint, switch) for joint, switch in group.items()]
            for group in home_switches.groups(arm)
        ],
        "names": home_switches.names(arm),
    }


def _home_switch(joint: DrivenJoint, number: int, switch: HomeSwitch) -> list[int]:
    _, side, *lengths_deg = switch.row(number)
    return [number, int(side), *(round(each * joint.steps_per_deg) for each in lengths_deg)]


def _others(bare: dict[str, list[int]], now: dict[str, list[int]]) -> dict[str, list[int]]:
    """The postures that are others with a tool; [] for one that cannot be taken with it."""
    return {name: now.get(name, []) for name in bare.keys() | now.keys() if now.get(name) != bare.get(name)}


def places_of(arm: Arm, found: UserProgram) -> Places:
    """The joints' angles at all places of the pallets that a program names, with each of its tools, and without.

    A program with tools may have pallets that are out of reach without one. Raises PlanError, with the program's line,
    row, column and layer, for another place that the arm cannot take.
    """
    pallets: Places = {}
    for name, line in found.pallets.items():
        pallets[name] = {}
        for tool in ("", *found.tools):
            try:
                pallets[name][tool] = _places(arm.with_tool(tool), arm.pallet(name))
            except ArmtempoError as error:
                if found.tools and not tool:
                    continue
                with_tool = f", with tool {tool!r}" if tool else ""
                raise type(error)(
                    f"{found.path}, line {line}{with_tool}: {error.problem}", error.hint
                ) from error
    return pallets


def rows(arm: Arm, places: Places) -> list[list[int]]:
    """The places as ``armtempo_shared.program.pack`` takes them."""
    whole = arm.transmission.whole_steps
    return [
        [*whole(above), *whole(at)]
        for with_tools in places.values()
        for each in with_tools.values()
        for above, at in each
    ]


def _shapes(arm: Arm, places: Places) -> dict[str, list[Any]]:
    """Rows, columns, layers of each pallet, and the numbers of its first places in ``rows``."""
    found: dict[str, list[Any]] = {}
    number = 0
    for name, with_tools in places.items():
        firsts = {}
        for tool, each in with_tools.items():
            firsts[tool] = number
            number += len(each)
        pallet = arm.pallet(name)
        found[name] = [pallet.rows, pallet.columns, pallet.layers, firsts]
    return found


def _places(arm: Arm, pallet: ArmPallet) -> list[tuple[Array, Array]]:
    """The joints' angles above each place and at it, the solution nearest to those above: degrees, (J,) each."""
    found = []
    for place in via_points.places(arm, pallet):
        try:
            at = via_points.nearest(arm, place.pose, place.above_deg)
        except ArmtempoError as error:
            raise type(error)(f"{place.name}: {error.problem}", error.hint) from error
        found.append((np.array(place.above_deg), at))
    return found


def _postures(arm: Arm) -> dict[str, list[int]]:
    found = {}
    for name in (HOME, *(posture.name for posture in arm.postures)):
        try:
            found[name] = arm.transmission.whole_steps(via_points.posture_deg(arm, arm.posture(name)))
        except ArmtempoError:
            continue
    return found


def _states(output: Output) -> dict[str, int]:
    states = {name: output.raw(name) for name, _ in output.states}
    return {"off": 0, "on": FULL_OUTPUT, **states} if output.kind == SWITCH else states


def moves_that_touch(found: EncodedProgram) -> list[str]:
    """What is wrong with straight moves between the postures that the program names and the ends of its motions.

    And with those between them and what is above the places of its pallets, and from there to the places: with each
    tool that it names, and without; and with the ways to the switches, if it homes the arm. The board knows nothing of
    the workspace; which of these moves the program makes is not known either.
    """
    problems = workspace_check.touching(found.arm) if found.program.homes else []
    for tool in ("", *found.program.tools):
        arm = found.arm.with_tool(tool)
        if workspace_check.can_touch(arm):
            problems += [
                f"with tool {tool!r} {each}" if tool else each for each in _touching(found, arm, tool)
            ]
    return problems


def _touching(found: EncodedProgram, arm: Arm, tool: str) -> list[str]:
    ends: dict[str, Array] = {}
    for name in found.program.postures:
        try:
            ends[f"posture {name!r}"] = via_points.posture_deg(arm, arm.posture(name))
        except ArmtempoError:
            continue  # the program cannot go there with this tool
    for motion in found.motions:
        ends[f"the start of {motion.name!r}"] = motion.trajectory(0.0)
        ends[f"the end of {motion.name!r}"] = motion.trajectory(motion.trajectory.duration_s)
    names = [*ends]
    moves = [
        (here, ends[here], there, ends[there])
        for number, here in enumerate(names)
        for there in names[number + 1 :]
    ]
    for name, with_tools in found.places.items():
        pallet = arm.pallet(name)
        for number, (above, at) in enumerate(with_tools.get(tool, ()), 1):
            place = pallet.describe(number)
            moves.append((f"above {place}", above, "the place", at))
            moves += [(here, ends[here], f"above {place}", above) for here in names]
    problems = []
    for here, start, there, end in moves:
        try:
            point_to_point.check_switches(start, end, arm)
            workspace_check.check(arm, point_to_point.straight("goto", start, end, arm))
        except PlanError as error:
            problems.append(f"between {here} and {there}: {error.problem}")
    return problems


def off_line_mm(found: EncodedProgram) -> float:
    """How far the tool is at most beside the straight lines from above the places of its pallets to them."""
    most = 0.0
    for with_tools in found.places.values():
        for tool, places in with_tools.items():
            arm = found.arm.with_tool(tool)
            for above, at in places:
                joints = above + np.linspace(0.0, 1.0, _SAMPLES)[:, None] * (at - above)
                points = forward(arm, all_angles_deg(arm, joints))[:, :3, 3]
                line = (points[-1] - points[0]) / np.linalg.norm(points[-1] - points[0])
                beside = points - points[0] - ((points - points[0]) @ line)[:, None] * line
                most = max(most, float(np.linalg.norm(beside, axis=1).max()))
    return most


class _Record(program.ProgramRecord):
    """A record in memory."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        super().__init__(len(data))

    def part(self, offset: int, size: int) -> bytes:
        """See ``ProgramRecord``."""
        return self._data[offset : offset + size]


def motions_of(data: bytes) -> list[str]:
    """The motions that a stored program runs; none of one that is damaged."""
    try:
        return [*_Record(data).table()["motions"]]
    except ValueError:
        return []


def check_stored(name: str, data: bytes, arm: Arm) -> None:
    """Raise InputError if a posture in the text of a program on the board, or one of its pallets, is elsewhere now."""
    try:
        record = _Record(data)
        change = _change(record, record.table(), arm)
    except ValueError:  # the board says what is wrong with it
        return
    if change:
        raise InputError(f"{name!r} on the board is old: {change}", "upload its file again")


def _change(record: _Record, then: dict[str, Any], arm: Arm) -> str:
    source = record.source()
    named = {name: steps for name, steps in then["postures"].items() if name in source}
    if then.get("homing") and then["homing"] != _homing(arm):
        return "homing is another now"
    for tool, others in ("", {}), *then.get("tools", {}).items():
        try:
            now = _postures(arm.with_tool(tool))
        except InputError:
            return f"tool {tool!r} is gone"
        for name, steps in named.items():
            if now.get(name, []) != others.get(name, steps):
                return f"posture {name!r} is elsewhere now" + (f", with tool {tool!r}" if tool else "")
    whole = arm.transmission.whole_steps
    for name, (rows, columns, layers, firsts) in then.get("pallets", {}).items():
        try:
            pallet = arm.pallet(name)
            same = (pallet.rows, pallet.columns, pallet.layers) == (rows, columns, layers)
            for tool, first in firsts.items() if same else ():
                places = _places(arm.with_tool(tool), pallet)
                same = same and all(
                    record.place(number, len(arm.driven)) == (*whole(above), *whole(at))
                    for number, (above, at) in enumerate(places, first)
                )
        except ArmtempoError:
            same = False
        if not same:
            return f"pallet {name!r} is elsewhere now, or gone"
    return ""
