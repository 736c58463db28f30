"""Makes Filament's draw order nearly the same in every process.

If two surfaces have equal depth, a pixel shows the surface that is drawn first. MuJoCo draws the parts of a scene in
the order of a hash table of addresses, and addresses differ between processes. A part in an empty bucket comes before
all earlier parts; only parts that share a bucket have a random order. Hash tables grow but never shrink. A table that
once held many parts therefore has a separate bucket for nearly every part of the model.
"""

from __future__ import annotations

from typing import Any

BUCKETS_PER_PART = 32
"""Number of hash-table buckets per part of the model. With 32 buckets, one part in thirty shares its bucket. The table
of a town costs 0.2 s on one core and 20 MB.
"""


def widen(mjrf: Any, context: Any, scene: Any, parts: int) -> None:
    """Enlarges the hash table of an empty scene, so that its draw order is nearly the same in every process.

    Args:
        mjrf: MuJoCo's Filament module.
        context: the Filament context.
        scene: the empty scene.
        parts: number of parts that the scene will have.
    """
    placeholders = [context.create_renderable(mjrf.RenderableParams()) for _ in range(BUCKETS_PER_PART * parts)]
    for each in placeholders:
        scene.add_renderable(each)
    for each in placeholders:
        scene.remove_renderable(each)
