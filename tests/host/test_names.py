"""Names that other programs would take for something else, and columns below their heads however long names are."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.basics.text import aligned
from armtempo.cli import main, stored
from armtempo.diagnosis.finding import Finding, Level
from armtempo.encoding import encoded_plan
from armtempo.link import board_messages
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.planning import planner, rest_to_rest
from armtempo.report import drawing, plots, run_folder, run_report, text_summary
from armtempo.report.replayed import results
from armtempo.report.run_folder import Repetition
from armtempo.report.run_reader import RunData
from armtempo_shared import wire
from click.testing import CliRunner

from tests import interpreters, sources
from tests.host import made_runs

FORMULAS = ("$$", r"$\theta$", r"_a^{b}\frac")
CONTROL = ("\x1b[31mred", "bell\x07", "two\nlines", "back\b", "\x9b31m", "\u202etxt.exe")
NAMES = ("waist", "the shoulder of the arm", "elbow")


def named(*names: str) -> Plan:
    """The shipped plan with these names for its driven joints."""
    left = iter(names)
    whole = made_runs.shipped_plan()
    joints = [replace(joint, name=next(left)) if joint.motor else joint for joint in whole.arm.joints]
    return replace(whole, arm=replace(whole.arm, name=names[0], joints=tuple(joints)))


def shown_safely(text: str) -> bool:
    """Whether there is nothing in it that steers a terminal or changes the direction of writing."""
    return all(char.isprintable() or char == "\n" for char in text)


@pytest.mark.long
@pytest.mark.slow
def test_formulas_and_control_characters_are_text_in_a_report(tmp_path: Path) -> None:
    path = made_runs.make(tmp_path / "run", repetitions=1)
    meta = json.loads((path / "run.json").read_text())
    meta["name"] = meta["port"] = CONTROL[0] + CONTROL[-1]
    for joint, name in zip(meta["joints"], (FORMULAS[0], FORMULAS[1] + CONTROL[0], FORMULAS[2]), strict=True):
        joint["name"] = name
    (path / "run.json").write_text(json.dumps(meta))
    result = CliRunner().invoke(main, ["report", str(path)])
    assert result.exit_code == 0, result.output
    assert shown_safely(result.output)
    drawn = {file.stem: file.read_text() for file in path.glob("*.svg")}
    assert set(drawn) == {"tracking", "errors", "convergence", "postures"}
    page = (path / run_report.PAGE).read_text()
    assert all(shown_safely(text) for text in (page, *drawn.values()))
    for name in FORMULAS:
        assert f">{name}" in drawn["tracking"]
        assert f">{name}" in page
    assert f"> {FORMULAS[2]}</text>" in drawn["convergence"]  # its line is in the legend


@pytest.mark.slow
def test_a_name_with_an_underscore_first_is_in_a_comparison_s_legend() -> None:
    line = np.arange(3.0)
    drawn = plots.overlay({name: (line, np.zeros((3, 3)), line) for name in ("$$", "_other")})
    text = drawing.inline_svg(drawn, "x", "")
    assert "> _other</text>" in text
    assert ">$$</text>" in text


@pytest.mark.parametrize("name", CONTROL)
def test_an_arm_file_with_control_characters_in_a_name_is_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / "arm.toml"
    text = shipped.files()[shipped.PAPER].read_text(encoding="utf-8")
    path.write_text(text.replace('"joint 2"', json.dumps(name), 1), encoding="utf-8")
    result = CliRunner().invoke(main, ["plan", "--arm", str(path), "-o", str(tmp_path / "x.json")])
    assert result.exit_code == 2
    assert "without control characters" in result.stderr
    assert shown_safely(result.output)


def test_other_alphabets_are_names(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    text = shipped.files()[shipped.PAPER].read_text(encoding="utf-8")
    path.write_text(text.replace('"joint 2"', '"Schulter – плечо 肩"', 1), encoding="utf-8")
    assert Arm.load(path).driven[1].name == "Schulter – плечо 肩"


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in CONTROL if "\n" not in name])
def test_a_trajectory_file_with_them_is_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / "x.json"
    named("a", "b", "c").save(path)
    content = json.loads(path.read_text())
    content["plan"]["arm"]["joints"][0]["name"] = name
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match="control characters") as caught:
        Plan.load(path, altered=True)
    assert shown_safely(str(caught.value))


def test_what_a_board_says_cannot_steer_the_terminal() -> None:
    entry = wire.EVENT["notice"]
    payload = wire.encode(entry, (), "loud\x07 \x1b]0;title\x07")
    heard = board_messages.event(entry[1], payload)
    assert isinstance(heard, board_messages.Notice)
    assert heard.text == r"loud\x07 \x1b]0;title\x07"


@pytest.fixture(params=[NAMES, ("a", "b", "c")])
def made(request: pytest.FixtureRequest) -> Plan:
    """The shipped plan with other names of the joints."""
    plan = made_runs.shipped_plan()
    names = dict(zip((joint.name for joint in plan.arm.driven), request.param, strict=True))
    joints = tuple(replace(joint, name=names.get(joint.name, joint.name)) for joint in plan.arm.joints)
    return replace(plan, arm=replace(plan.arm, joints=joints))


def test_rows_are_filled_up_to_the_widths_and_what_is_longer_widens_its_column() -> None:
    assert aligned([("ab", "1"), ("", "23")], (4, 3)) == ["ab    1", "     23"]
    rows = [("joint", "s", "x"), ("a long name", "12345", "1"), ("b", "1", "1")]
    assert aligned(rows, (6, 3, 3)) == [
        "joint           s  x",
        "a long name 12345  1",
        "b               1  1",
    ]


@pytest.mark.slow
def test_a_plan_of_joints_with_long_names(made: Plan) -> None:
    table = text_summary.lines(made)[1:6]
    assert len({len(line) for line in table}) == 1
    _, units, *rows = table
    ends = [found.end() for found in re.finditer(r"\S+", units)]
    assert all(row[end - 1] != " " and f"{row} "[end] == " " for row in rows for end in ends)
    assert [row[: len(joint.name) + 1] for row, joint in zip(rows, made.arm.driven, strict=True)] == [
        f"{joint.name} " for joint in made.arm.driven
    ]


@pytest.mark.slow
def test_a_plan_tells_of_coarse_steps(made: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    coarse = Finding(Level.WARNING, "waist", "a step is 1.8°", "use more microsteps")
    monkeypatch.setattr(text_summary, "coarse_steps", lambda arm: [coarse])
    assert (
        text_summary.lines(made)[-1] == f"{Level.WARNING.value}: waist: a step is 1.8°; use more microsteps"
    )


@pytest.mark.long
def test_a_plan_on_the_spline_tells_what_is_faster_if_it_loses_much_to_it() -> None:
    """Short approaches, as of a pick, between which the spline swings."""
    via = [[0, -60, 40], [0, -60, 42], [90, -70, 42], [90, -70, 40]]
    slow = planner.plan(Arm.paper(), Job("pick", via_deg=via, path="through", optimiser="gradient", starts=1))
    (told,) = [line for line in text_summary.lines(slow) if "takes" in line]
    free_s, stopping_s = (float(each) for each in re.findall(r"takes ([\d.]+) s", told))
    assert told.startswith('path = "free" takes')
    assert free_s < stopping_s < slow.total_s / 1.03
    legs = [
        max(
            rest_to_rest.lower_bound_s(np.array(ends), joint.limits)
            for ends, joint in zip(zip(here, there, strict=True), slow.arm.driven, strict=True)
        )
        for here, there in pairwise(np.array(via, dtype=float))
    ]
    assert stopping_s == pytest.approx(sum(legs), abs=1e-4)
    free = replace(slow, job=replace(slow.job, path="free"))
    assert not any("takes" in line for line in text_summary.lines(free))


@pytest.mark.slow
def test_a_path_that_swings_beyond_its_via_points_is_told_with_joint_place_and_degrees() -> None:
    """Uneven distances: the spline goes the wrong way first."""
    via = [[20, -60, 40], [21, -60, 40], [120, -60, 40]]
    arm = Arm.paper()
    swung = planner.plan(arm, Job("swing", via_deg=via, path="through", optimiser="gradient", starts=1))
    (note,) = [each for each in swung.notes if "beyond both" in each]
    assert note.startswith("between P0 and P1 joint 1 reaches ")
    assert note.endswith('path = "free" helps')
    reached, beyond = (
        float(each) for each in re.search(r"reaches (\S+) degrees, (\S+) beyond", note).groups()
    )
    assert reached == pytest.approx(
        swung.trajectory(np.linspace(0.0, swung.total_s, 4000))[:, 0].min(), abs=0.01
    )
    assert beyond == pytest.approx(20.0 - reached, abs=0.06)
    assert not any("beyond both" in each for each in planner.plan(arm, Job("free", via_deg=via)).notes)


def test_results_and_times_of_joints_with_long_names(made: Plan) -> None:
    motion = encoded_plan.of_plan(made)
    scales = run_folder.scales(made.arm)
    steps = tuple(-1_234_567 for _ in scales)
    run = RunData(Path(), {}, scales, (), (Repetition("", commanded_steps=steps, counts=steps),))
    lines = text_summary.result_lines(results(run, made.trajectory))
    assert len({len(line) for line in lines}) == 1
    assert all(f"{joint.name} " in line for joint, line in zip(made.arm.driven, lines[2:], strict=True))
    times = stored.motion_lines(motion, [1.0] * len(scales))[3:]
    assert len({line.index(" s, up to") for line in times}) == 1


SENTENCES = (
    "is taken as this",
    "moving in a pause",
    "lets nobody watch",
    "points apart by",
    "turn to turn",
    "the best nearby",
    "with the tool there",
    "is not the server's",
    "as far as it was measured",
    "can look at them",
    "Is there while",
    "version of machine",
    "the board does {",  # a limit, without what it is a limit of
)
"""Parts of sentences that had to be read twice."""


@pytest.mark.slow
@sources.TOGETHER
def test_sentences_that_had_to_be_read_twice_are_gone() -> None:
    texts = [
        path
        for folder in ("host", "shared", "board")
        for path in (interpreters.ROOT / folder).rglob("*")
        if path.suffix in (".py", ".md", ".js", ".html", ".txt") and "_build" not in path.parts
    ]
    assert len(texts) > 300
    found = [
        f"{path}: {one}" for path in texts for one in SENTENCES if one in path.read_text(encoding="utf-8")
    ]
    assert found == []
