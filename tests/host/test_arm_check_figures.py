"""What ``armtempo check`` computes of an arm, levers, torque, outline, and the picture it makes."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.diagnosis import figures, resolution, torque
from armtempo.kinematics.chain import chains_mm, outline_mm
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.parts import JointModel

from tests.host.arm_files import changed, run_check

NAMES = tuple(shipped.files())


def test_the_longest_lever_is_that_of_the_stretched_arm() -> None:
    scara = [found.lever_mm for found in resolution.resolutions(Arm.load("scara"))]
    np.testing.assert_allclose(scara, [228 + 136.5, 136.5, 0], rtol=1e-4, atol=1e-6)
    lower = resolution.resolutions(Arm.load("community"))[1]
    assert lower.lever_mm == pytest.approx(
        120, rel=1e-4
    )  # the rods keep forearm and hand from turning with it


def test_the_torque_margin_is_that_of_the_model() -> None:
    """Joint 2: inertia and gravity through the gear, torque at 0.71 of the holding torque at the corner speed."""
    joint = Arm.paper().driven[1]
    gear, acceleration = 20, math.radians(30)
    asked = (8.2e-6 + 0.08 / gear**2) * acceleration * gear + 1.5 / gear
    available = 0.65 / math.sqrt(1 + (math.radians(40) * gear / 30.0) ** 2)
    assert torque.margin(joint) == pytest.approx(available / asked)
    assert torque.margin(replace(joint, model=JointModel())) is None


def test_gravity_counts_where_the_range_lets_it() -> None:
    joint = Arm.paper().driven[1]
    upright = replace(joint, range_deg=(60.0, 100.0), home_deg=90.0)
    assert torque.gravity_nm(joint) == pytest.approx(1.5 / 20)
    assert torque.gravity_nm(upright) == pytest.approx(1.5 / 20 * math.cos(math.radians(60)))


def test_figures_without_a_load_know_no_infinity(tmp_path: Path) -> None:
    path = changed(
        tmp_path, ("rotor_inertia_kg_m2 = 8.2e-6\ninertia_kg_m2 = 0.15", "rotor_inertia_kg_m2 = 0")
    )
    found = figures.of(Arm.read(path))[0]
    assert found.torque_margin == math.inf
    assert found.values["torque_margin"] is None
    assert "inf x" in figures.table([found])[1]


def test_the_outline_goes_through_the_frames() -> None:
    arm = Arm.paper()
    home = np.array(arm.all_home_deg)
    outline = outline_mm(arm, home)
    np.testing.assert_allclose(outline[::2], chains_mm(arm, np.array(arm.home_deg)), atol=1e-9)
    np.testing.assert_allclose(outline[1], [0, 0, 130])


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_the_picture_shows_home_and_every_driven_joint(name: str) -> None:
    from armtempo.report.arm_picture import arm_picture

    arm = Arm.load(name)
    figure = arm_picture(arm)
    titles = [axis.get_title() for axis in figure.axes if axis.axison]
    assert titles[:2] == ["home, from the side", "home, from above"]
    assert [title.split(":")[0] for title in titles[2:]] == [joint.name for joint in arm.driven]


@pytest.mark.slow
def test_the_picture_is_written_once(tmp_path: Path) -> None:
    path = tmp_path / "arm.png"
    assert run_check("--picture", path).exit_code == 0
    assert path.read_bytes().startswith(b"\x89PNG")
    path.write_text("mine")
    result = run_check("--picture", path)
    assert result.exit_code == 2
    assert path.read_text() == "mine"
    assert run_check("--picture", path, "--force").exit_code == 0
    assert path.read_bytes().startswith(b"\x89PNG")
    assert run_check("--picture", tmp_path / "arm.txt").exit_code == 2


@pytest.mark.slow
def test_a_dollar_in_a_name_is_no_formula(tmp_path: Path) -> None:
    path = changed(tmp_path, ('name = "joint 1"', 'name = "$$ \\\\theta"'), ('"paper-1to5"', '"$x^$"'))
    result = run_check("--arm", path, "--picture", tmp_path / "arm.svg")
    assert result.exit_code == 0, result.output
    assert ">$$ \\theta: " in (tmp_path / "arm.svg").read_text()
