"""Step generation: from the splines of a motion to the times of its steps, in integers, without hardware.

Compiled functions are long here: calling one from another takes about 250 instructions, more than 1 % of each. Comments
name their phases instead.
"""
