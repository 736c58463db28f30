"""Histograms of the metadata that a task stores for a sample, found without any knowledge of the task.

Two structures are recognised. A mapping from names to numbers, such as pixels per label, is a histogram. A list of
mappings, such as objects, is counted by each of its short text fields, such as label or type.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from gear.values.serial import Json

Counts = dict[str, dict[str, float]]
"""Histograms by name, each from label to number: `{"label_px": {"road": 81233}, "objects.kitti_type": {"Car": 3}}`."""

LONGEST_LABEL = 40
MOST_LABELS = 200


def count(facts: Json) -> Counts:
    """Returns the histograms in the metadata that a task stores for one sample: mappings from labels to numbers, and
    how often each text occurs in a list of objects.

    Args:
        facts: the metadata, JSON of any form.
    """
    if not isinstance(facts, dict):
        return {}
    found: Counts = {}
    for key, value in facts.items():
        if isinstance(value, dict) and value and all(map(is_number, value.values())):
            found[str(key)] = {str(label): float(number) for label, number in value.items()}
        elif isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
            found.update(_by_text(str(key), value))
    return found


def _by_text(key: str, items: Sequence[Mapping[str, Any]]) -> Counts:
    fields = [name for name in items[0] if all(is_label(item.get(name)) for item in items)]
    return {f"{key}.{name}": dict(Counter(str(item[name]) for item in items)) for name in fields}


def is_number(value: Any) -> bool:
    """Whether a value is a finite number; True and False are no numbers here."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def is_label(value: Any) -> bool:
    """Whether a value is a text of 1 to 40 characters, so that it can be the name of a class."""
    return isinstance(value, str) and 0 < len(value) <= LONGEST_LABEL


def without_identifiers(samples: Sequence[Counts]) -> list[Counts]:
    """Removes the histograms whose labels rarely repeat over the split, because such labels are names or codes, not
    classes.

    Args:
        samples: histograms of each sample.

    Returns:
        The same histograms without those whose labels are names or codes, one mapping per sample.
    """
    totals: dict[str, Counter[str]] = {}
    for counts in samples:
        for group, numbers in counts.items():
            totals.setdefault(group, Counter()).update(numbers)
    dropped = {
        group
        for group, total in totals.items()
        if len(total) > MOST_LABELS or (len(total) > 12 and len(total) * 2 > sum(total.values()))
    }
    return [{group: numbers for group, numbers in counts.items() if group not in dropped} for counts in samples]
