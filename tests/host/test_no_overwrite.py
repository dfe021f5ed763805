"""Nothing is overwritten: inputs never, files and stored motions of other content only with --force."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import pytest
from armtempo.basics.atomic_file import replace_text
from armtempo.basics.errors import InputError
from armtempo.cli import main
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.planning import planner
from click.testing import CliRunner, Result

ARM = Arm.paper()
JOB = 'name = "keep"\nvia_deg = [[0.0, -60.0, 40.0], [5.0, -58.0, 41.0]]\npath = "through"\niterations = 5\n'


@pytest.fixture(autouse=True)
def _files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("keep.toml").write_text(JOB)
    Path("arm.toml").write_text(shipped.arm_path().read_text())
    Path("table.csv").write_text("0,-60,40\n5,-58,41\n")
    job = Job("keep", ((0.0, -60.0, 40.0), (5.0, -58.0, 41.0)), population=5, iterations=5, path="through")
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
@pytest.mark.parametrize("arguments", WRITES.values(), ids=list(WRITES))
def test_inputs_are_never_written(arguments: tuple[str, ...]) -> None:
    """Not even with --force."""
    before = {path: path.read_bytes() for path in Path().iterdir()}
    done = run(*(word.format(here=Path.cwd().name) for word in arguments), "--force")
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


# files that are written whole or not at all


def test_new_old_and_linked() -> None:
    folder = Path("links")
    folder.mkdir()
    path, link = folder.absolute() / "file", folder / "link"
    link.symlink_to(path)
    for target, text in ((path, "one"), (path, "two"), (link, "three")):
        replace_text(target, text)
        assert path.read_text() == text
    assert link.is_symlink()
    assert sorted(item.name for item in folder.iterdir()) == ["file", "link"]


def test_two_threads_may_write_a_file_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    both = Barrier(2, timeout=20)
    monkeypatch.setattr("armtempo.basics.atomic_file._sync", lambda _: both.wait())
    with ThreadPoolExecutor(2) as threads:
        list(threads.map(lambda text: replace_text(Path("page"), text), ("one", "two")))
    assert Path("page").read_text() in ("one", "two")
    assert not [*Path().glob(".page*")]


def test_a_pipe_is_written_to(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        replace_text(pipe, "text")
        assert os.read(reader, 10) == b"text"
    finally:
        os.close(reader)
    assert pipe.is_fifo()


def test_what_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "folder"
    path.mkdir()
    before = sorted(tmp_path.rglob("*"))
    for target in (path, tmp_path / "missing" / "file"):
        with pytest.raises(InputError, match=f"{target}: cannot be written: .*; choose another place"):
            replace_text(target, "text")
    assert sorted(tmp_path.rglob("*")) == before


def test_what_the_system_refuses_is_said_without_a_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device", "somewhere")

    monkeypatch.setattr(planner, "plan", full)
    result = CliRunner().invoke(main, ["plan"])
    assert (result.exit_code, result.output.split("shipped feeding job and arm\n")[1]) == (
        1,
        "armtempo: somewhere: No space left on device\n"
        "hint: check the path, its permissions and the space on the disk\n",
    )
