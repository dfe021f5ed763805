"""The arm in 3-D."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.kinematics import Geometry, all_frames
from armtempo.kinematics.chain import all_angles_deg
from armtempo.model import mesh_files, shipped
from armtempo.model.arm import Arm
from armtempo.model.workspace import FAR_MM, KeepOut, Workspace
from armtempo.panel import arm_scene, charts
from armtempo.panel.arm_scene import ArmShape

from tests.host.panel.fakes import ARM

PAGES = ("#ffffff", "#121212")
"""The backgrounds of a light and of a dark page, which is Quasar's."""
SHADE = 0.7
"""Of a surface that is turned away from the scene's lamp."""


def _luminance(colour: str) -> float:
    """Relative luminance by WCAG 2.1."""
    parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.03928 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def _contrast(one: float, other: float) -> float:
    return (max(one, other) + 0.05) / (min(one, other) + 0.05)


def _through(front: str, back: str, opacity: float) -> str:
    pairs = zip(bytes.fromhex(front[1:]), bytes.fromhex(back[1:]), strict=True)
    return "#" + bytes(round(a * opacity + b * (1 - opacity)) for a, b in pairs).hex()


def test_what_is_drawn_is_seen_on_light_and_on_dark_pages() -> None:
    """Graphics need a contrast of 3 to 1."""
    lit = (arm_scene.COLOUR, arm_scene.JOINT, arm_scene.VIA, arm_scene.TOOL)
    lines = (arm_scene.OBSTACLE, arm_scene.WAY, arm_scene.RUN, arm_scene.DIAL, *arm_scene.AXES)
    times = np.linspace(0.0, 1.0, 100)
    path, _ = arm_scene.colours_of_speed(np.outer(times**2, (1.0, 0.0, 0.0)), times)
    speeds = ["#" + bytes((255 * rgb).round().astype(np.uint8)).hex() for rgb in path]
    for page, ghost in zip(PAGES, arm_scene.GHOST, strict=True):
        back = _luminance(page)
        for colour in (
            *lit,
            *lines,
            *speeds,
            *charts.COLOURS,
            _through(ghost, page, arm_scene.GHOST_OPACITY),
        ):
            shades = (1.0, SHADE) if colour in lit else (1.0,)
            assert all(_contrast(shade * _luminance(colour), back) >= 3.0 for shade in shades), (colour, page)


def test_the_picture_has_the_radii_and_the_room_of_the_arm_file() -> None:
    workspace = Workspace(
        (KeepOut("tray", (100.0, -50.0, 0.0), (200.0, 50.0, 30.0)),), low_mm=(-FAR_MM, -FAR_MM, -20.0)
    )
    thick = tuple(
        replace(joint, radius_mm=40.0 if number == 2 else 0.0) for number, joint in enumerate(ARM.joints)
    )
    shape = ArmShape(replace(ARM, joints=thick, workspace=workspace))
    radii = {index // 2: radius * shape.reach_mm for index, _, radius in shape.pieces}
    assert radii[2] == pytest.approx(40.0)
    assert all(radius > 5.0 for radius in radii.values())  # what the file does not say is drawn all the same
    tray, (floor_low, floor_high, _) = shape.workspace
    assert np.array(tray[:2]) * shape.reach_mm == pytest.approx(np.array([[100, -50, 0], [200, 50, 30]]))
    assert floor_low[2] == floor_high[2] == pytest.approx(-20.0 / shape.reach_mm)
    assert all(floor_high[:2] - floor_low[:2] > 1.0)


def test_meshes_next_to_the_arm_file_are_shown_in_the_frames_of_their_rows(tmp_path: Path) -> None:
    file = tmp_path / "arm.toml"
    file.write_text(shipped.arm_path().read_text())
    arm, corners = Arm.read(file), np.eye(3)[None]
    assert not ArmShape(arm).meshes
    mesh_files.write(file, {0: corners, 3: corners})
    shape = ArmShape(arm)
    angles = np.array([90.0, -60.0, 40.0])
    base, third = shape.poses(angles)[len(shape.pieces) + len(shape.housings) :]
    assert base == [0, 0, 0, 0, 0, 0, 1]
    wanted = all_frames(Geometry.of(arm), np.radians(all_angles_deg(arm, angles)).tolist())[3, :3, 3]
    assert np.array(third[:3]) * shape.reach_mm == pytest.approx(wanted, abs=0.1)
    assert abs(np.linalg.norm(third[3:]) - 1.0) < 1e-4


def test_links_get_thinner_and_joints_have_housings_about_their_axes() -> None:
    """Of arms whose file gives no radii, as all that ship."""
    for name in ("ar4", "parol6", "scara"):
        shape = ArmShape(arm := Arm.of(name))
        radii = [radius for _, _, radius in shape.pieces]
        assert radii == sorted(radii, reverse=True)
        assert radii[0] > 1.2 * radii[-1]
        assert len(shape.housings) == len(arm.driven)
        poses = np.array(shape.poses(np.array(arm.home_deg)))
        assert len(poses) == len(shape.pieces) + len(shape.housings)
        x, y, z, w = poses[len(shape.pieces)][3:]  # the first joint turns about z
        along = [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)]
        assert along == pytest.approx([0, 0, 1], abs=1e-4)


def test_a_sliding_joint_is_drawn_as_its_rail_and_has_no_dial() -> None:
    """Along which the rest of the arm moves."""
    arm = Arm.of("scara_z")
    shape = ArmShape(arm)
    low, high = (
        np.array(shape.poses(np.array([z, 0.0, 0.0, 0.0])))[:, :3] * shape.reach_mm for z in (0.0, 150.0)
    )
    index, length, _ = shape.pieces[0]
    assert (index, length * shape.reach_mm) == (0, pytest.approx(150.0))
    assert low[0] == pytest.approx([0, 0, 75], abs=0.1)
    assert high[0] == pytest.approx(low[0])
    assert (high - low)[1 : len(shape.pieces)] == pytest.approx(
        np.tile([0, 0, 150], (len(shape.pieces) - 1, 1)), abs=0.1
    )
    assert [any(dial) for dial in shape.dials(np.array(arm.home_deg))] == [False, True, True, True]


@pytest.mark.parametrize(("low", "high"), [(-300.0, 300.0), (0.0, 2000.0)])
def test_the_views_hold_an_arm_anywhere_on_its_rail(low: float, high: float) -> None:
    """Its reach about the middle of the rail, which need not be the base."""
    rail = Arm.of("community_rail")
    arm = replace(
        rail,
        joints=tuple(
            replace(joint, range_deg=(low, high), home_deg=low) if joint.slides else joint
            for joint in rail.joints
        ),
    )
    shape = ArmShape(arm)
    assert shape.reach_mm == pytest.approx(ArmShape(Arm.of("community")).reach_mm + (high - low) / 2)
    assert shape.middle * shape.reach_mm == pytest.approx([0.0, (low + high) / 2, 0.0], abs=1e-6)
    for place in (low, high):
        away = shape.outline(np.array([place, *arm.home_deg[1:]])) - shape.middle
        assert np.linalg.norm(away, axis=1).max() <= 1.0


@pytest.mark.parametrize("name", ["paper", "ar4", "scara", "moveo"])
def test_the_views_hold_the_home_posture(name: str) -> None:
    """In a picture as high as it is wide, of 75 degrees, which is that of the scene's camera."""
    arm = Arm.of(name)
    shape = ArmShape(arm)
    points = shape.outline(np.array(arm.home_deg))
    target = shape.middle + arm_scene.TARGET
    for view in ("side", "top", "free"):
        eye = shape.eye(view)
        ahead = (target - eye) / np.linalg.norm(target - eye)
        right = np.cross(ahead, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        seen = (points - eye) @ np.stack([right, np.cross(right, ahead), ahead], axis=1)
        assert (np.abs(seen[:, :2]) < np.tan(np.radians(37.5)) * seen[:, 2:]).all(), view


def test_the_view_from_above_is_aligned_with_the_axes() -> None:
    x, y, z = arm_scene.EYES["top"]
    assert x == 0.0
    assert -0.01 < y < 0.0 < z


def test_a_path_is_coloured_by_its_speed() -> None:
    times = np.linspace(0.0, 1.0, 101)
    points = np.column_stack((100.0 * times**2, 0.0 * times, 0.0 * times))  # from 0 to 200 mm/s
    colours, fastest = arm_scene.colours_of_speed(points, times)
    assert fastest == pytest.approx(200.0, rel=0.02)
    assert colours[0][2] > colours[0][0]  # blue
    assert colours[-1][0] > colours[-1][2]  # red
    still, none = arm_scene.colours_of_speed(np.zeros((3, 3)), np.array([0.0, 1.0, 2.0]))
    assert none == 0.0
    assert np.isfinite(still).all()
