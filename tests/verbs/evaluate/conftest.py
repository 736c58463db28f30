"""What tests of `gear evaluate` share: an oracle, a package of somebody else's, small datasets."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import gear
from gear.contracts.specs import ModelSpec
from gear.values.frames import UInt8Image
from tests.verbs.conftest import Collected, Install, Small, put_package

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
def install(monkeypatch: pytest.MonkeyPatch) -> Install:
    return lambda *specs: put_package(monkeypatch, specs)


@pytest.fixture(scope="session")
def small(collected: Collected) -> Small:
    """Datasets that tests share and only read; the folder's name is the patch."""

    def root(task: str, patch: str = "random", samples: int = 2) -> Path:
        return collected(task, patch, samples=samples, patch=patch)

    return root
