"""Compiles each world of the tiny town once per process, because hundreds of tests collect, drive or attack in it.

Compiling takes most of a second; a copy of the compiled models takes milliseconds and has the same bytes.
"""

from __future__ import annotations

import copy
import dataclasses
import json
from collections import OrderedDict
from collections.abc import Callable

import pytest

from gear.testing.tiny_town import TINY_TOWN
from gear.world import world
from gear.world.compilation import world_cache
from gear.world.compilation.compiled_world import CompiledWorld
from gear.world.compilation.world_plan import WorldPlan

KEPT = 24
"""Number of worlds that a process keeps; the least recently used are dropped."""


class CompiledOnce:
    """`compile_world` with a memory of the tiny town's worlds. Worlds of other towns are compiled each time.

    Attributes:
        is_on: whether worlds are taken from memory.
    """

    def __init__(self, compile_world: Callable[[WorldPlan], CompiledWorld]) -> None:
        self.is_on = True
        self._compile = compile_world
        self._worlds: OrderedDict[str, CompiledWorld] = OrderedDict()

    def __call__(self, plan: WorldPlan) -> CompiledWorld:
        """A world that the caller may change: its models are copies.

        Args:
            plan: the contents of the world.
        """
        if not self.is_on or plan.town != TINY_TOWN:
            return self._compile(plan)
        key = json.dumps(world_cache.world_key(plan), sort_keys=True)
        if key not in self._worlds:
            self._worlds[key] = self._compile(plan)
            if len(self._worlds) > KEPT:
                self._worlds.popitem(last=False)
        self._worlds.move_to_end(key)
        kept = self._worlds[key]
        models = {name: copy.copy(getattr(kept, name)) for name in ("model", "placement_model")}
        return dataclasses.replace(kept, slots=plan.slots, **models)


def install(patch: pytest.MonkeyPatch) -> CompiledOnce:
    """Puts the memory in the places from which gear compiles worlds.

    Args:
        patch: the patch that takes it away again.
    """
    once = CompiledOnce(world.compile_world)
    for module in (world, world_cache):
        patch.setattr(module, "compile_world", once)
    return once
