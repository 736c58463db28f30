"""Scripts that make gear's assets: every mesh and texture under `mjcf/` comes from here, the same bytes each time."""
