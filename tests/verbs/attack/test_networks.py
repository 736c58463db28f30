"""`gear attack` on several networks, and where they run."""

from __future__ import annotations

import dataclasses
import sys
import types
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

from gear.compositor.registry import open_compositor
from gear.contracts.hookspecs import hookimpl
from gear.plugins import build as building
from gear.plugins.manager import discover
from gear.testing.tiny_networks import TinyConfig, TinySegmenter, tiny_segmenter
from gear.values.errors import GearError
from gear.verbs.attack import scenes
from gear.verbs.attack.run import attack
from tests.verbs.attack.conftest import SMALL, wrapping
from tests.verbs.conftest import Install, Small, other_segmenter


def test_networks_of_one_name_are_all_attacked(small: Small, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    entries = []
    for number, package in enumerate(("first_package", "second_package")):
        module = types.ModuleType(package)
        spec = dataclasses.replace(
            tiny_segmenter, name="net", build=lambda config, number=number: TinySegmenter(TinyConfig(seed=number))
        )
        setattr(module, "gear_models", hookimpl(lambda spec=spec: [spec], specname="gear_models"))  # noqa: B010
        monkeypatch.setitem(sys.modules, package, module)
        entries.append(EntryPoint(name=package, value=package, group="gear"))
    found = discover(entries)
    monkeypatch.setattr(building, "catalogue", lambda: found)
    names = [f"{package}/net" for package in ("first_package", "second_package")]
    report = attack(small(), model=names, out=tmp_path, steps=1, settings=SMALL)
    assert all(any(curve.startswith(f"{name}/") for curve in report.facts["curves"]) for name in names)
    with pytest.raises(GearError, match="named twice"):
        attack(small(), model=["ddrnet23_slim", "mujoco-gear/ddrnet23_slim"], out=tmp_path / "twice", steps=1)


@pytest.mark.parametrize(
    "facts",
    [
        {"model": "tiny_segmenter"},
        {"model": ["tiny_segmenter", "other_segmenter"]},
        {"model": "tiny_segmenter", "defense": "jpeg"},
        {"model": "tiny_segmenter", "defense": "wrapping"},
    ],
)
def test_patches_are_put_into_pictures_where_the_network_runs(
    small: Small, install: Install, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, facts: dict[str, Any]
) -> None:
    install(tiny_segmenter, other_segmenter, wrapping)
    asked: list[str] = []

    def opened(name: str, dataset: Any, *, device: str, cache: Any) -> Any:
        asked.append(device)
        return open_compositor(name, dataset)

    monkeypatch.setattr(TinySegmenter, "device", "cuda:7", raising=False)
    monkeypatch.setattr(scenes, "open_compositor", opened)
    attack(small(), out=tmp_path, steps=1, settings=SMALL, **facts)
    assert asked == ["cuda:7"]
