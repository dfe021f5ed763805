"""What is given and what comes out: arm, job, pose, plan, and the files that hold them."""
