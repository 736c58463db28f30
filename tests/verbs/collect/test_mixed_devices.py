"""A split that two machines with different graphics devices make together."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import gear
from gear.dataset.layout import manifest_path, sidecar_path
from gear.render import classic, probing
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import BackendError, DatasetError

Collect = Callable[..., object]
MIXED = ["mixed_devices=true"]


@pytest.fixture
def other_machine(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Call it, and this machine has another graphics card."""

    def change() -> None:
        monkeypatch.setattr(classic, "driver_and_device", lambda: ("OpenGL 4.6 550.1", "H200"))
        probing.renderer_info.cache_clear()

    return change


@pytest.fixture(autouse=True)
def _no_memory_of_devices() -> Iterator[None]:
    probing.renderer_info.cache_clear()
    yield
    probing.renderer_info.cache_clear()


def test_mixed_devices_make_one_split_that_names_each_of_them(
    tmp_path: Path, collect_small: Collect, other_machine: Callable[[], None]
) -> None:
    collect_small("depth", tmp_path / "a", settings=MIXED, shard="1/2")
    other_machine()
    collect_small("depth", tmp_path / "b", settings=MIXED, shard="2/2")
    gear.merge([tmp_path / "a", tmp_path / "b"], out=tmp_path / "c")
    assert gear.verify(tmp_path / "c").is_whole
    devices = [
        json.loads((tmp_path / "c" / sidecar_path("debug", index)).read_text())["device"]["device"] for index in (0, 1)
    ]
    assert devices[1] == "H200" != devices[0]
    manifest = json.loads((tmp_path / "c" / manifest_path("debug")).read_text())
    assert manifest["renderer"]["name"] == "classic" and manifest["renderer"]["device"] == "mixed"
    assert "Different graphics devices rendered the samples" in (tmp_path / "c" / "README.md").read_text()
    sample = gear.open_dataset(tmp_path / "c")[1]
    assert sample.record.index == 1


def test_a_repair_says_that_bytes_may_differ(tmp_path: Path, collect_small: Collect) -> None:
    collect_small("depth", tmp_path, settings=MIXED)
    next(tmp_path.glob("gear/debug/samples/*1.json")).unlink()
    report = gear.verify(tmp_path, repair=True, town=TINY_TOWN, scenes=TINY_SCENES)
    assert report.is_whole
    assert any("repaired samples may differ" in line for line in report.lines())


def test_without_it_another_device_is_refused(
    tmp_path: Path, collect_small: Collect, other_machine: Callable[[], None]
) -> None:
    collect_small("depth", tmp_path / "a", shard="1/2")
    assert "device" not in json.loads((tmp_path / "a" / sidecar_path("debug", 0)).read_text())
    assert "mixed" not in (tmp_path / "a" / "gear/debug/plan.json").read_text()
    other_machine()
    with pytest.raises((DatasetError, BackendError), match=r"renderer\.de"):
        collect_small("depth", tmp_path / "a", shard="2/2")
