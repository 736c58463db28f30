from __future__ import annotations

import sys
import types
from collections.abc import Callable, Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import AttackSpec, ModelSpec
from gear.plugins import build as building
from gear.plugins.manager import discover
from gear.testing.tiny_networks import TinyConfig, TinySegmenter, tiny_depth, tiny_segmenter
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.verbs.collect.run import CollectReport, collect

SMALL = {"semseg": "320x160", "detect2d": "320x192", "stereo3d": "320x96", "depth": "320x96"}


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


@pytest.fixture
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


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., None]]:
    def put(*specs: Any) -> None:
        module = types.ModuleType("odd_attacks")
        for hook, kind in (("gear_models", ModelSpec), ("gear_attacks", AttackSpec)):
            chosen = [spec for spec in specs if isinstance(spec, kind)]
            setattr(module, hook, hookimpl(lambda chosen=chosen: chosen, specname=hook))
        sys.modules["odd_attacks"] = module
        found = discover([EntryPoint(name="odd", value="odd_attacks", group="gear")])
        monkeypatch.setattr(building, "catalogue", lambda: found)

    put(tiny_segmenter, tiny_depth, other_segmenter)
    yield put
    sys.modules.pop("odd_attacks", None)


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Datasets with probes, which tests share and only read."""
    made: dict[tuple[Any, ...], Path] = {}

    def root(
        task: str = "semseg", scene: str = "board", split: str = "train", probes: bool = True, seed: int | None = None
    ) -> Path:
        key = (task, scene, split, probes, seed)
        if key not in made:
            made[key] = tmp_path_factory.mktemp("data") / f"{task}-{scene}-{split}-{seed}"
            collect(
                task, town=TINY_TOWN, scene=scene, split=split, samples=2, renderer="classic", quality="fast",
                probes=probes, seed=seed, out=made[key], settings=[f"scenes={TINY_SCENES}", *size_settings(task)],
            )  # fmt: skip
        return made[key]

    return root
