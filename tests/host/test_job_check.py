"""``armtempo check`` with a job: what looks wrong about it for its arm."""

from __future__ import annotations

from pathlib import Path

import pytest
from armtempo.diagnosis.arm_check import check
from armtempo.model import shipped

from tests.host.arm_files import changed, run_check


def changed_job(tmp_path: Path, old: str = "", new: str = "") -> Path:
    text = shipped.job_path().read_text()
    assert old in text
    path = tmp_path / "job.toml"
    path.write_text(text.replace(old, new, 1))
    return path


def test_the_feeding_job_fits(tmp_path: Path) -> None:
    result = run_check("--job", changed_job(tmp_path))
    assert result.exit_code == 0
    assert "nothing looks wrong" in result.output


@pytest.mark.parametrize(
    ("via", "level", "said"),
    [
        (
            "[[0, -60, 40], [0, -60, 400], [0, -60, 40]]",
            "error",
            "within the range of joint 3, -160 to 100",
        ),
        (
            "[[0, -60, 40], [0.01, -50, 40], [0, -60, 40]]",
            "warning",
            "joint 1 is to move by 0.01 deg, less than a step",
        ),
        ("[[0, -60, 40], [0, -60, 40]]", "error", "all via points are the same"),
        ("[[0, -60], [0, -50]]", "error", "a list of 3 numbers"),
    ],
)
def test_what_looks_wrong_about_a_job(tmp_path: Path, via: str, level: str, said: str) -> None:
    path = tmp_path / "job.toml"
    path.write_text(f'name = "j"\nvia_deg = {via}\n')
    _, found = check(shipped.arm_path(), path)
    assert any(said in finding.what and finding.level.value == level for finding in found), found
    assert run_check("--job", path).exit_code == (1 if level == "error" else 0)


def test_a_job_is_not_looked_at_before_its_arm_is_right(tmp_path: Path) -> None:
    path = changed(tmp_path, ("channel = 2, steps", "channel = 1, steps"))
    _, found = check(path, changed_job(tmp_path))
    assert found[-1].what == "not looked at"
