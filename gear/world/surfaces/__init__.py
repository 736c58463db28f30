"""Patch surfaces: the faces that show patches, their textures and what carries them."""
