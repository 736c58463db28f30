"""The built-in controllers of the closed loop, one file each, and what the baselines have in common."""
