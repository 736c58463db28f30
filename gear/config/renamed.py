"""Keys of configs and options that have a new name, for the hints in error messages."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

RENAMED = {
    "only_if_sure": "only_on_alarm",
    "statistics_pictures": "max_clean_pictures",
    "learning_pictures": "max_patched_pictures",
    "attacked": "source_class",
    "appears": "appear_class",
    "least_scale": "min_scale",
    "most_scale": "max_scale",
    "like": "reference_patches",
    "considered": "pre_nms_top_n",
    "aligns": "refine_depth",
    "least_score": "score_threshold",
    "warm_up": "warmup_fraction",
    "final_rate": "final_lr_fraction",
}
"""New names by earlier names, of all configs and of the options of all plugins."""


def unknown_key(name: str, known: Iterable[str]) -> str:
    """The message for an unknown key: its new name, the known key with the most similar spelling, or all known keys.

    Args:
        name: the unknown key.
        known: the keys that exist in its place.
    """
    fields = tuple(known)
    if RENAMED.get(name) in fields:
        return f"unknown key (it is called {RENAMED[name]!r} now)"
    close = difflib.get_close_matches(name, fields, n=1)
    if close:
        return f"unknown key (did you mean {close[0]!r}?)"
    return f"unknown key (there are: {', '.join(fields)})" if fields else "unknown key (there are none)"
