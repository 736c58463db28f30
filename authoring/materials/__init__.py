"""Procedural textures and the materials made of them.

`python -m authoring.materials.build` draws every texture into mjcf/textures; the same bytes each time.
"""

from __future__ import annotations

from authoring.materials.registry import MATERIALS, Material, material_xml

__all__ = ["MATERIALS", "Material", "material_xml"]
