"""Cityscapes classes as options of targeted attacks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gear.formats.cityscapes import LABELS
from gear.values.errors import FieldError, GearError

LABEL_IDS: Mapping[str, int] = {label.name: label.id for label in LABELS if label.is_evaluated}


def check_classes(attacked: str, target: str) -> None:
    """Checks that the target and the attacked class are evaluated classes or empty, and that an attacked class has
    a target.

    Raises:
        FieldError: one of these does not hold.
    """
    for name, value in (("attacked", attacked), ("target", target)):
        if value and value not in LABEL_IDS:
            raise FieldError(name, f"must be one of {', '.join(LABEL_IDS)}, got {value!r}")
    if attacked and not target:
        raise FieldError("target", "must say what the attacked class is to become")


def check_seen(attacked: str, dataset: Sequence[Any]) -> None:
    """Checks that some sample shows the attacked class, if one is named.

    Raises:
        GearError: no sample shows it, so that there is nothing to attack.
    """
    if attacked and not any(bool((sample.label_ids == LABEL_IDS[attacked]).any()) for sample in dataset):
        raise GearError(
            f"option attacked: none of the {len(dataset)} pictures shows {attacked}; name a class that is seen"
        )
