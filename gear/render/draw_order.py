"""Which of two surfaces at the very same depth is seen: nearly always the same one in every process.

Where surfaces cut through each other, a pixel in some pictures has the same depth on both, to the last bit, and shows
the one that is drawn first. MuJoCo hands a scene's parts to Filament in the order of a hash table by their addresses,
which no two processes share. What goes into an empty bucket of such a table comes before all that was put in earlier;
only what shares a bucket stands where chance will have it. Tables grow and never shrink: one that once held many parts
has a bucket for nearly each of the model's.
"""

from __future__ import annotations

from typing import Any

BUCKETS_A_PART = 32
"""So that one part in thirty shares its bucket. For a town that takes 0.2 s of a core and 20 MB."""


def widen(mjrf: Any, context: Any, scene: Any, parts: int) -> None:
    """Makes room in an empty scene, before so many parts are put into it."""
    passers_by = [context.create_renderable(mjrf.RenderableParams()) for _ in range(BUCKETS_A_PART * parts)]
    for each in passers_by:
        scene.add_renderable(each)
    for each in passers_by:
        scene.remove_renderable(each)
