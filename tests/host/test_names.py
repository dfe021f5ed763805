"""Names that other programs would take for something else: formulas, terminal control, directions of writing."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.cli import main
from armtempo.link import board_messages
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.report import drawing, plots, run_report
from armtempo_shared import wire
from click.testing import CliRunner

from tests.host import made_runs

FORMULAS = ("$$", r"$\theta$", r"_a^{b}\frac")
CONTROL = ("\x1b[31mred", "bell\x07", "two\nlines", "back\b", "\x9b31m", "\u202etxt.exe")


def named(*names: str) -> Plan:
    """The shipped plan with these names for its driven joints."""
    left = iter(names)
    whole = made_runs.shipped_plan()
    joints = [replace(joint, name=next(left)) if joint.motor else joint for joint in whole.arm.joints]
    return replace(whole, arm=replace(whole.arm, name=names[0], joints=tuple(joints)))


def shown_safely(text: str) -> bool:
    """Whether there is nothing in it that steers a terminal or changes the direction of writing."""
    return all(char.isprintable() or char == "\n" for char in text)


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
