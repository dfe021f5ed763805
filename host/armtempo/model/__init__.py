"""The data: arm, job, pose, sequence, plan, and their files."""
