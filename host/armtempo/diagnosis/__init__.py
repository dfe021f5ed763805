"""What looks wrong, and what to do about it: in an arm file and a job, on this machine, with the board."""
