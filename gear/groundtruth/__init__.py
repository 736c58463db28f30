"""Ground truth, computed from the id buffer and from the triangles of the objects."""
