"""A driving environment in the tiny town, whose world all tests of a process share."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import pytest

from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN, tiny_world
from gear.world.world import World

pytest.importorskip("gymnasium")

TINY: dict[str, Any] = {"town": str(TINY_TOWN), "scenes": str(TINY_SCENES), "scene": "board"}


@cache
def shared(scene_name: str) -> World:
    return tiny_world(scene_name)


@pytest.fixture
def tiny(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Makes environments, and closes them after the test."""
    import gymnasium

    import gear.envs
    from gear.envs import stage

    monkeypatch.setattr(stage, "load_or_compile", lambda *, scene_name, **_: shared(scene_name))

    def make(**settings: Any) -> gymnasium.Env[Any, Any]:
        return gymnasium.make(gear.envs.DRIVE, **(TINY | settings))

    return make
