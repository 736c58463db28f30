"""Classes as options of targeted attacks."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from gear.plugins.attacks.classes import LABEL_IDS, check_classes, check_seen
from gear.values.errors import FieldError, GearError


@pytest.mark.parametrize(("source_class", "target"), [("", ""), ("", "road"), ("car", "road")])
def test_evaluated_classes_are_accepted(source_class: str, target: str) -> None:
    check_classes(source_class, target)


@pytest.mark.parametrize(
    ("source_class", "target", "message"),
    [
        ("", "tarmac", "target: must be one of road, sidewalk"),
        ("ego vehicle", "road", "source_class: must be one of"),
        ("car", "", "target: must name the class into which source_class is turned"),
    ],
)
def test_other_combinations_are_refused(source_class: str, target: str, message: str) -> None:
    with pytest.raises(FieldError, match=message):
        check_classes(source_class, target)


def test_the_attacked_class_must_occur() -> None:
    samples = [SimpleNamespace(label_ids=np.full((2, 2), LABEL_IDS["road"], np.uint8))]
    check_seen("road", samples)
    check_seen("", samples)
    with pytest.raises(GearError, match="none of the 1 pictures show car"):
        check_seen("car", samples)
