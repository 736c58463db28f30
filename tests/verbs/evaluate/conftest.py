"""What tests of `gear evaluate` share: an oracle, a package of somebody else's, small datasets."""

from __future__ import annotations

import hashlib
import sys
import types
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

import gear
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import DefenseSpec, ModelSpec
from gear.plugins import build as building
from gear.plugins.manager import discover
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.frames import UInt8Image
from gear.verbs.collect.run import collect
from tests.verbs.conftest import size_settings

Small = Callable[..., Path]
Install = Callable[..., None]
Views = Mapping[str, UInt8Image]


@dataclass(frozen=True, kw_only=True)
class Config:
    strength: float = 1.0


class Oracle:
    """Knows the truth of every picture that it was shown beforehand; may change it."""

    def __init__(self, roots: list[Path], change: Callable[[Any, Any], Any] | None = None) -> None:
        self.known: dict[str, Any] = {}
        self.shown = 0
        for root in roots:
            dataset = gear.open_dataset(root)
            for sample in dataset:
                prediction = dataset.task.as_prediction(sample)
                self.known[self.key(sample.images)] = change(sample, prediction) if change else prediction

    @staticmethod
    def key(views: Views) -> str:
        return hashlib.sha256(views["left"].tobytes()).hexdigest()

    def predict(self, views: Views) -> Any:
        self.shown += 1
        return self.known[self.key(views)]

    def taps(self) -> Mapping[str, Any]:
        return {}


def model_spec(build: Callable[[Any], Any], task: str, **facts: Any) -> ModelSpec[Any]:
    spec: dict[str, Any] = {"tasks": (task,), "views": ("left",)} | facts
    return ModelSpec(name="odd", summary="Odd.", config=Config, build=build, **spec)


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    def put(*specs: Any) -> None:
        module = types.ModuleType("odd_package")
        for hook, kind in (("gear_models", ModelSpec), ("gear_defenses", DefenseSpec)):
            chosen = [spec for spec in specs if isinstance(spec, kind)]
            setattr(module, hook, hookimpl(lambda chosen=chosen: chosen, specname=hook))
        sys.modules["odd_package"] = module
        found = discover([EntryPoint(name="odd", value="odd_package", group="gear")])
        monkeypatch.setattr(building, "catalogue", lambda: found)

    yield put
    sys.modules.pop("odd_package", None)


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Small:
    """Datasets that tests share and only read; the folder's name is the patch."""
    made: dict[tuple[str, str, int], Path] = {}

    def root(task: str, patch: str = "random", samples: int = 2) -> Path:
        key = (task, patch, samples)
        if key not in made:
            made[key] = tmp_path_factory.mktemp(task) / patch
            settings = [f"scenes={TINY_SCENES}", *size_settings(task)]
            collect(
                task, town=TINY_TOWN, scene="board", split="debug", samples=samples, renderer="classic",
                quality="fast", patch=patch, out=made[key], settings=settings,
            )  # fmt: skip
        return made[key]

    return root
