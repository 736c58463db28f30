"""Road users: drawing them, placing them, and moving them through time."""
