"""Many poses at once through the library: the same as one by one."""

from __future__ import annotations

import armtempo
import numpy as np
import pytest


@pytest.mark.parametrize("name", ["ar4", "paper", "parol6"])
def test_many_poses_are_solved_as_one_by_one(name: str) -> None:
    arm, rng = armtempo.Arm.load(name), np.random.default_rng(2)
    low, high = np.array([joint.range_deg for joint in arm.joints]).T
    poses = armtempo.forward(arm, rng.uniform(low, high, (12, len(low))))
    poses[10:, :3, 3] *= 5.0  # out of reach
    near = 0.25 * (3.0 * low + high)
    found = armtempo.inverse_many(arm, poses, near)
    for number, pose in enumerate(poses[:10]):
        one = armtempo.inverse(arm, pose, near)
        usable = sorted(tuple(each.angles_deg) for each in one if each.usable)
        assert np.array(sorted(map(tuple, found.angles_deg[number][found.usable[number]]))) == pytest.approx(
            np.array(usable), abs=1e-7
        )
        assert found.nearest_deg[number] == pytest.approx(one[0].angles_deg, abs=1e-7)
    assert not found.usable[10:].any()
    assert np.isnan(found.nearest_deg[10:]).all()
    assert found.angles_deg.shape == (12, 8, len(low))


def test_rounded_poses_are_put_right_and_the_first_wrong_one_is_named() -> None:
    arm = armtempo.Arm.load("ar4")
    pose = armtempo.forward(arm, [10.0, 20.0, 30.0, 40.0, 50.0, 60.0])
    rounded = np.round(pose, 4)
    found = armtempo.inverse_many(arm, [pose[:3], rounded[:3]])
    assert found.nearest_deg[0] == pytest.approx(found.nearest_deg[1], abs=0.1)
    wrong = np.stack([pose, 2.0 * pose])
    with pytest.raises(armtempo.InputError, match="pose 2"):
        armtempo.inverse_many(arm, wrong)
    with pytest.raises(armtempo.InputError, match="no list of poses"):
        armtempo.inverse_many(arm, pose)
    with pytest.raises(armtempo.InputError, match="no closed-form"):
        armtempo.inverse_many("community", [pose])
