"""Step generation: from the splines of a motion to the times of its steps, in integers, without hardware."""
