"""Nothing is overwritten: inputs never, files and stored motions of other content only with --force."""

from __future__ import annotations

from pathlib import Path

import pytest
from armtempo.cli import main
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.planning import planner
from click.testing import CliRunner, Result

ARM = Arm.paper()
JOB = 'name = "keep"\nvia_deg = [[0.0, -60.0, 40.0], [5.0, -58.0, 41.0]]\niterations = 5\n'


@pytest.fixture(autouse=True)
def _files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("keep.toml").write_text(JOB)
    Path("arm.toml").write_text(shipped.arm_path().read_text())
    Path("table.csv").write_text("0,-60,40\n5,-58,41\n")
    job = Job("keep", ((0.0, -60.0, 40.0), (5.0, -58.0, 41.0)), population=5, iterations=5)
    planner.plan(ARM, job).save("motion.json")


def run(*arguments: str) -> Result:
    return CliRunner().invoke(main, list(arguments))


PLAN = ("plan", "--arm", "arm.toml", "--job", "keep.toml", "-o")
WRITES = {
    "a plan over its job": (*PLAN, "keep.toml"),
    "a plan over its arm": (*PLAN, "arm.toml"),
    "a plan over its job by another path": (*PLAN, "../{here}/keep.toml"),
    "a table over its trajectory": ("export", "motion.json", "-o", "motion.json"),
    "a job over its table": ("import", "table.csv", "--arm", "arm.toml", "-o", "table.csv"),
}


@pytest.mark.slow
@pytest.mark.parametrize("force", [(), ("--force",)], ids=["", "force"])
@pytest.mark.parametrize("arguments", WRITES.values(), ids=list(WRITES))
def test_inputs_are_never_written(arguments: tuple[str, ...], force: tuple[str, ...]) -> None:
    before = {path: path.read_bytes() for path in Path().iterdir()}
    done = run(*(word.format(here=Path.cwd().name) for word in arguments), *force)
    assert done.exit_code == 2, done.output
    assert "choose another" in done.stderr
    assert {path: path.read_bytes() for path in Path().iterdir()} == before


OVER = {
    "a table over an arm": (("export", "motion.json", "-o"), "arm.toml"),
    "a plan over a table": (PLAN, "table.csv"),
    "a job over a job": (("import", "table.csv", "--arm", "arm.toml", "-o"), "keep.toml"),
}


@pytest.mark.slow
@pytest.mark.parametrize(("arguments", "target"), OVER.values(), ids=list(OVER))
def test_other_content_needs_force(arguments: tuple[str, ...], target: str) -> None:
    before = Path(target).read_bytes()
    done = run(*arguments, target)
    assert done.exit_code == 2, done.output
    assert "--force" in done.stderr
    assert Path(target).read_bytes() == before
    assert run(*arguments, target, "--force").exit_code == 0
    after = Path(target).read_bytes()
    assert after != before
    assert run(*arguments, target).exit_code == 0  # the same once more
    assert Path(target).read_bytes() == after or "plan" in arguments


@pytest.mark.slow
def test_a_plan_follows_itself_and_no_other_job() -> None:
    assert run(*PLAN, "motion.json").exit_code == 0  # the same job, the same arm
    Path("other.toml").write_text(JOB.replace('"keep"', '"other"'))
    done = run("plan", "--arm", "arm.toml", "--job", "other.toml", "-o", "motion.json")
    assert done.exit_code == 2
    assert "of the same job" in done.stderr


@pytest.mark.slow
def test_an_altered_trajectory_is_refused_and_kept() -> None:
    text = Path("motion.json").read_text()
    Path("motion.json").write_text(text.replace('"speed_deg_s": 50.0', '"speed_deg_s": 51.0', 1))
    assert Path("motion.json").read_text() != text
    for arguments in (("export", "motion.json"), ("run", "motion.json", "--port", "sim")):
        done = run(*arguments)
        assert done.exit_code == 2, done.output
        assert "--altered" in done.stderr
    assert run("export", "motion.json", "--altered").exit_code == 0
    assert run(*PLAN, "motion.json").exit_code == 2
