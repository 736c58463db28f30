"""Sidecars are read one at a time."""

from __future__ import annotations

import gc
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gear.contracts.tasks import ExtendsIndexes, Sidecar
from gear.dataset.files import sha256
from gear.dataset.finishing import closing
from gear.dataset.finishing.closing import SidecarStream, can_extend, closed_part
from gear.dataset.layout import manifest_path, sidecar_path
from gear.values.errors import DatasetError
from tests.dataset.splits import fill, plan, tree


def test_sidecars_are_read_in_order_and_not_kept(tmp_path: Path) -> None:
    fill(tmp_path, plan(samples=5))
    stream = SidecarStream(tmp_path, "test", 5, set())
    gc.collect()
    before = sum(type(thing) is Sidecar for thing in gc.get_objects())
    for index, sidecar in enumerate(stream):
        assert sidecar.record.index == index == stream[index].record.index
        assert sum(type(thing) is Sidecar for thing in gc.get_objects()) - before <= 2
    assert [one.record.index for one in stream[1:4:2]] == [1, 3] and stream[-1].record.index == 4
    with pytest.raises(IndexError):
        stream[5]


@pytest.mark.parametrize("asked", [(), (3,), (4, 0), (0, 1, 2, 3, 4)])
def test_the_manifests_facts_are_of_all_sidecars(asked: tuple[int, ...], tmp_path: Path) -> None:
    fill(tmp_path, plan(samples=5))
    stream = SidecarStream(tmp_path, "test", 5, set())
    for index in asked:
        assert stream[index].record.index == index
    manifest = json.loads((tmp_path / manifest_path("test")).read_bytes())
    assert stream.facts() == {"samples": manifest["samples"], "sidecars": manifest["sidecars"]}
    path = sidecar_path("test", 2)
    assert manifest["sidecars"][path] == sha256((tmp_path / path).read_bytes())


def test_a_record_without_a_camera_of_the_task_is_refused(tmp_path: Path) -> None:
    fill(tmp_path, plan(samples=2))
    with pytest.raises(DatasetError, match=r"000000.json: .*record.cameras: there is no 'another'"):
        SidecarStream(tmp_path, "test", 2, {"another"}).facts()


def of(task: str, samples: int) -> Any:
    return plan(samples=samples, task={"name": task, "package": "mujoco-gear", "version": "0.1.0"})


@pytest.fixture
def parsed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the sidecars that closing parses."""
    names: list[str] = []
    read = closing.read_sidecar

    def noted(path: Path) -> Sidecar:
        names.append(path.stem)
        return read(path)

    monkeypatch.setattr(closing, "read_sidecar", noted)
    return names


@pytest.mark.parametrize("task", ["semseg", "detect2d", "stereo3d", "depth"])
def test_an_extension_reads_the_new_sidecars_alone_and_has_the_bytes_of_one_run(
    task: str, tmp_path: Path, parsed: list[str]
) -> None:
    fill(tmp_path / "whole", of(task, 5))
    fill(tmp_path / "grown", of(task, 2))
    parsed.clear()
    fill(tmp_path / "grown", of(task, 5))
    assert set(parsed) == {"000002", "000003", "000004"}
    assert tree(tmp_path / "grown") == tree(tmp_path / "whole")
    parsed.clear()
    fill(tmp_path / "grown", of(task, 5))
    assert not parsed and tree(tmp_path / "grown") == tree(tmp_path / "whole")


def _edit_index(root: Path) -> None:
    next(root.rglob("camera_billboard_info.json")).write_bytes(b"{}")


def _edit_manifest(root: Path) -> None:
    path = root / manifest_path("test")
    path.write_bytes(path.read_bytes().replace(b"rgb_0000", b"rgb_0009"))


@pytest.mark.parametrize("damage", [_edit_index, _edit_manifest, lambda root: (root / manifest_path("test")).unlink()])
def test_what_was_closed_is_read_again_if_it_has_changed(
    damage: Callable[[Path], None], tmp_path: Path, parsed: list[str]
) -> None:
    fill(tmp_path / "whole", plan(samples=5))
    fill(tmp_path / "grown", plan(samples=2))
    damage(tmp_path / "grown")
    parsed.clear()
    fill(tmp_path / "grown", plan(samples=5))
    assert len(set(parsed)) == 5
    assert tree(tmp_path / "grown") == tree(tmp_path / "whole")


def test_a_part_of_another_configuration_or_with_another_sidecar_is_not_taken(tmp_path: Path) -> None:
    fill(tmp_path, plan(samples=2))
    assert closed_part(tmp_path, "test", 2, {"seed": 5}) is not None
    assert closed_part(tmp_path, "test", 2, {"seed": 6}) is None
    assert closed_part(tmp_path, "test", 2, {"versions": {}}) is None
    assert closed_part(tmp_path, "test", 1, {"seed": 5}) is None
    path = tmp_path / sidecar_path("test", 1)
    path.write_bytes(path.read_bytes() + b"\n")
    assert closed_part(tmp_path, "test", 2, {"seed": 5}) is None


def test_a_task_that_replaces_one_of_both_methods_is_closed_in_full() -> None:
    class Whole:
        def finalise(self) -> None: ...

        def extend(self) -> None: ...

    class Other(Whole):
        def finalise(self) -> None: ...

    assert isinstance(Whole(), ExtendsIndexes)
    assert can_extend(Whole) and not can_extend(Other)
