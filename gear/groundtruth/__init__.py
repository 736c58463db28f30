"""Ground truth, computed from the id buffer (the geom id of each pixel) and from the triangles of the objects."""
