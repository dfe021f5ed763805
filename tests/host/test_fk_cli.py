"""``armtempo fk``: the tool's pose and every frame, as a table and as JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.cli import main
from armtempo.kinematics import forward
from armtempo.kinematics.forward import all_frames, array_frames
from armtempo.model import pose
from click.testing import CliRunner, Result

from tests.host.published_arms import NAMED, PAPER


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, ["fk", *map(str, arguments)])


def values(*arguments: str | Path) -> dict[str, Any]:
    result = run(*arguments, "--json")
    assert result.exit_code == 0, result.output
    found: dict[str, Any] = json.loads(result.stdout)
    return found


def test_the_paper_s_last_via_point_stands_at_eq_16() -> None:
    tool = values("180,-38,-52")["tool"]
    np.testing.assert_allclose(tool["position_mm"], [-536.404, 0.0, 434.698], atol=1e-3)
    np.testing.assert_allclose(
        tool["matrix"], forward(PAPER, np.radians([180, -38, -52, 0, 0, 0])), atol=1e-9
    )
    np.testing.assert_allclose(
        pose.from_rpy((0, 0, 0), tool["rpy_deg"])[:3, :3], np.array(tool["matrix"])[:3, :3], atol=1e-12
    )
    assert tool["quaternion"] == pytest.approx([0.7071068, 0.0, -0.7071068, 0.0], abs=1e-6)


def test_every_frame_is_listed_from_the_base_to_the_tool() -> None:
    found = values("10,-60,40,20,30,170")
    frames = found["frames"]
    assert [frame["name"] for frame in frames] == [
        "base",
        *(f"joint {n}" for n in range(1, 6)),
        "joint 6 (tool)",
    ]
    assert frames[0]["position_mm"] == [0.0, 0.0, 0.0]
    wanted = all_frames(PAPER, np.radians([10.0, -60.0, 40.0, 20.0, 30.0, 170.0]).tolist())
    np.testing.assert_allclose([frame["matrix"] for frame in frames], wanted, atol=1e-9)
    assert frames[-1]["matrix"] == found["tool"]["matrix"]


def test_floats_and_arrays_give_the_same_frames() -> None:
    rng = np.random.default_rng(61)
    for geometry in NAMED.values():
        angles = rng.uniform(-3, 3, (5, 6))
        together = [np.stack([np.array(axis) for axis in frame]) for frame in array_frames(geometry, angles)]
        for i, one in enumerate(angles):
            alone = all_frames(geometry, one.tolist())
            for frame, whole in zip(alone, together, strict=True):
                columns = np.swapaxes(whole, 0, 1)[..., i] if whole.ndim == 3 else whole.T
                np.testing.assert_allclose(frame[:3], columns, atol=1e-12 * geometry.reach)


@pytest.mark.parametrize(
    "form", [("0", "-60", "40"), ("0,-60,40",), ("0 -60 40",), ("0,-60,40,0,0,0",), ("P0",), ()]
)
def test_every_form_of_a_posture_means_the_same(form: tuple[str, ...]) -> None:
    assert values(*form)["angles_deg"] == [0.0, -60.0, 40.0, 0.0, 0.0, 0.0]
    assert values(*form)["tool"] == values("0,-60,40")["tool"]


def test_the_table_has_units_and_a_row_a_frame() -> None:
    result = run("-10", "-60", "40")
    assert result.exit_code == 0
    title, heads, units, *rows = result.stdout.splitlines()
    assert title == "paper-1to5 at -10.0000 -60.0000 40.0000 0.0000 0.0000 0.0000 deg"
    assert heads.split() == ["frame", "x", "y", "z", "roll", "pitch", "yaw"]
    assert units.split() == ["mm", "mm", "mm", "deg", "deg", "deg"]
    assert rows[0].split() == ["base", *["0.0000"] * 6]
    assert " ".join(rows[6].split()) == "joint 6 (tool) 295.0200 -52.0200 54.9730 180.0000 -20.0000 -10.0000"
    assert rows[7] == "tool as a matrix, lengths in mm:"
    assert rows[12].startswith("tool as a quaternion w x y z: 0.0151")


def test_angles_out_of_range_are_shown_with_a_note() -> None:
    result = run("300,-60,40")
    assert result.exit_code == 0
    assert result.stdout.splitlines()[-1] == "note: joint 1 at 300 deg is 110 deg above its range -10 to 190"
    assert values("300,-60,40")["out_of_range"] == [
        "joint 1 at 300 deg is 110 deg above its range -10 to 190"
    ]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ("1,2",),
            "2 angles given, but arm 'paper-1to5' has 6 joints, of which 3 have a motor\nhint: give one angle",
        ),
        (("1,2,x",), "the angles: 'x' is not a number"),
        (("1,2,nan",), "the angles: 'nan' is not a finite number"),
        (("P99",), "has no via point P99\nhint: give one of P0 to P6"),
        (("none.json",), "none.json: no such file"),
        (("0,0,0", "--arm", "none.toml"), "none.toml: neither a file"),
    ],
)
def test_wrong_input_ends_with_2_and_one_clear_message(arguments: tuple[str, ...], words: str) -> None:
    result = run(*arguments)
    assert result.exit_code == 2
    assert words in result.stderr
    assert result.stdout == ""
