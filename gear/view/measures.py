"""The measures by which samples can be filtered, found in a task's facts without knowing the task.

Lists of mappings are objects. Fields whose name ends in `_fraction` or `distance_m` are their measures (visible share,
distance); the first field that is a short text in all of them is their label.
"""

from __future__ import annotations

from typing import Any

from gear.values.serial import Json
from gear.view.counts import is_label, is_number

MEASURES = ("_fraction", "distance_m")
"""Suffixes of fields with the visible share of an object and with its distance."""


def measures(facts: Json) -> Json:
    """`labels` with one entry per object, and `values` by field with one entry per object; None where an object
    lacks the field.
    """
    lists = facts.values() if isinstance(facts, dict) else ()
    objects: list[dict[str, Any]] = []
    labels: list[str] = []
    for items in lists:
        if isinstance(items, list) and items and all(isinstance(item, dict) for item in items):
            label = next((name for name in items[0] if all(is_label(item.get(name)) for item in items)), "")
            objects += items
            labels += [item.get(label, "") for item in items]
    names = dict.fromkeys(
        name for item in objects for name, value in item.items() if name.endswith(MEASURES) and is_number(value)
    )
    if not names:
        return {"labels": [], "values": {}}
    return {"labels": labels, "values": {name: [_rounded(item.get(name)) for item in objects] for name in names}}


def _rounded(value: Any) -> float | None:
    return round(float(value), 3) if is_number(value) else None
