"""A plan as a ROS JointTrajectory, in radians, 50 points a second, and as a table: feed.yaml, feed.csv."""

from pathlib import Path

import armtempo

plan = armtempo.plan(armtempo.Arm.paper(), armtempo.Job.paper())
Path("feed.yaml").write_text(plan.to_ros(rate_hz=50.0, frame_id="base"), encoding="utf-8")
Path("feed.csv").write_text(plan.to_csv(rate_hz=50.0), encoding="utf-8")
print("wrote feed.yaml and feed.csv")
