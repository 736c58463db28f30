"""Ground truth, measured on the id buffer and on the triangles themselves."""
