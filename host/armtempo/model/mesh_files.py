"""Meshes of an arm's links for display: STL files in mm, in a folder next to the arm file.

``arm.toml`` has its meshes in ``arm-meshes``: ``3.stl`` moves with the third row and is in its frame, ``0.stl`` is the
base.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.atomic_file import os_reason
from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])


def folder_of(arm_file: Path) -> Path:
    """The folder with the meshes of an arm file."""
    return arm_file.with_name(f"{arm_file.stem}-meshes")


def of_arm(arm: Arm) -> dict[int, Path]:
    """The files by row number, 0 for the base; empty for an arm without a file."""
    if not arm.source:
        return {}
    folder = folder_of(Path(arm.source))
    files = {number: folder / f"{number}.stl" for number in range(len(arm.joints) + 1)}
    return {number: file for number, file in files.items() if file.is_file()}


def write(arm_file: Path, corners_mm: Mapping[int, Array]) -> list[Path]:
    """Write the triangles (N, 3, 3) of each row, replacing older files; returns the paths.

    Raises InputError if they cannot be written.
    """
    folder = folder_of(arm_file)
    try:
        folder.mkdir(exist_ok=True)
        for old in folder.glob("*.stl"):
            if old.stem.isdigit():
                old.unlink()
        return [_write(folder / f"{row}.stl", corners) for row, corners in sorted(corners_mm.items())]
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {os_reason(error)}", "choose another place") from None


def _write(file: Path, corners_mm: Array) -> Path:
    triangles = np.zeros(len(corners_mm), _TRIANGLE)
    triangles["corners"] = corners_mm
    normal = np.cross(corners_mm[:, 1] - corners_mm[:, 0], corners_mm[:, 2] - corners_mm[:, 0])
    triangles["normal"] = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    file.write_bytes(bytes(80) + np.uint32(len(corners_mm)).tobytes() + triangles.tobytes())
    return file


def read(file: Path) -> Array:
    """The triangles (N, 3, 3) of a file that ``write`` wrote."""
    corners: Array = np.frombuffer(file.read_bytes(), _TRIANGLE, offset=84)["corners"].astype(np.float64)
    return corners
