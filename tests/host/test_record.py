"""Run folders: written step by step, read back whole or cut short."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import InputError, RunFolderError
from armtempo.link.board_messages import Positions, Sample
from armtempo.model.arm import Arm
from armtempo.report import run_folder, run_reader

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
    return run_folder.RunFolder(run_folder.new_folder(path, "feed"), "feed", SCALES, {"port": "sim"})


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
    assert found.trajectory_path is None
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
    names = [run_folder.new_folder(tmp_path, "feed").name for _ in range(3)]
    assert names == ["feed-001", "feed-002", "feed-003"]
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be made"):
        run_folder.new_folder(tmp_path / "file", "feed")


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


def test_full_disk_is_said_and_what_came_before_is_kept(tmp_path: Path) -> None:
    full = Path("/dev/full")
    if not full.exists():  # not on every system
        return
    run = folder(tmp_path)
    with (  # noqa: PT012
        pytest.raises(RunFolderError, match=r"samples-01\.csv: cannot be written: No space"),
        run.begin_repetition() as file,
    ):
        file.append(sample(0))
        file._file.close()
        file._file = full.open("w", encoding="utf-8", newline="")
        file._csv = csv.writer(file._file)
        file.append(sample(1))
    found = run_reader.load(run.path).repetitions[0]
    assert (found.state, found.index.tolist()) == (run_folder.BROKEN, [0])


def test_two_runs_at_once_get_folders_of_their_own(tmp_path: Path) -> None:
    (tmp_path / "feed-001").symlink_to(tmp_path / "nowhere")  # as if it came into being after a look
    assert run_folder.new_folder(tmp_path, "feed").name == "feed-002"
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="the run folder cannot be made"):
        run_folder.new_folder(tmp_path / "file", "feed")
