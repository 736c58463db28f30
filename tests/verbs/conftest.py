from __future__ import annotations

import hashlib
import json
import shutil
import sys
import types
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

from gear.collecting.run import CollectReport
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import AttackSpec, DefenseSpec, LoggerSpec, MetricSpec, ModelSpec
from gear.dataset.locks import dataset_lock
from gear.measuring.gap.report import GapReport
from gear.measuring.guard import Guard
from gear.plugins import build as building
from gear.plugins.manager import discover
from gear.testing.tiny_networks import TinyConfig, TinySegmenter, tiny_depth, tiny_segmenter
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.progress import Callbacks
from gear.verbs.attack.request import VerifyRequest
from gear.verbs.attack.verify import verify
from gear.verbs.collect.run import collect
from tests.shared import shared_folder

Collected = Callable[..., Path]
Copy = Callable[..., Path]
Small = Callable[..., Path]
Install = Callable[..., None]

SMALL = {"semseg": "320x160", "detect2d": "320x192", "stereo3d": "320x96", "depth": "320x96"}


@dataclass(frozen=True, kw_only=True)
class Nothing:
    """No options."""


def size_settings(task: str) -> list[str]:
    width, height = SMALL.get(task, "320x96").split("x")
    return [f"options.width_px={width}", f"options.height_px={height}"]


other_segmenter = ModelSpec(
    name="other_segmenter",
    summary="The tiny one with other weights.",
    config=TinyConfig,
    build=lambda config: TinySegmenter(TinyConfig(seed=config.seed + 7, width=config.width)),
    tasks=("semseg",),
    views=("left",),
    taps=("stem", "trunk"),
)


@pytest.fixture(scope="session")
def collect_small() -> Callable[..., CollectReport]:
    """`gear.collect` of small pictures of the tiny town, with the classic renderer unless asked otherwise."""

    def run(task: str, out: Path, **changes: Any) -> CollectReport:
        settings = [f"scenes={TINY_SCENES}", *size_settings(task), *changes.pop("settings", [])]
        arguments: dict[str, Any] = {
            "town": TINY_TOWN, "scene": "board", "split": "debug", "samples": 2, "renderer": "classic",
            "quality": "fast",
        }  # fmt: skip
        return collect(task, out=out, settings=settings, **(arguments | changes))

    return run


def verified(
    out: Path, data: Path, models: Sequence[str], *, defense: str | None = None, calibration: Path | None = None,
    **given: Any,
) -> dict[str, GapReport]:  # fmt: skip
    """The rendered check of patches on other samples."""
    guard = Guard.of(defense, (), calibration)
    request = VerifyRequest(out=out, data=data, models=tuple(models), guard=guard, **given)
    return verify(request, Callbacks())


def put_package(monkeypatch: pytest.MonkeyPatch, specs: Sequence[Any]) -> None:
    """Installs plugins as a third party's package, in place of one that was put before."""
    module = types.ModuleType("odd_package")
    hooks = {"gear_models": ModelSpec, "gear_attacks": AttackSpec, "gear_defenses": DefenseSpec}
    for hook, kind in (hooks | {"gear_metrics": MetricSpec, "gear_loggers": LoggerSpec}).items():
        chosen = [spec for spec in specs if isinstance(spec, kind)]
        setattr(module, hook, hookimpl(lambda chosen=chosen: chosen, specname=hook))
    monkeypatch.setitem(sys.modules, "odd_package", module)
    found = discover([EntryPoint(name="odd", value="odd_package", group="gear")])
    monkeypatch.setattr(building, "catalogue", lambda: found)


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    def put(*specs: Any) -> None:
        put_package(monkeypatch, specs)

    put(tiny_segmenter, tiny_depth, other_segmenter)
    return put


@pytest.fixture(scope="session")
def collected(tmp_path_factory: pytest.TempPathFactory, collect_small: Callable[..., CollectReport]) -> Collected:
    """Datasets that all tests of a run share, in all its processes, and only read: `collected(task, **changes)`."""

    def root(task: str, name: str = "data", **changes: Any) -> Path:
        asked = json.dumps([task, name, changes], sort_keys=True, default=str)
        folder = shared_folder(tmp_path_factory, f"collected/{hashlib.sha256(asked.encode()).hexdigest()[:16]}")
        with dataset_lock(folder):
            if not (folder / "whole").exists():
                collect_small(task, folder / name, **changes)
                (folder / "whole").touch()
        return folder / name

    return root


@pytest.fixture(scope="session")
def copy_small(collected: Collected) -> Copy:
    """As `collect_small`, where what is tested is not the collection: a copy of a dataset that others have, too."""

    def copied(task: str, out: Path, **changes: Any) -> Path:
        return Path(shutil.copytree(collected(task, **changes), out, dirs_exist_ok=True))

    return copied


@pytest.fixture(scope="session")
def small(collected: Collected) -> Small:
    """Datasets with probes, which tests share and only read."""

    def root(
        task: str = "semseg", scene: str = "board", split: str = "train", probes: bool = True, seed: int | None = None
    ) -> Path:
        name = f"{task}-{scene}-{split}-{seed}"
        return collected(task, name, scene=scene, split=split, probes=probes, seed=seed)

    return root
