from __future__ import annotations

import sys
import types
from collections.abc import Callable, Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import ModelSpec
from gear.plugins import build as building
from gear.plugins.manager import discover
from gear.testing.tiny_networks import tiny_depth, tiny_segmenter
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.verbs.collect.run import collect


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., None]]:
    """Makes networks known by name, as an installed package would."""

    def known(*specs: ModelSpec[Any]) -> None:
        module = types.ModuleType("tiny_package")
        module.gear_models = hookimpl(lambda: list(specs), specname="gear_models")  # type: ignore[attr-defined]
        sys.modules["tiny_package"] = module
        found = discover([EntryPoint(name="tiny", value="tiny_package", group="gear")])
        monkeypatch.setattr(building, "catalogue", lambda: found)

    known(tiny_segmenter, tiny_depth)
    yield known
    sys.modules.pop("tiny_package", None)


@pytest.fixture(scope="session")
def street(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Roots of small datasets, each collected once a session."""
    made: dict[tuple[Any, ...], Path] = {}

    def root(task: str, split: str = "train", samples: int = 6) -> Path:
        key = (task, split, samples)
        if key not in made:
            made[key] = tmp_path_factory.mktemp(f"{task}_{split}")
            collect(
                task, out=made[key], town=TINY_TOWN, scene="board", split=split, samples=samples,
                renderer="classic", quality="fast",
                settings=[f"scenes={TINY_SCENES}", "options.width_px=128", "options.height_px=64"],
            )  # fmt: skip
        return made[key]

    return root
