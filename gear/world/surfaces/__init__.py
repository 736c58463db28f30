"""Patch surfaces: the faces that can show patches, their textures, and the boards and vehicles that carry them."""
