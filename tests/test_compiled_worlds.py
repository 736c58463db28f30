"""The memory of compiled worlds gives what compiling gives, and its worlds share nothing that a test can change."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from gear.testing.tiny_town import CLEAR, TINY_TOWN, tiny_scenes
from gear.world.assets.library import AssetLibrary
from gear.world.compilation.compiled_world import CompiledWorld, compile_world
from gear.world.compilation.world_plan import WorldPlan, plan_world
from tests.compiled_worlds import CompiledOnce


@pytest.fixture(scope="module")
def plan() -> WorldPlan:
    return plan_world(AssetLibrary.for_town(TINY_TOWN), tiny_scenes().scenes["board"], CLEAR)


def test_worlds_from_memory_have_the_bytes_of_the_compiled_one_and_are_apart(plan: WorldPlan) -> None:
    compiled: list[CompiledWorld] = []

    def compiling(plan: WorldPlan) -> CompiledWorld:
        compiled.append(compile_world(plan))
        return compiled[-1]

    once = CompiledOnce(compiling)
    first, second = once(plan), once(plan)
    assert len(compiled) == 1
    for name in ("model", "placement_model"):
        models = [getattr(world, name) for world in (*compiled, first, second)]
        buffers = [np.zeros(mujoco.mj_sizeModel(model), np.uint8) for model in models]
        for model, buffer in zip(models, buffers, strict=True):
            mujoco.mj_saveModel(model, None, buffer)
        assert all(np.array_equal(buffer, buffers[0]) for buffer in buffers[1:])
    before = second.model.geom_rgba.copy()
    first.model.geom_rgba[:] = 0
    assert np.array_equal(second.model.geom_rgba, before) and np.array_equal(once(plan).model.geom_rgba, before)
