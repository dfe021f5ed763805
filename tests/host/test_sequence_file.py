"""Sequence files: what they become, and what can be wrong in one."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import armtempo
import numpy as np
import pytest
from armtempo.basics.errors import ArmtempoError, InputError
from armtempo.cli import sequences
from armtempo.encoding import encoded_plan
from armtempo.kinematics.of_arm import forward
from armtempo.model import plan_file, shipped
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import PAUSE_S, Plan
from armtempo.model.sequence import Sequence
from armtempo.planning import via_points
from armtempo.splines.trajectory import Trajectory
from armtempo_shared import sequence as record
from armtempo_shared import sequence_check

FOLDER = shipped.arm_path().parent / "pick_and_place"
ARM = Arm.load(FOLDER / "arm.toml")
POSTURES = """
[posture.a]
angles_deg = [1, -60, 40]
[posture.b]
angles_deg = [2, -60, 40]
"""
JOB = 'name = "j"\npath = "through"\nrefine = 1\niterations = 2\nvia_deg = [[1, -60, 40], [2, -60, 41]]\n'


def written(folder: Path, *steps: str, top: str = "", name: str = "seq") -> Path:
    """A sequence file of these steps, each the inside of a table, and a job file next to it."""
    path = folder / f"{name}.toml"
    rows = "".join(f"[[step]]\n{step}\n" for step in steps)
    path.write_text(f'name = "{name}"\n{top}\n{POSTURES}\n{rows}')
    (folder / "job.toml").write_text(JOB)
    return path


def planned(folder: Path, *steps: str, top: str = 'start = "home"') -> Plan:
    """The plan of such a file."""
    return armtempo.plan_sequence(ARM, Sequence.load(written(folder, *steps, top=top), ARM))


def words(plan: Plan) -> list[str]:
    """What its rows do."""
    return [row.words for row in plan.rows]


def motions(plan: Plan) -> list[Trajectory]:
    """Its different motions."""
    return [leg.trajectory for leg in plan.legs]


def ends(plan: Plan) -> list[tuple[tuple[float, ...], tuple[float, ...]]]:
    """Where each motion begins and ends."""
    return [(tuple(leg(0.0)), tuple(leg(leg.duration_s))) for leg in motions(plan)]


@pytest.mark.slow
def test_where_a_motion_swings_beyond_its_via_points_is_told(tmp_path: Path) -> None:
    path = written(tmp_path, 'run = "job.toml"', "goto = [20, -60, 40]", 'run = "job.toml"')
    swings = JOB.replace("[1, -60, 40], [2, -60, 41]", "[20, -60, 40], [21, -60, 40], [99, -60, 40]")
    (tmp_path / "job.toml").write_text(swings)
    plan = armtempo.plan_sequence(ARM, Sequence.load(path, ARM))
    (note,) = plan.notes
    assert note.startswith("j: between P0 and P1 joint 1 reaches ")
    assert f"note: {note}" in sequences.lines(plan)
    plan.save(tmp_path / "plan.json")
    assert Plan.load(tmp_path / "plan.json").notes == plan.notes
    assert planned(tmp_path, 'goto = "a"', 'run = "job.toml"').notes == ()


@pytest.mark.slow
def test_each_motion_begins_where_the_one_before_it_ends(tmp_path: Path) -> None:
    plan = planned(tmp_path, 'goto = "a"', 'run = "job.toml"', 'goto = "b"', "goto = [1, -60, 40]")
    assert words(plan) == ["goto a", "run job", "goto b", "goto 1, -60, 40°"]
    np.testing.assert_allclose(
        ends(plan),
        [
            [(0, -60, 40), (1, -60, 40)],
            [(1, -60, 40), (2, -60, 41)],
            [(2, -60, 41), (2, -60, 40)],
            [(2, -60, 40), (1, -60, 40)],
        ],
        atol=1e-9,
    )
    assert plan.start_deg == pytest.approx((0, -60, 40))


def test_without_a_start_it_begins_where_its_first_step_leads(tmp_path: Path) -> None:
    assert planned(tmp_path, 'goto = "a"', 'goto = "b"', top="").start_deg == pytest.approx((1, -60, 40))
    assert planned(tmp_path, 'run = "job.toml"', top="").start_deg == pytest.approx((1, -60, 40))
    assert planned(tmp_path, "wait_s = 1", top="").start_deg is None


@pytest.mark.slow
def test_a_goto_in_a_line_moves_the_tool_straight_and_slowly(tmp_path: Path) -> None:
    line = "goto = [6, -60, 40]\nline = true\nspeed_mm_s = 20"
    plan = planned(tmp_path, 'goto = "a"', line, line)
    assert words(plan) == ["goto a", "line to 6, -60, 40°"]
    times = np.linspace(0.0, motions(plan)[1].duration_s, 2001)
    way = forward(ARM, motions(plan)[1](times))[:, :3, 3]
    along = (way[-1] - way[0]) / np.linalg.norm(way[-1] - way[0])
    assert np.abs(np.cross(way - way[0], along)).max() < 0.5
    assert np.linalg.norm(np.diff(way, axis=0), axis=1).max() / times[1] == pytest.approx(20.0, rel=0.01)
    with pytest.raises(InputError, match="give the sequence a start"):
        planned(tmp_path, line, top="")
    with pytest.raises(InputError, match="give line = true too"):
        planned(tmp_path, 'goto = "a"\nspeed_mm_s = 20')


def test_equal_motions_are_planned_and_kept_once(tmp_path: Path) -> None:
    plan = planned(tmp_path, *['goto = "a"', 'goto = "b"'] * 3)
    assert len(plan.legs) == 3
    assert [row.number for row in plan.rows] == [0, 1, 2, 1, 2, 1]


@pytest.mark.slow
def test_the_first_pass_of_a_repeat_may_begin_elsewhere(tmp_path: Path) -> None:
    plan = planned(tmp_path, "repeat = 3", 'goto = "a"', 'goto = "b"', 'end = "repeat"', 'goto = "home"')
    assert words(plan) == [
        "goto a", "goto b", "repeat 3 times", "goto a", "goto b", "end of repeat", "goto home",
    ]  # fmt: skip
    repeat, end = plan.rows[2], plan.rows[5]
    assert (repeat.amount, repeat.value, end.value) == (2, 1, 1)
    assert [row.number for row in plan.rows if row.op == record.MOVE] == [0, 1, 2, 1, 3]
    (cycle,) = plan.cycles
    assert (cycle.times, cycle.share.motions) == (3, 2)
    assert plan.total is not None
    assert plan.total.motions == 7
    whole = sum(motions(plan)[n].duration_s for n in (0, 1, 2, 1, 2, 1, 3)) + 7 * PAUSE_S
    assert plan.total.total_s == pytest.approx(whole)


@pytest.mark.slow
def test_a_repeat_that_begins_where_it_ends_stands_once(tmp_path: Path) -> None:
    steps = 'goto = "b"', "repeat = 3", 'goto = "a"', 'goto = "b"', 'end = "repeat"'
    assert words(planned(tmp_path, *steps)) == [
        "goto b",
        "repeat 3 times",
        "goto a",
        "goto b",
        "end of repeat",
    ]


@pytest.mark.slow
def test_repeats_within_repeats(tmp_path: Path) -> None:
    inner = "repeat = 2", 'goto = "a"', 'goto = "b"', 'end = "repeat"'
    plan = planned(tmp_path, 'repeat = "for ever"', *inner, 'goto = "home"', 'end = "repeat"')
    values = [(row.op, row.value, row.amount) for row in plan.rows if row.op in (record.REPEAT, record.END)]
    assert values == [(5, 0, 0), (5, 0, 1), (6, 0, 0), (6, 1, 0)]
    assert plan.total is None
    assert plan.cycles[0].times == 0
    sequence_check.check(record.SequenceData(encoded_plan.of_plan(plan).data))


def test_outputs_waits_and_inputs(tmp_path: Path) -> None:
    plan = planned(
        tmp_path,
        'output = "gripper"\nto = "closed"\nwait_s = 0.25',
        'output = "gripper"\nto = 180',
        'wait_input = "part"',
        'wait_input = "part"\nactive = false\ntimeout_s = 2\non_timeout = "fault"',
        'wait_input = "part"\ntimeout_s = 2\non_timeout = "next"',
        'wait_input = "part"\ntimeout_s = 2',
    )
    closed = ARM.outputs[0].raw("closed")
    assert [(row.op, row.value, row.amount, row.step) for row in plan.rows] == [
        (record.OUTPUT, closed, 0, 1),
        (record.WAIT, 0, 250, 1),
        (record.OUTPUT, 65535, 0, 2),
        (record.WAIT_INPUT, record.ACTIVE, 0, 3),
        (record.WAIT_INPUT, record.FAULT_THEN, 2000, 4),
        (record.WAIT_INPUT, record.ACTIVE | record.NEXT_THEN, 2000, 5),
        (record.WAIT_INPUT, record.ACTIVE, 2000, 6),
    ]


@pytest.mark.slow
def test_tool_poses_are_solved_when_it_is_planned(tmp_path: Path) -> None:
    """Of the arm file and of the sequence's own; the angles are those of armtempo goto."""
    pose = forward(ARM, (10.0, -55.0, 35.0))[:3, 3]
    position = f"position_mm = {[round(float(value), 6) for value in pose]}"
    source = tmp_path / "arm.toml"
    source.write_text((FOLDER / "arm.toml").read_text() + f"\n[posture.tray]\n{position}\n")
    arm = Arm.load(source)
    path = written(tmp_path, 'goto = "tray"', 'goto = "a"', 'goto = "own"', top='start = "home"')
    path.write_text(path.read_text() + f"\n[posture.own]\n{position}\n")
    plan = armtempo.plan_sequence(arm, Sequence.load(path, arm))
    tray_deg = via_points.posture_deg(arm, arm.posture("tray"))
    assert words(plan) == ["goto tray", "goto a", "goto own"]
    np.testing.assert_allclose(ends(plan)[0][1], tray_deg, atol=1e-9)
    np.testing.assert_allclose(ends(plan)[2][1], tray_deg, atol=1e-9)
    assert plan.rows[0].number == 0


def test_a_tool_pose_that_cannot_be_reached_names_the_step(tmp_path: Path) -> None:
    path = written(tmp_path, 'goto = "a"', 'goto = "far"')
    path.write_text(path.read_text() + "\n[posture.far]\nposition_mm = [0, 0, 3000]\n")
    with pytest.raises(ArmtempoError, match=r"posture\.far: 3000 mm from the base"):
        armtempo.plan_sequence(ARM, Sequence.load(path, ARM))
    path.write_text(path.read_text().replace("[0, 0, 3000]", "[0, 0, -450]"))
    with pytest.raises(ArmtempoError, match=r"step\[2\]\.goto: posture 'far'"):
        armtempo.plan_sequence(ARM, Sequence.load(path, ARM))


def test_a_counter_is_one_by_its_name(tmp_path: Path) -> None:
    written(tmp_path, 'count = "parts"', 'count = "called"', name="other")
    plan = planned(
        tmp_path,
        "repeat = 2",
        'goto = "a"',
        'count = "trays"',
        'call = "other.toml"',
        'count = "parts"',
        'end = "repeat"',
    )
    assert plan.counters == ("trays", "parts", "called")
    data = record.SequenceData(encoded_plan.of_plan(plan).data)
    assert [data.counter(number) for number in range(data.counters)] == [b"trays", b"parts", b"called"]
    counted = [row.words for row in plan.rows if row.op == record.COUNT]
    assert counted == ["count trays", "count parts", "count called", "count parts"] * 2
    plan.save(tmp_path / "seq.json")
    assert Plan.load(tmp_path / "seq.json").counters == plan.counters


def test_more_counters_than_the_board_keeps_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="9 counters; the board keeps 8"):
        planned(tmp_path, *(f'count = "c{number}"' for number in range(9)))


@pytest.mark.slow
def test_a_called_sequence_stands_in_its_place(tmp_path: Path) -> None:
    written(tmp_path, 'goto = "b"', 'goto = "a"', name="inner")
    plan = planned(tmp_path, 'goto = "a"', 'call = "inner.toml"')
    assert [(row.words, row.step) for row in plan.rows] == [("goto a", 1), ("goto b", 2), ("goto a", 2)]


def test_goto_leads_to_where_a_motion_begins(tmp_path: Path) -> None:
    plan = planned(tmp_path, 'goto = "job.toml"', 'run = "job.toml"')
    assert words(plan) == ["goto the start of job", "run job"]


@pytest.mark.parametrize(
    ("steps", "said"),
    [
        (['goto = "c"'], r"step\[1\]\.goto = 'c': no such posture"),
        (['goto = "hom"'], "did you mean 'home'"),
        (["goto = [0, -60]"], r"step\[1\]\.goto"),
        (["goto = [0, -60, 400]"], "range of joint 3"),
        (["goto = 5"], r"step\[1\]\.goto"),
        (['gotto = "a"'], r"step\[1\]\.gotto: unknown key; did you mean 'goto'"),
        (["to = 1"], r"step\[1\]\.: says nothing"),
        (['goto = "a"\nrun = "job.toml"'], "says goto and run"),
        (['goto = "a"\nwait_s = 1'], "says goto and wait_s"),
        (['goto = "a"\ntimeout_s = 1'], "timeout_s = 1 is not allowed here; leave it out beside goto"),
        (['run = "none.toml"'], "none.toml: no such file"),
        (['output = "griper"\nto = 1'], r"step\[1\].*no output 'griper'.*gripper"),
        (['output = "gripper"'], "to is missing"),
        (['output = "gripper"\nto = 200'], r"step\[1\].*cannot take 200"),
        (['output = "gripper"\nto = "opn"'], r"step\[1\].*no state 'opn'.*open"),
        (['output = "gripper"\nto = true'], "to = True is not allowed"),
        (["wait_s = 0"], "wait_s = 0 is not allowed"),
        (["wait_s = 4000"], "wait_s = 4000 is not allowed"),
        (['wait_input = "door"'], r"step\[1\].*no input 'door'"),
        (['wait_input = "part"\non_timeout = "next"'], "leave it out, or give timeout_s too"),
        (['wait_input = "part"\ntimeout_s = 1\non_timeout = "go"'], "on_timeout = 'go' is not allowed"),
        (["repeat = 0", "wait_s = 1", 'end = "repeat"'], "repeat = 0 is not allowed"),
        (['repeat = "ever"', "wait_s = 1", 'end = "repeat"'], "repeat = 'ever': arm .* has no pallet .ever."),
        (["repeat = 2", "wait_s = 1"], "repeat without an end"),
        (["wait_s = 1", 'end = "repeat"'], "end = 'repeat' is not allowed here; write it after"),
        (["repeat = 2", 'end = "repeat"'], "nothing is repeated"),
        (["repeat = 2"] * 5 + ["wait_s = 1"] + ['end = "repeat"'] * 5, "at most 4 within each other"),
        (['call = "seq.toml"'], "calls itself: seq.toml calls seq.toml"),
        (['call = "job.toml"'], "is not a sequence"),
        (
            ['goto = "b"', 'run = "job.toml"'],
            r"step\[2\]\.run: job begins at 1, -60, 40°, but the arm is at b",
        ),
        (["repeat = 2", 'run = "job.toml"', 'end = "repeat"'], r"step\[2\]\.run: job begins at"),
        (['goto = "home"'], "the sequence has no effect"),
        (["wait_s = 1"] * 501, "501 rows"),
    ],
)
def test_what_is_wrong_is_named(steps: list[str], said: str, tmp_path: Path) -> None:
    start = 'start = "home"' if steps[0] != "repeat = 2" or "run" not in steps[1] else 'start = "a"'
    with pytest.raises(InputError) as caught:
        planned(tmp_path, *steps, top=start)
    assert re.search(said, str(caught.value)), caught.value
    assert str(tmp_path) in str(caught.value)


def test_sequences_that_call_each_other_are_refused(tmp_path: Path) -> None:
    written(tmp_path, 'call = "seq.toml"', name="inner")
    with pytest.raises(InputError, match=r"calls itself: seq.toml calls inner.toml calls seq.toml"):
        planned(tmp_path, 'call = "inner.toml"')


@pytest.mark.parametrize(
    ("top", "said"),
    [
        ('start = "c"', "start = 'c': no such posture"),
        ('begin = "a"', "begin: unknown key"),
        ("[posture.home]\nangles_deg = [0, 0, 0]", "posture.home already exists"),
        ("[posture.d]\nangles_deg = [0, 0]", r"posture.d.angles_deg"),
        ("[posture.d]\nangels_deg = [0, 0, 0]", "exactly one of angles_deg"),
    ],
)
def test_what_is_wrong_at_its_head_is_named(top: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        planned(tmp_path, "wait_s = 1", top=top)


def test_a_name_that_leaves_no_room_for_the_motions_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, "wait_s = 1", name="n" * 21)
    with pytest.raises(InputError, match="at most 20"):
        Sequence.load(path, ARM)


def test_the_file_of_a_plan_holds_all_of_it(tmp_path: Path) -> None:
    plan = planned(tmp_path, 'goto = "a"', 'output = "gripper"\nto = "open"', "wait_s = 0.5")
    path = tmp_path / "seq.json"
    plan.save(path)
    again = Plan.load(path)
    assert encoded_plan.of_plan(again).data == encoded_plan.of_plan(plan).data
    assert again.total == plan.total
    plan.save(path)  # an earlier plan of the same sequence gives way
    with pytest.raises(InputError, match="exists with other content"):
        replace(plan, name="other").save(path)
    content = json.loads(path.read_text())
    content["sequence"]["rows"][0]["number"] = 7
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=r"altered .* --altered"):
        Plan.load(path)
    with pytest.raises(InputError, match="a motion or counter that does not exist"):
        Plan.load(path, altered=True)
    with pytest.raises(InputError, match="exists with other content"):
        plan.save(path)  # what somebody altered is not thrown away
    path.write_text(path.read_text()[:-50])
    with pytest.raises(InputError, match="damaged or cut"):
        Plan.load(path)


def test_one_plan_type_reads_both_files_and_takes_no_sequence_for_a_motion(tmp_path: Path) -> None:
    plan = planned(tmp_path, 'goto = "a"', "wait_s = 1")
    plan.save(tmp_path / "seq.json")
    motion = armtempo.plan(ARM, Job.load(tmp_path / "job.toml", ARM))
    motion.save(tmp_path / "j.json")
    found = [Plan.load(tmp_path / name) for name in ("seq.json", "j.json")]
    assert [(each.name, each.is_sequence, len(each.legs)) for each in found] == [
        (plan.name, True, 1),
        (motion.name, False, 1),
    ]
    assert [row.words for row in found[1].rows] == [f"run {motion.name}"]
    for of_a_motion in ("trajectory", "total_s", "job", "via_deg", "searches", "extremes"):
        getattr(found[1], of_a_motion)
        with pytest.raises(InputError, match=r"is a sequence"):
            getattr(found[0], of_a_motion)
    with pytest.raises(InputError, match=r"seq\.json: is the plan of a sequence, not of a motion"):
        planned(tmp_path, 'run = "seq.json"')


def test_each_leg_of_a_file_has_its_load_or_none_has(tmp_path: Path) -> None:
    path = tmp_path / "seq.json"
    planned(tmp_path, 'goto = "a"', 'goto = "home"').save(path)
    content = json.loads(path.read_text())["sequence"]
    for loads, fits in (([], True), (["", ""], True), ([""], False)):
        changed = {**content, "loads": loads}
        head = {"format": "armtempo sequence", "version": 2, "sha256": plan_file.checksum(changed)}
        path.write_text(json.dumps({**head, "sequence": changed}))
        if fits:
            assert [leg.load for leg in Plan.load(path).legs] == ["", ""]
        else:
            with pytest.raises(InputError, match="an entry for each of 2 motions"):
                Plan.load(path)


def test_a_plan_of_another_arm_is_no_leg(tmp_path: Path) -> None:
    motion = armtempo.plan(Arm.paper(), Job.load(written(tmp_path, "wait_s = 1").parent / "job.toml", ARM))
    motion.save(tmp_path / "j.json")
    with pytest.raises(ArmtempoError, match="a different arm"):
        planned(tmp_path, 'goto = "a"', 'run = "j.json"')


def test_every_damage_of_a_record_is_seen(tmp_path: Path) -> None:
    data = encoded_plan.of_plan(planned(tmp_path, 'goto = "a"', "wait_s = 1")).data
    record.SequenceData(data)
    for at in range(len(data)):
        for damaged in (data[:at], data[:at] + bytes([data[at] ^ 0x40]) + data[at + 1 :]):
            with pytest.raises(record.SequenceError):
                record.SequenceData(damaged)


def test_the_shipped_arm_is_the_papers_with_a_gripper() -> None:
    """Its file is complete by itself, for users who copy it; what both say must not differ."""
    paper = Arm.paper()
    assert (ARM.joints, ARM.driver, ARM.safety) == (paper.joints, paper.driver, paper.safety)


@pytest.mark.slow
def test_the_shipped_sequence_plans() -> None:
    sequence = Sequence.load(FOLDER / "sequence.toml", ARM)
    plan = armtempo.plan_sequence(ARM, sequence)
    assert plan.start_deg == pytest.approx(ARM.home_deg)
    assert len({leg.name for leg in motions(plan)}) == len(plan.legs) == 8
