"""Labels, paint and faces by the names of default classes."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from gear.values.errors import TownError
from gear.values.labels import LABEL_BY_NAME
from gear.world.assets.geom_classes import HIDDEN_CODE, classify, unprefixed_class

PATH = Path("town.xml")


def spec_of(classes: dict[str, int]) -> mujoco.MjSpec:
    defaults = "".join(f'<default class="{name}"><geom group="{group}"/></default>' for name, group in classes.items())
    geoms = "".join(f'<geom name="g{index}" class="{name}" size="1"/>' for index, name in enumerate(classes))
    xml = f"<mujoco><default>{defaults}</default><worldbody>{geoms}</worldbody></mujoco>"
    spec = mujoco.MjSpec.from_string(xml)
    spec.compile()
    return spec


def test_the_first_part_of_a_class_is_its_label() -> None:
    names = {"road": 0, "car.paint": 1, "building.brick": 2, "billboard.face": 1, "collision": 3, "nonsense": 3}
    classes = classify(spec_of(names), PATH)
    labels = ("road", "car", "building", "billboard")
    assert classes.label_code.tolist() == [*(LABEL_BY_NAME[name].code for name in labels), HIDDEN_CODE, HIDDEN_CODE]
    np.testing.assert_array_equal(classes.is_paint, [False, True, False, False, False, False])
    np.testing.assert_array_equal(classes.is_face, [False, False, False, True, False, False])


@pytest.mark.parametrize("name", ["nonsense", "sky", "paint.car"])
def test_a_visible_geom_needs_a_label(name: str) -> None:
    with pytest.raises(TownError, match=f"geom 'g0' can be seen but has class '{name}'"):
        classify(spec_of({name: 0}), PATH)


@pytest.mark.parametrize("name", ["car.paint", "van/car.paint", "a/b/car.paint"])
def test_prefixes_of_files_are_removed(name: str) -> None:
    assert unprefixed_class(name) == "car.paint"
