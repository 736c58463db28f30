"""Road users: drawing them at random, placing them on the ground, and moving them through time."""
