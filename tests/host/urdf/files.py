"""URDF files of the tests, and their tools' poses by a forward kinematics of the tests' own."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from armtempo.cli import main
from click.testing import CliRunner
from numpy.typing import NDArray

Array = NDArray[np.float64]
FOLDER = Path(__file__).parents[2] / "data" / "urdf"


def about(axis: Array, angle: float) -> Array:
    """A (4, 4) rotation, by Rodrigues' formula."""
    axis = axis / np.linalg.norm(axis)
    cross = np.cross(np.eye(3), axis)
    pose = np.eye(4)
    pose[:3, :3] += math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    return pose


def tool_pose(path: Path, angles: dict[str, float], link: str = "tool") -> Array:
    """The pose of a link in mm, straight from the XML."""
    pose = np.eye(4)
    above = {joint.find("child").get("link"): joint for joint in ElementTree.parse(path).iter("joint")}  # type: ignore[union-attr]
    while link in above:
        joint = above[link]
        origin = joint.find("origin")
        numbers = {key: np.array(origin.get(key).split(), float) for key in ("xyz", "rpy")}  # type: ignore[union-attr]
        move = np.eye(4)
        move[:3, 3] = 1000 * numbers["xyz"]
        for unit, angle in zip(np.eye(3)[::-1], numbers["rpy"][::-1], strict=True):
            move = move @ about(unit, angle)
        if joint.get("name") in angles:
            axis = np.array(joint.find("axis").get("xyz").split(), float)  # type: ignore[union-attr]
            value = angles[str(joint.get("name"))]
            slide = np.eye(4)
            slide[:3, 3] = 1000 * value * axis / np.linalg.norm(axis)
            move = move @ (slide if joint.get("type") == "prismatic" else about(axis, value))
        pose, link = move @ pose, joint.find("parent").get("link")  # type: ignore[union-attr, assignment]
    return pose


def imported(tmp_path: Path, name: str, *options: str) -> tuple[Path, str]:
    """The arm file of a URDF of the tests, and what the command said."""
    out = tmp_path / f"{name}.toml"
    result = CliRunner().invoke(main, ["import-urdf", str(FOLDER / f"{name}.urdf"), "-o", str(out), *options])
    assert result.exit_code == 0, result.output
    return out, result.output


J2_LIMIT = '    <limit lower="-2.0" upper="2.0" effort="10" velocity="1.5"/>\n'
J3_LIMIT = '    <limit lower="-3.0" upper="3.0" effort="10" velocity="2.0"/>\n'
