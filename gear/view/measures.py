"""The numbers by which the page filters samples, found in a task's metadata without any knowledge of the task.

Every list of mappings is taken as a list of objects. Fields whose name ends in `_fraction` (visible share) or
`distance_m` are the measures of an object. The first field that is a short text in all objects is their label.
"""

from __future__ import annotations

from typing import Any

from gear.values.serial import Json
from gear.view.counts import is_label, is_number

MEASURES = ("_fraction", "distance_m")
"""Endings of the names of fields that contain an object's visible share or its distance in metres."""


def measures(facts: Json) -> Json:
    """Returns the measures of all objects in the metadata of one sample: numbers in fields whose names end in
    `_fraction` or `distance_m`.

    Args:
        facts: the metadata that the task stores; lists of mappings in it are lists of objects.

    Returns:
        `labels`, a list with one label per object, and `values`, a mapping from the field's name to a list with one
        number per object; None where an object has no such field.
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
