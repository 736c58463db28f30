"""Sidecars are read one at a time."""

from __future__ import annotations

import gc
import json
from pathlib import Path

import pytest

from gear.contracts.tasks import Sidecar
from gear.dataset.closing import SidecarStream
from gear.dataset.files import sha256
from gear.dataset.layout import manifest_path, sidecar_path
from gear.values.errors import DatasetError
from tests.dataset.splits import fill, plan


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
