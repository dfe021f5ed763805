"""Run folders, written step by step, read back whole or cut short; and the analysis of samples: gaps, lags, limits."""

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
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.basics.atomic_file import replace_text
from armtempo.basics.errors import ArmtempoError, InputError, RunFolderError
from armtempo.encoding import encoded_motion
from armtempo.link.board_messages import Positions, Sample
from armtempo.model.arm import Arm
from armtempo.model.parts import Limits
from armtempo.report import analysis, differentiation, peaks, run_folder, run_reader, run_report
from armtempo.report.run_reader import RepetitionData
from armtempo.robot import recording
from armtempo.splines import bspline
from armtempo.splines.extremes import of_joints
from armtempo.splines.trajectory import JointSpline, Trajectory

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
    motion = encoded_motion.of_plan(made_runs.shipped_plan())
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


@pytest.mark.slow
def test_a_damaged_run_folder_is_read_or_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Random damage to each of its files: no traceback, no number that is none."""
    seed = 37
    print("seed", seed)
    numbers = random.Random(seed)
    made_runs.draw_nothing(monkeypatch)
    whole = made_runs.make(tmp_path / "whole", repetitions=2)
    refused = 0
    for number in range(120):
        folder = shutil.copytree(whole, tmp_path / "damaged", dirs_exist_ok=True)
        name = numbers.choice(("run.json", "samples-01.csv", "samples-02.csv"))
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
    assert refused > 40


def test_two_runs_at_once_get_folders_of_their_own(tmp_path: Path) -> None:
    (tmp_path / "feed-001").symlink_to(tmp_path / "nowhere")  # as if it came into being after a look
    assert new_folder(tmp_path).name == "feed-002"


# analysis of samples: what is put in comes out, gaps and lags included; peaks next to limits


VIA = ((0.0, 20, 40, 90, 130, 160, 180), (-60.0, -75, -110, -85, -60, -45, -38))
STEP = 0.1
RESOLUTION_DEG = 0.09


def joint(via: tuple[float, ...], interval_s: float) -> JointSpline:
    """Equal intervals: the paper's motion before optimisation."""
    return JointSpline(5, 1, bspline.fit(np.array(via), 5), interval_s * np.arange(-2.0, len(via) + 2))


PLAN = Trajectory("t", (joint(VIA[0], 2.0), joint(VIA[1], 2.2)), False)


def samples(delay_s: float = 0.0, seed: int | None = None, resolution: float = 0.0) -> RepetitionData:
    """The plan as an encoder would see it: late, with noise, rounded."""
    times = np.append(np.arange(0.0, PLAN.duration_s, 0.1), PLAN.duration_s)
    angles = PLAN(times - delay_s)
    if seed is not None:
        angles = angles + np.random.default_rng(seed).normal(scale=0.05, size=angles.shape)
    if resolution:
        angles = np.rint(angles / resolution) * resolution
    nothing, index = np.zeros(angles.shape, int), np.arange(len(times))
    return RepetitionData(
        "x", "complete", index, times, times, nothing, PLAN(times), angles, 0 * index, 0 * index
    )


def test_exact_samples_show_the_theory() -> None:
    found = analysis.curves([samples()], PLAN)
    assert found.mean.shape == (3, 133, 2)
    for rows, worst in zip(analysis.deviations(found), (1e-9, 0.05, 2.0), strict=True):
        for deviation in rows:
            assert deviation.rms <= deviation.largest <= worst


@pytest.mark.slow
def test_the_standard_error_is_that_of_the_scatter() -> None:
    found = analysis.curves([samples(seed=seed) for seed in range(40)], PLAN)
    assert np.nanmean(found.sem[0]) == pytest.approx(0.05 / np.sqrt(40), rel=0.1)
    assert np.isnan(analysis.curves([samples()], PLAN).sem).all()


@pytest.mark.parametrize("delay", [0.0, 0.02, -0.02])
def test_a_lag_is_found_at_both_ends(delay: float) -> None:
    lags = analysis.lags_s(analysis.curves([samples(delay)], PLAN), PLAN)
    np.testing.assert_allclose(lags, delay, atol=0.003)


def test_a_gap_leaves_a_hole_and_nothing_else() -> None:
    whole = samples()
    keep = np.r_[0:20, 25 : len(whole.time_s)]
    cut = replace(
        whole,
        index=whole.index[keep],
        time_s=whole.time_s[keep],
        path_s=whole.time_s[keep],
        angle_deg=whole.angle_deg[keep],
        commanded_deg=whole.commanded_deg[keep],
    )
    found = analysis.curves([cut], PLAN)
    assert np.isnan(found.mean[0, 20:25]).all()
    assert not np.isnan(np.delete(found.mean, np.s_[20:25], axis=1)).any()
    both = analysis.curves([cut, whole], PLAN)
    assert not np.isnan(both.mean).any()


def test_final_errors_are_taken_at_the_last_sample() -> None:
    late = samples()
    late.angle_deg[-1] += (0.25, -0.5)
    np.testing.assert_allclose(analysis.final_errors(late, PLAN), (0.25, -0.5), atol=1e-9)


def test_no_samples_is_an_error() -> None:
    with pytest.raises(ValueError, match="no samples"):
        analysis.curves([], PLAN)


# differentiation of samples: exact on polynomials, no lag, and noise as stated


@pytest.mark.parametrize("count", [4, 5, 6, 7, 8, 20])
@pytest.mark.parametrize("order", [1, 2])
def test_cubics_come_out_exactly_to_the_very_ends(count: int, order: int) -> None:
    cubic = np.polynomial.Polynomial([3.0, -2.0, 5.0, 1.5])
    t = np.arange(count) * STEP
    found = differentiation.derivative(cubic(t), STEP, order)
    np.testing.assert_allclose(found, cubic.deriv(order)(t), atol=1e-9)


def test_several_joints_at_once_equal_one_by_one() -> None:
    values = np.random.default_rng(1).normal(size=(30, 3))
    both = differentiation.derivative(values, STEP, 1)
    for joint in range(3):
        np.testing.assert_allclose(both[:, joint], differentiation.derivative(values[:, joint], STEP, 1))


@pytest.mark.parametrize("order", [1, 2])
def test_a_wave_is_not_delayed(order: int) -> None:
    t = np.arange(200) * STEP
    found = differentiation.derivative(np.sin(t), STEP, order)[10:-10]
    exact = np.cos(t)[10:-10] if order == 1 else -np.sin(t)[10:-10]
    gain = found @ exact / (exact @ exact)
    assert gain == pytest.approx(1.0, abs=0.01)
    np.testing.assert_allclose(found, gain * exact, atol=1e-3)


@pytest.mark.parametrize("order", [1, 2])
def test_the_stated_noise_is_what_comes_out(order: int) -> None:
    sigma = differentiation.quantisation_sigma(0.09)
    values = np.random.default_rng(2).normal(scale=sigma, size=100_000)
    found = differentiation.derivative(values, STEP, order)[10:-10].std()
    assert found == pytest.approx(differentiation.noise(order, STEP, sigma), rel=0.02)


def test_too_few_samples_say_so_with_nan() -> None:
    assert np.isnan(differentiation.derivative(np.arange(3.0), STEP, 1)).all()


TRUE = of_joints(PLAN.joints)


def limits_at(share: float) -> tuple[Limits, ...]:
    """Limits that the plan reaches to this share."""
    return tuple(Limits(*(value / share for value in extreme.values)) for extreme in TRUE)


def checked(
    runs: list[RepetitionData],
    share: float = 1.0,
    resolution: float = RESOLUTION_DEG,
    plan: Trajectory = PLAN,
) -> list[list[peaks.LimitCheck]]:
    """The checks of some repetitions of ``plan``."""
    found = analysis.curves(runs, plan)
    return peaks.limit_checks(found, plan, limits_at(share), (resolution, resolution))


@pytest.mark.parametrize(
    ("peak", "sigma", "verdict"),
    [
        (33.4, 1.4, peaks.UNDECIDED),  # once a green "kept"
        (33.4, 0.1, peaks.EXCEEDED),
        (30.2, 0.1, peaks.WITHIN),
        (30.0, 1.4, peaks.UNDECIDED),
        (28.0, 0.5, peaks.KEPT),
        (float("nan"), 0.5, peaks.NOT_MEASURED),
    ],
)
def test_a_verdict_needs_three_uncertainties(peak: float, sigma: float, verdict: str) -> None:
    assert peaks.LimitCheck(peak, 30.0, sigma).verdict == verdict


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.7])
def test_an_arm_that_does_as_planned_keeps_its_limits(phase: float) -> None:
    """Rounding to counts makes the plain derivative's peak too high by several uncertainties; not this one."""
    one = samples()
    rounded = (np.rint(one.angle_deg / RESOLUTION_DEG + phase) - phase) * RESOLUTION_DEG
    one.angle_deg[:] = rounded
    for joint, row in enumerate(checked([one])):
        for order, check in enumerate(row):
            assert check.peak == pytest.approx(TRUE[joint].values[order], abs=4.0 * check.sigma)
            assert check.verdict in (peaks.KEPT, peaks.WITHIN)
            assert check.sigma < 0.015 * check.limit


@pytest.mark.parametrize(("gear", "verdict"), [(1.2, peaks.EXCEEDED), (1.0, peaks.WITHIN), (0.9, peaks.KEPT)])
def test_an_arm_that_turns_more_than_planned_shows(gear: float, verdict: str) -> None:
    one = samples(resolution=RESOLUTION_DEG)
    one.angle_deg[:] = one.angle_deg[0] + gear * (one.angle_deg - one.angle_deg[0])
    for row in checked([one]):
        assert [check.verdict for check in row] == [verdict, verdict]


def test_a_coarse_encoder_cannot_tell() -> None:
    """With counts of 2 degrees, no acceleration can be judged to 5 %."""
    found = checked([samples(resolution=2.0)], resolution=2.0)
    assert {row[1].verdict for row in found} == {peaks.UNDECIDED}


def test_a_ringing_arm_is_not_called_fine() -> None:
    """What swings faster than the smoothing follows becomes uncertainty: never a green "kept"."""
    one = samples(resolution=RESOLUTION_DEG)
    one.angle_deg[:] += 0.5 * np.sin(2 * np.pi * 3.1 * one.time_s)[:, None]
    assert {row[1].verdict for row in checked([one])} == {peaks.UNDECIDED}


def test_beside_a_gap_nothing_is_said() -> None:
    whole = samples(resolution=RESOLUTION_DEG)
    whole.angle_deg[40:60] = np.nan
    for joint, row in enumerate(checked([whole])):
        for order, check in enumerate(row):
            assert check.peak <= TRUE[joint].values[order] + 4.0 * check.sigma


def test_a_joint_without_an_encoder_is_not_measured() -> None:
    one = samples()
    one.angle_deg[:, 1] = np.nan
    found = checked([one])
    assert [check.verdict for check in found[1]] == [peaks.NOT_MEASURED] * 2
    assert found[0][0].verdict in (peaks.KEPT, peaks.WITHIN)


@pytest.mark.long
def test_the_stated_uncertainty_is_that_of_repeated_measurements() -> None:
    """Seed 7: the same noise in 40 runs; their peaks at one place scatter by the stated sigma."""
    rng = np.random.default_rng(7)
    at = []
    for _ in range(40):
        one = samples()
        one.angle_deg[:] += rng.normal(scale=0.05, size=one.angle_deg.shape)
        found = checked([one], resolution=0.001)
        at.append([[check.peak for check in row] for row in found])
        stated = [[check.sigma for check in row] for row in found]
    scatter = np.std(at, axis=0)
    assert np.all(scatter < 1.3 * np.array(stated))
    assert np.all(scatter > 0.3 * np.array(stated))
