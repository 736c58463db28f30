"""Makes Filament's draw order nearly equal in every process.

Of two surfaces at equal depth, a pixel shows the one that is drawn first. MuJoCo draws a scene's parts in the order of
a hash table by address, and addresses differ between processes. A part in an empty bucket comes before all earlier
parts; only parts that share a bucket have a random order. Hash tables grow and never shrink, so a table that once held
many parts has its own bucket for nearly every part of the model.
"""

from __future__ import annotations

from typing import Any

BUCKETS_PER_PART = 32
"""Buckets per part: one part in thirty shares its bucket. For a town this takes 0.2 s of a core and 20 MB."""


def widen(mjrf: Any, context: Any, scene: Any, parts: int) -> None:
    """Enlarges the hash table of an empty scene.

    Args:
        mjrf: MuJoCo's Filament module.
        context: the Filament context.
        scene: the empty scene.
        parts: number of parts that it will hold.
    """
    placeholders = [context.create_renderable(mjrf.RenderableParams()) for _ in range(BUCKETS_PER_PART * parts)]
    for each in placeholders:
        scene.add_renderable(each)
    for each in placeholders:
        scene.remove_renderable(each)
