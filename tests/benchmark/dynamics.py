"""Inverse dynamics against pinocchio, at random motions of arms from URDF files, and of rows that turn or slide.

    python -m tests.benchmark.dynamics [--count 1000]

The test's URDFs with random masses, centres of mass and inertias in every link, and of a load. Prints the largest
difference of any joint's torque, as a part of the largest torque; exits with 1 if it exceeds 1e-9. Of rows drawn at
random the tool's pose in mm and its Jacobian too. pinocchio: pip install pin.
"""

from __future__ import annotations

import argparse
import math
import re
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio
from armtempo.kinematics import Geometry, all_frames
from armtempo.kinematics.dynamics import GRAVITY_M_S2, joint_torques, per_rad
from armtempo.kinematics.of_arm import forward
from armtempo.model.arm import Arm
from armtempo.model.joint_unit import PRISMATIC, REVOLUTE
from armtempo.model.parts import Dynamics, Joint, Limits, Load, Motor
from armtempo.new_arm import urdf_reader
from armtempo.new_arm import urdf_rows as dh
from armtempo.new_arm.urdf_chain import Chain
from armtempo.planning.tool import Tool

FOLDER = Path(__file__).parents[1] / "data" / "urdf"
NAMES = ("three_planar", "four_skew", "seven_intersecting")
SEED = 20_261_124
ALLOWED = 1e-9
CHAINS, POSTURES = 200, 5


def with_masses(text: str, rng: np.random.Generator) -> str:
    """A URDF whose links all have a mass off their frames' origins, and an inertia that a body can have."""

    def inertial(link: re.Match[str]) -> str:
        shape = rng.uniform(-0.2, 0.2, (3, 3))
        tensor = np.trace(shape @ shape.T) * np.eye(3) - shape @ shape.T
        xyz, rpy = (" ".join(map(repr, map(float, rng.uniform(-size, size, 3)))) for size in (0.1, 3.0))
        places = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
        inertia = " ".join(f'{key}="{float(tensor[at])!r}"' for key, at in places.items())
        return (
            f'<link name="{link[1]}"><inertial><origin xyz="{xyz}" rpy="{rpy}"/>'
            f'<mass value="{rng.uniform(0.2, 3.0)!r}"/><inertia {inertia}/></inertial></link>'
        )

    return re.sub(r'<link name="([^"]+)"/>', inertial, text)


def arm_of(chain: Chain) -> Arm:
    """The arm of a chain with all digits."""
    axes = [dh.AxisLine(joint.point_mm, joint.direction) for joint in chain.joints]
    rows = dh.derive(axes, chain.zero_pose, dh.Near(1e-10, 1e-8))
    joints = []
    for row, frame in zip(rows, all_frames(dh.geometry(rows), [0.0] * len(rows))[1:], strict=True):
        body = None if row.joint is None else chain.joints[row.joint].body
        dynamics = body.in_frame(frame) if body else None
        name = "fixed" if row.joint is None else chain.joints[row.joint].name
        range_deg = (-0.001, 0.001) if row.joint is None else (-360.0, 360.0)
        joints.append(
            Joint(name, row.d_mm, row.a_mm, row.alpha_deg, row.theta_deg, range_deg, dynamics=dynamics)
        )
    return Arm(chain.robot, tuple(joints))


def difference(path: Path, count: int, rng: np.random.Generator) -> tuple[float, float]:
    """Largest difference of torques and largest torque, Nm."""
    model = pinocchio.buildModelFromUrdf(str(path))
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY_M_S2])
    arm = arm_of(urdf_reader.read(path))
    shape = rng.uniform(-0.1, 0.1, (3, 3))
    tensor = np.trace(shape @ shape.T) * np.eye(3) - shape @ shape.T
    centre = rng.uniform(-0.1, 0.1, 3)
    inertia = (*tensor.diagonal(), tensor[0, 1], tensor[0, 2], tensor[1, 2])
    load = Load("load", 0.8, centre_mm=tuple(1e3 * centre), inertia_kg_m2=tuple(map(float, inertia)))
    arm = replace(arm, loads=(load,)).holding("load")
    data = model.createData()
    pinocchio.forwardKinematics(model, data, np.zeros(model.nq))
    tool = all_frames(Geometry.of(arm), [0.0] * len(arm.joints))[-1]
    at = data.oMi[model.njoints - 1].inverse() * pinocchio.SE3(tool[:3, :3], 1e-3 * tool[:3, 3])
    model.appendBodyToJoint(model.njoints - 1, pinocchio.Inertia(0.8, centre, tensor), at)
    data = model.createData()
    moving = [number for number, joint in enumerate(arm.joints) if joint.name != "fixed"]
    assert [arm.joints[number].name for number in moving] == list(model.names)[1:]
    motion = np.zeros((3, count, len(arm.joints)))
    motion[:, :, moving] = rng.uniform(-3.0, 3.0, (3, count, len(moving)))
    found = joint_torques(arm, *motion)[:, moving]
    wanted = np.array(
        [pinocchio.rnea(model, data, *each) for each in np.swapaxes(motion[:, :, moving], 0, 1)]
    )
    return float(np.abs(found - wanted).max()), float(np.abs(wanted).max())


def placed(joint: Joint) -> pinocchio.SE3:
    """The frame after a row at 0 in the frame before it, in m."""
    no_turn, still = np.eye(3), np.zeros(3)
    turn = pinocchio.SE3(pinocchio.rpy.rpyToMatrix(0.0, 0.0, math.radians(joint.theta_offset_deg)), still)
    along = pinocchio.SE3(no_turn, 1e-3 * np.array([joint.a_mm, 0.0, joint.d_mm]))
    return (
        turn
        * along
        * pinocchio.SE3(pinocchio.rpy.rpyToMatrix(math.radians(joint.alpha_deg), 0.0, 0.0), still)
    )


def rows_difference(rng: np.random.Generator) -> np.ndarray:
    """Of one chain of 2 to 7 random rows: differences of forces, as a part of the largest, of poses (mm), and of the
    Jacobian (m, rad)."""
    model = pinocchio.Model()
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY_M_S2])
    joints, place = [], pinocchio.SE3.Identity()
    for number in range(rng.integers(2, 8)):
        slides = bool(rng.integers(2))
        (d, a), (alpha, theta) = (
            rng.uniform(-150.0, 150.0, 2).tolist(),
            rng.uniform(-180.0, 180.0, 2).tolist(),
        )
        shape, mass, centre = rng.uniform(-0.2, 0.2, (3, 3)), rng.uniform(0.2, 3.0), rng.uniform(-0.1, 0.1, 3)
        tensor = np.trace(shape @ shape.T) * np.eye(3) - shape @ shape.T
        inertia = (*tensor.diagonal().tolist(), *tensor[[0, 0, 1], [1, 2, 2]].tolist())
        joint = Joint(
            f"j{number}", d, a, alpha, theta, (-300.0, 300.0), 0.0, Limits(1.0, 1.0, 1.0),
            Motor(1, 200, 16, 1.0, mm_per_rev=8.0 if slides else None),
            dynamics=Dynamics(mass, tuple((1e3 * centre).tolist()), inertia),
            type=PRISMATIC if slides else REVOLUTE,
        )  # fmt: skip
        joints.append(joint)
        kind = pinocchio.JointModelPZ() if slides else pinocchio.JointModelRZ()
        last = model.addJoint(number, kind, place, joint.name)
        place = placed(joint)
        model.appendBodyToJoint(last, pinocchio.Inertia(mass, centre, tensor), place)
    tip = model.addFrame(pinocchio.Frame("tip", last, 0, place, pinocchio.FrameType.OP_FRAME))
    arm, data = Arm("rows", tuple(joints)), model.createData()
    scale, motion = per_rad(arm), rng.uniform(-2.0, 2.0, (3, POSTURES, len(joints)))
    found = joint_torques(arm, *motion)
    wanted = np.array([pinocchio.rnea(model, data, *each) for each in np.swapaxes(motion * scale, 0, 1)])
    most = np.array([np.abs(found - wanted).max() / np.abs(wanted).max(), 0.0, 0.0])
    at_deg = np.degrees(motion[0])
    poses, state = forward(arm, at_deg), Tool(arm, list(range(len(joints))), at_deg[0]).at(at_deg)
    for number, at in enumerate(motion[0] * scale):
        jacobian = pinocchio.computeFrameJacobian(model, data, at, tip, pinocchio.LOCAL_WORLD_ALIGNED)
        pinocchio.framesForwardKinematics(model, data, at)
        pose = data.oMf[tip]
        ours = (
            np.vstack([1e-3 * state.slope_mm_deg[number], state.axes_deg[number]]) * math.degrees(1.0) / scale
        )
        off = poses[number, :3, 3] - 1e3 * pose.translation, poses[number, :3, :3] - pose.rotation
        most[1] = max(most[1], *(np.abs(each).max() for each in off))
        most[2] = max(most[2], np.abs(ours - jacobian).max())
    return most


def main() -> int:
    """All arms."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    count = parser.parse_args().count
    rng, worst = np.random.default_rng(SEED), 0.0
    print(f"pinocchio {pinocchio.__version__}, seed {SEED}, {count} random motions each")
    with tempfile.TemporaryDirectory() as folder:
        for name in NAMES:
            text = with_masses((FOLDER / f"{name}.urdf").read_text(encoding="utf-8"), rng)
            endless = re.sub(
                'type="continuous">',
                'type="revolute"><limit lower="-3" upper="3" effort="1" velocity="1"/>',
                text,
            )
            path = Path(folder) / f"{name}.urdf"
            path.write_text(endless, encoding="utf-8")
            off, most = difference(path, count, rng)
            print(f"{name}: torques up to {most:.4g} Nm, off by {off:.1e} Nm at most")
            worst = max(worst, off / most)
    print(f"largest difference {worst:.1e} of the largest torque")
    force, pose, slope = np.max([rows_difference(rng) for _ in range(CHAINS)], axis=0)
    print(
        f"{CHAINS} chains of rows that turn or slide: forces off by {force:.1e} of the largest, poses by {pose:.1e} "
        f"mm, Jacobians by {slope:.1e}"
    )
    return int(max(worst, force, pose, slope) > ALLOWED)


if __name__ == "__main__":
    sys.exit(main())
