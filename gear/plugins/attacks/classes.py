"""Checks of the class names that targeted attacks on semantic segmentation take as options."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gear.formats.cityscapes import LABELS
from gear.values.errors import FieldError, GearError

LABEL_IDS: Mapping[str, int] = {label.name: label.id for label in LABELS if label.is_evaluated}


def check_classes(source_class: str, target: str) -> None:
    """Checks the options `source_class` and `target` of a targeted attack on semantic segmentation.

    Each option is empty or the name of a class that Cityscapes evaluates, and `source_class` is allowed only with
    `target`.

    Args:
        source_class: name of the class whose pixels are attacked; "" for all pixels.
        target: name of the class into which they shall be turned; "" for an untargeted attack.

    Raises:
        FieldError: an option is wrong; the message names it.
    """
    for name, value in (("source_class", source_class), ("target", target)):
        if value and value not in LABEL_IDS:
            raise FieldError(name, f"must be one of {', '.join(LABEL_IDS)}, got {value!r}")
    if source_class and not target:
        raise FieldError("target", "must name the class into which source_class is turned")


def check_seen(source_class: str, dataset: Sequence[Any]) -> None:
    """Checks that the ground truth of at least one sample contains the class `source_class`; an empty name passes.

    Args:
        source_class: name of a Cityscapes class, or "".
        dataset: samples with `label_ids`.

    Raises:
        GearError: no sample contains the class, so there is nothing to attack.
    """
    if source_class and not any(bool((sample.label_ids == LABEL_IDS[source_class]).any()) for sample in dataset):
        raise GearError(
            f"option source_class: none of the {len(dataset)} pictures show {source_class}; name another class"
        )
