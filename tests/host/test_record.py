"""Run folders, written step by step, read back whole, cut short or damaged."""

from __future__ import annotations

import csv
import errno
import json
import os
import random
import shutil
import stat
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.basics.atomic_file import replace_text
from armtempo.basics.errors import ArmtempoError, InputError, RunFolderError
from armtempo.encoding import encoded_plan
from armtempo.link.board_messages import Positions, Sample
from armtempo.model.arm import Arm
from armtempo.report import run_folder, run_reader, run_report
from armtempo.robot import recording

from tests.host import made_runs
from tests.inprocess import Pipe, ready

SCALES = run_folder.scales(Arm.paper())


def sample(index: int) -> Sample:
    return Sample(
        1,
        index,
        index * 8_400_000,
        index * 8_400_000,
        0,
        Positions((index, -index, 0), (3 * index, -3 * index, 7)),
    )


def folder(path: Path) -> run_folder.RunFolder:
    return run_folder.RunFolder(new_folder(path), "feed", SCALES, {"port": "sim"})


def new_folder(parent: Path) -> Path:
    """An empty one."""
    with run_folder.new_folder(parent, "feed") as path:
        return path


def test_whole_run(tmp_path: Path) -> None:
    run = folder(tmp_path)
    for _ in range(2):
        with run.begin_repetition() as file:
            for index in range(5):
                file.append(sample(index))
            file.repetition.end(run_folder.COMPLETE, "", 33_600_000, sample(4).positions, ())
    found = run_reader.load(run.path)
    assert [(part.file, part.state) for part in found.repetitions] == [
        ("samples-01.csv", "complete"),
        ("samples-02.csv", "complete"),
    ]
    first = found.repetitions[0]
    assert first.index.tolist() == list(range(5))
    np.testing.assert_allclose(first.time_s, np.arange(5) * 0.1)
    assert first.commanded_steps[:, 1].tolist() == [0, -1, -2, -3, -4]
    np.testing.assert_allclose(first.angle_deg[4], [12 * 0.09, -12 * 0.09, 7 * 0.09], atol=1e-6)
    assert found.meta["repetitions"][0]["duration_s"] == pytest.approx(0.4)
    assert found.plan_path is None
    header = (run.path / "samples-01.csv").read_text().splitlines()[0].split(",")
    assert header == list(found.meta["columns"])


@pytest.mark.parametrize(
    ("error", "state"), [(KeyboardInterrupt, run_folder.INTERRUPTED), (OSError, run_folder.BROKEN)]
)
def test_interrupted_run_keeps_what_arrived(tmp_path: Path, error: type[BaseException], state: str) -> None:
    run = folder(tmp_path)
    with pytest.raises(error), run.begin_repetition() as file:  # noqa: PT012
        file.append(sample(0))
        assert len(run_reader.load(run.path).repetitions[0].index) == 1  # readable in the middle
        raise error
    found = run_reader.load(run.path).repetitions[0]
    assert (found.state, found.index.tolist()) == (state, [0])


def test_half_a_line_is_dropped(tmp_path: Path) -> None:
    run = folder(tmp_path)
    with run.begin_repetition() as file:
        file.append(sample(0))
        file.append(sample(1))
    path = run.path / "samples-01.csv"
    path.write_text(path.read_text()[:-9])
    assert run_reader.load(run.path).repetitions[0].index.tolist() == [0]


def test_folders_never_collide(tmp_path: Path) -> None:
    names = [new_folder(tmp_path).name for _ in range(3)]
    assert names == ["feed-001", "feed-002", "feed-003"]
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="the run folder cannot be made"):
        new_folder(tmp_path / "file")


def test_damaged_folders_are_named(tmp_path: Path) -> None:
    with pytest.raises(RunFolderError, match="not a run folder"):
        run_reader.load(tmp_path)
    run = folder(tmp_path)
    with run.begin_repetition() as file:
        file.append(sample(0))
    meta_path = run.path / run_folder.META
    meta = json.loads(meta_path.read_text())
    (run.path / "samples-01.csv").write_text("index,time_s\nx,0\n")
    assert "damaged" in run_reader.load(run.path).repetitions[0].problem
    (run.path / "samples-01.csv").unlink()
    assert "missing" in run_reader.load(run.path).repetitions[0].problem
    for change, words in (
        ({"version": 99}, "version 99"),
        ({"format": "other"}, "not the description"),
        ({"joints": [{"name": 1}]}, "damaged"),
    ):
        meta_path.write_text(json.dumps(meta | change))
        with pytest.raises(RunFolderError, match=words):
            run_reader.load(run.path)
    meta_path.write_text("{")
    with pytest.raises(RunFolderError, match="damaged"):
        run_reader.load(run.path)


@pytest.mark.skipif(sys.platform != "linux", reason="the full disk of Linux, /dev/full")
def test_full_disk_is_said_and_what_came_before_is_kept(tmp_path: Path) -> None:
    full = Path("/dev/full")
    run = folder(tmp_path)
    with (  # noqa: PT012
        pytest.raises(RunFolderError, match=r"samples-01\.csv: cannot be written: No space"),
        run.begin_repetition() as file,
    ):
        file.append(sample(0))
        file._samples._file.close()
        file._samples._file = full.open("w", encoding="utf-8", newline="")
        file._samples._csv = csv.writer(file._samples._file)
        file.append(sample(1))
    found = run_reader.load(run.path).repetitions[0]
    assert (found.state, found.index.tolist()) == (run_folder.BROKEN, [0])


def test_a_folder_that_the_disk_has_no_room_for_is_not_left_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The disk is full at each write of a new run's, one after the other."""
    board, _ = ready(Pipe(tmp_path / "flash"))
    motion = encoded_plan.of_plan(made_runs.shipped_plan())
    writes = (Path, "write_bytes"), (os, "fsync"), (os, "replace")
    for place, name in writes:
        with monkeypatch.context() as change:
            change.setattr(place, name, no_space)
            with pytest.raises(ArmtempoError, match="cannot be written: No space"):
                recording.new_run(tmp_path / "runs", motion, "port", board)
        assert list((tmp_path / "runs").iterdir()) == []


def no_space(*_: object) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_file_has_its_content_before_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise a power failure may leave an empty file in place of the old one."""
    done: list[str] = []

    def sync(number: int) -> None:
        done.append(
            f"sync {os.fstat(number).st_size}" if stat.S_ISREG(os.fstat(number).st_mode) else "sync folder"
        )

    monkeypatch.setattr(os, "fsync", sync)
    replace_file = os.replace
    monkeypatch.setattr(os, "replace", lambda *paths: (done.append("rename"), replace_file(*paths)))
    replace_text(tmp_path / "arm.toml", "four")
    assert done[:2] == ["sync 4", "rename"]
    assert done[2:] in ([], ["sync folder"])


def test_a_disk_that_cannot_sync_is_written_to_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cannot(number: int) -> None:
        raise OSError(errno.EINVAL, "Invalid argument")

    monkeypatch.setattr(os, "fsync", cannot)
    replace_text(tmp_path / "arm.toml", "four")
    assert (tmp_path / "arm.toml").read_text() == "four"


BAD_VALUES = (
    None,
    "",
    "x",
    "nan",
    "inf",
    -1,
    0,
    1e300,
    10**400,
    True,
    [],
    [1],
    {},
    {"a": 1},
    "../run.json",
    "\ud800",
)
BAD_CELLS = ("", "nan", "inf", "-inf", "1e300", "9" * 400, "x", "1;2", '"', "\0", "-1", "1.5", "é")


def places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Each table or list in a JSON value, and each of its keys."""
    inner = (
        list(value.items())
        if isinstance(value, dict)
        else list(enumerate(value))
        if isinstance(value, list)
        else []
    )
    for key, entry in inner:
        yield value, key
        yield from places(entry)


def spoil_json(path: Path, numbers: random.Random) -> None:
    """One value is another, or missing, or no JSON number."""
    content = json.loads(path.read_text())
    table, key = numbers.choice(list(places(content)))
    if isinstance(table, dict) and numbers.random() < 0.2:
        del table[key]
    else:
        table[key] = "@" if numbers.random() < 0.3 else numbers.choice(BAD_VALUES)
    text = json.dumps(content, ensure_ascii=True)
    path.write_text(text.replace('"@"', numbers.choice(("NaN", "Infinity", "1e999", "-1e999"))))


def spoil_table(path: Path, numbers: random.Random) -> None:
    """One cell is another, missing, or one too many."""
    lines = [line.split(",") for line in path.read_text().split("\n")]
    row = numbers.choice(lines)
    kind, at = numbers.randrange(4), numbers.randrange(len(row))
    if kind == 0:
        del row[at]
    elif kind == 1:
        row.insert(at, numbers.choice(BAD_CELLS))
    else:
        row[at] = numbers.choice(BAD_CELLS)
    path.write_text("\n".join(map(",".join, lines)))


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("of_sequence", [False, True])
def test_a_damaged_run_folder_is_read_or_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, of_sequence: bool
) -> None:
    """Random damage to each of its files: no traceback, no number that is none."""
    seed = 37
    print("seed", seed)
    numbers = random.Random(seed)
    made_runs.draw_nothing(monkeypatch)
    if of_sequence:
        whole, cases = made_runs.make_sequence(tmp_path / "whole"), 40
    else:
        whole, cases = made_runs.make(tmp_path / "whole", repetitions=2), 120
    refused = 0
    for number in range(cases):
        folder = shutil.copytree(whole, tmp_path / "damaged", dirs_exist_ok=True)
        name = numbers.choice(
            ("run.json", "samples-01.csv", "rows-01.csv" if of_sequence else "samples-02.csv")
        )
        (spoil_json if name.endswith("json") else spoil_table)(folder / name, numbers)
        try:
            found = run_reader.load(folder)
            for joint in found.joints:
                assert np.isfinite([joint.steps_per_deg, joint.counts_per_deg]).all()
            for one in found.repetitions:
                assert np.isfinite(one.time_s).all()
                assert np.isfinite(one.commanded_deg).all()
            refused += any(one.problem for one in found.repetitions)
            if number % 10 == 0:
                run_report.write(folder)
        except ArmtempoError:
            refused += 1
    assert refused > cases // 4


def test_two_runs_at_once_get_folders_of_their_own(tmp_path: Path) -> None:
    (tmp_path / "feed-001").symlink_to(tmp_path / "nowhere")  # as if it came into being after a look
    assert new_folder(tmp_path).name == "feed-002"
