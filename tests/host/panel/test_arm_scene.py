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
from armtempo.panel.arm_scene import ArmShape

from tests.host.panel.fakes import ARM


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
    tray, (floor_low, floor_high) = shape.workspace
    assert np.array(tray) * shape.reach_mm == pytest.approx(np.array([[100, -50, 0], [200, 50, 30]]))
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
    base, third = shape.poses(angles)[len(shape.pieces) :]
    assert base == [0, 0, 0, 0, 0, 0, 1]
    wanted = all_frames(Geometry.of(arm), np.radians(all_angles_deg(arm, angles)).tolist())[3, :3, 3]
    assert np.array(third[:3]) * shape.reach_mm == pytest.approx(wanted, abs=0.1)
    assert abs(np.linalg.norm(third[3:]) - 1.0) < 1e-4
