"""Plans of a frame that is elsewhere since: refused before a port is opened."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from armtempo import pipeline
from armtempo.basics import toml_table
from armtempo.basics.errors import InputError
from armtempo.kinematics.of_arm import forward
from armtempo.model.arm import Arm
from armtempo.model.plan import Plan
from armtempo.model.sequence import Sequence
from armtempo.robot import arm_state
from armtempo.robot.connection import Connection

from tests.host.test_frames import FRAMES, arm_file, cli, job, place_of
from tests.host.test_taught_frames import postures

# plans that are old


def moved(folder: Path, old: str, new: str) -> Arm:
    """The arm after a change of its file."""
    path = folder / "arm.toml"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return Arm.load(path)


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Plan, Plan]:
    """A motion and a sequence with a pose in the tray."""
    folder = tmp_path_factory.mktemp("planned")
    place = place_of(Arm.load(arm_file(folder)), [20.0, -55.0, 30.0], "tray")
    posture = f'\n[posture.over]\nframe = "tray"\nposition_mm = {place}\n'
    arm = Arm.load(arm_file(folder, FRAMES + posture))
    text = f'frame = "tray"\n[[via]]\nposture = "home"\n[[via]]\nposition_mm = {place}\n'
    plan = pipeline.plan(arm, replace(job(text, arm), path="through", population=4, iterations=1, refine=1))
    np.testing.assert_allclose(
        forward(arm, plan.trajectory(plan.total_s))[:3, 3], forward(arm, [20, -55, 30])[:3, 3], atol=0.15
    )
    steps = 'name = "s"\nstart = "home"\n[[step]]\ngoto = "over"\n'
    sequence = Sequence.of_table(toml_table.parse(steps, "s.toml"), arm)
    return plan, pipeline.plan_sequence(arm, sequence)


def loaded(plan: Plan, sequence: Plan, arm: Arm, folder: Path) -> list[Callable[[], object]]:
    """The ways in which a plan meets an arm."""
    plan.save(folder / "plan.json", force=True)
    board = Connection(cast(Any, None), "sim")
    board.arm = arm
    return [
        lambda: pipeline.load(folder / "plan.json", arm),
        lambda: board.configure_for(plan.arm, plan),
        lambda: board.configure_for(sequence.arm, sequence),
    ]


@pytest.mark.slow
def test_a_plan_is_old_when_its_frame_is_elsewhere(
    tmp_path: Path, planned: tuple[Plan, Plan], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(arm_state, "configure", lambda *_: None)
    plan, sequence = planned
    assert plan.job.frames == sequence.frames == ("tray",)
    arm_file(tmp_path)
    for old, new in (("[frame.table]", "[frame.bin]\nposition_mm = [1, 2, 3]\n[frame.table]"), ("", "")):
        for call in loaded(plan, sequence, moved(tmp_path, old, new), tmp_path):
            call()
    # the tray stands on the table
    for old, new, said in (
        ("yaw_deg = 20", "yaw_deg = 21.5", "frame 'tray' has changed since, by 1.41 mm and 1.5 degrees"),
        ("frame.tray", "frame.trays", "frame 'tray' is no longer in the arm file"),
    ):
        for call in loaded(plan, sequence, moved(tmp_path, old, new), tmp_path):
            with pytest.raises(InputError, match="plan it again") as refused:
                call()
            assert said in str(refused.value)


def test_a_sequence_takes_a_plan_unless_its_own_frame_is_elsewhere(
    tmp_path: Path, planned: tuple[Plan, Plan]
) -> None:
    """Teaching a posture or a frame makes no other plan old."""
    plan, _ = planned
    plan.save(tmp_path / "plan.json")
    text = 'name = "s"\n[[step]]\nrun = "plan.json"\n'
    more = postures(new=[1.0, -60.0, 40.0]) + "[frame.new]\nposition_mm = [5, 6, 7]\n"
    source = Path(plan.arm.source)
    before = source.read_text(encoding="utf-8")
    try:
        for change in (more, more.replace("[5, 6", "[6, 6")):
            source.write_text(before + change, encoding="utf-8")
            arm = Arm.load(source)
            sequence = Sequence.of_table(toml_table.parse(text, str(tmp_path / "s.toml")), arm)
            assert pipeline.plan_sequence(arm, sequence).frames == ("tray",)
        source.write_text(before.replace("yaw_deg = 20", "yaw_deg = 22"), encoding="utf-8")
        arm = Arm.load(source)
        sequence = Sequence.of_table(toml_table.parse(text, str(tmp_path / "s.toml")), arm)
        with pytest.raises(InputError, match=r"step\[1\].run: it is old: frame 'tray' has changed"):
            pipeline.plan_sequence(arm, sequence)
    finally:
        source.write_text(before, encoding="utf-8")


def test_run_and_upload_refuse_an_old_plan_before_a_port_is_opened(
    tmp_path: Path, planned: tuple[Plan, Plan]
) -> None:
    plan, sequence = planned
    plan.save(tmp_path / "plan.json")
    sequence.save(tmp_path / "sequence.json")
    arm_file(tmp_path)
    moved(tmp_path, "position_mm = [50, 20, 5]", "position_mm = [50, 20, 6]")
    for command in ("run", "upload"):
        for name in ("plan.json", "sequence.json"):
            path = str(tmp_path / name)
            result = cli(command, path, "--arm", str(tmp_path / "arm.toml"), "--port", "nowhere")
            assert result.exit_code == 2, result.output
            assert f"{path} is old: frame 'tray' has changed since, by 1 mm and 0 degrees" in " ".join(
                result.output.split()
            )
            assert "nowhere" not in result.output


def test_fetch_refuses_a_sequence_before_a_port_is_opened(tmp_path: Path, planned: tuple[Plan, Plan]) -> None:
    planned[1].save(tmp_path / "sequence.json")
    result = cli("fetch", str(tmp_path / "sequence.json"), "--port", "nowhere")
    assert (result.exit_code, "samples of a sequence are not kept" in result.output) == (2, True), (
        result.output
    )
