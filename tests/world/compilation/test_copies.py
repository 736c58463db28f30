"""Instances that go around dm_control are the same as those that it makes, in the same places."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pytest

from gear.testing.tiny_town import CLEAR, TINY_TOWN, tiny_scenes
from gear.world.assets.library import AssetLibrary
from gear.world.compilation.compiled_world import CompiledWorld, compile_world
from gear.world.compilation.copies import Copy, put_copies_into
from gear.world.compilation.instances import AssetInstances
from gear.world.compilation.world_plan import plan_world


def content(model: mujoco.MjModel) -> bytes:
    """Of its file, but for the folder that textures are laid out in, which has another name each time."""
    buffer = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return re.sub(rb"/gear-\w{8}/", b"/", buffer.tobytes())


@pytest.mark.parametrize("scene", ["board", "truck"])
def test_a_world_of_copies_is_the_same(scene: str, monkeypatch: pytest.MonkeyPatch) -> None:
    copied, made = [], AssetInstances.copy_instance

    def copy(parts: AssetInstances, *details: object) -> None:
        copied.append(details)
        made(parts, *details)  # type: ignore[arg-type]

    def build() -> CompiledWorld:
        return compile_world(plan_world(AssetLibrary.for_town(TINY_TOWN), tiny_scenes().scenes[scene], CLEAR))

    monkeypatch.setattr(AssetInstances, "copy_instance", copy)
    world = build()
    assert len(copied) > 5
    monkeypatch.setattr(AssetInstances, "has_instance", lambda *_: False)
    expected = build()
    assert content(world.placement_model) == content(expected.placement_model)
    assert content(world.model) == content(expected.model)
    assert (world.classes.label_code == expected.classes.label_code).all()


def test_copies_have_names_and_number_plates_of_their_own() -> None:
    world = ET.fromstring(
        '<worldbody><body name="van_0"><geom name="van_0_hull" mesh="van/hull"/>'
        '<body name="van_0_door"><geom name="van_0_plate" mesh="van/plate"/></body></body><body name="van/"/>'
        '<geom name="van/"/><body name="bus_0"/></worldbody>'
    )
    copies = [Copy(name=f"van_{k}", original="van_0", plates={"plate": f"van/plate_{k}"}) for k in (1, 22)]
    put_copies_into(world, {"van/": copies})
    assert [element.get("name") for element in world] == ["van_0", "van/", "van_1", "van_22", "van/", "bus_0"]
    assert [(geom.get("name"), geom.get("mesh")) for geom in world.findall("body[@name='van_22']//geom")] == [
        ("van_22_hull", "van/hull"),
        ("van_22_plate", "van/plate_22"),
    ]
    assert world.find("body[@name='van_22']/body[@name='van_22_door']") is not None
    assert world.find(".//geom[@name='van_0_plate']").get("mesh") == "van/plate"  # type: ignore[union-attr]
