"""Damaged or changed files of a collected dataset are named with what to do about them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import gear
from gear.collecting.run import CollectReport
from gear.dataset.files import sha256
from gear.values.errors import (
    DatasetError,
)
from tests.verbs.conftest import Copy

Collect = Callable[..., CollectReport]
TASKS = ("semseg", "detect2d", "stereo3d", "depth")


def test_a_file_that_is_gone_or_damaged_is_named_with_its_remedy(
    tmp_path: Path, collect_small: Collect, copy_small: Copy
) -> None:
    copy_small("semseg", tmp_path)
    dataset = gear.open_dataset(tmp_path)
    picture = next(iter(tmp_path.glob("leftImg8bit/*/*/*.png")))
    whole = picture.read_bytes()
    for damage, what in ((whole[:90], "is damaged: .*"), (None, "is gone")):
        picture.unlink()
        if damage is not None:
            picture.write_bytes(damage)
        with pytest.raises(DatasetError, match=rf"{picture.name}: {what}; `gear verify DIR --repair`") as caught:
            list(dataset)
        assert "\n" not in str(caught.value)
    (tmp_path / "gear/debug/samples/000000.json").unlink()
    collect_small("semseg", tmp_path)
    assert picture.read_bytes() == whole


@pytest.mark.parametrize("task", ["semseg", "depth", "stereo3d", "detect2d"])
def test_a_picture_of_another_size_or_kind_is_named_with_its_remedy(
    task: str, tmp_path: Path, copy_small: Copy
) -> None:
    copy_small(task, tmp_path)
    dataset = gear.open_dataset(tmp_path)
    camera = dataset.sidecar(0).record.cameras[0]
    width, height = camera.width_px, camera.height_px
    files = [tmp_path / name for name in dataset.sidecar(0).files]
    sidecar = tmp_path / "gear/debug/samples/000000.json"
    written = sidecar.read_bytes()
    content = json.loads(written)
    for path in (path for path in files if path.suffix in (".png", ".tiff")):
        if path.name.endswith("_color.png") or (path.suffix == ".png" and path.parent.parent.name == "gtFine"):
            continue  # written for other people's loaders alone
        whole = path.read_bytes()
        read_as = cv2.imdecode(np.frombuffer(whole, np.uint8), cv2.IMREAD_UNCHANGED)
        damages = [np.zeros((height // 2, *read_as.shape[1:]), read_as.dtype)]
        if read_as.ndim == 2:
            damages += [np.full((height, width), 200, np.uint8), np.zeros((height, width, 3), np.uint8)]
        for damage in damages:
            path.write_bytes(cv2.imencode(path.suffix, damage)[1].tobytes())
            with pytest.raises(DatasetError, match=rf"{path.name}: is damaged: .*; `gear verify DIR --repair`"):
                dataset[0]
            hashes = {**content["files"], path.relative_to(tmp_path).as_posix(): sha256(path.read_bytes())}
            sidecar.write_text(json.dumps(content | {"files": hashes}))  # as somebody would who edits data
            with pytest.raises(DatasetError, match=rf"{path.name}: is .* (px|pixel).*; `gear verify DIR --repair`"):
                dataset[0]
            sidecar.write_bytes(written)
        path.write_bytes(whole)
    assert len(list(dataset)) == 2


@pytest.mark.parametrize("task", ["stereo3d", "detect2d"])
@pytest.mark.parametrize("objects", [None, 3, "x", [{}], [None], float("nan")])
def test_damaged_facts_are_one_line(task: str, objects: Any, tmp_path: Path, copy_small: Copy) -> None:
    copy_small(task, tmp_path)
    path = tmp_path / "gear/debug/samples/000000.json"
    sidecar = json.loads(path.read_text())
    sidecar["facts"]["objects"] = objects
    path.write_text(json.dumps(sidecar))
    with pytest.raises(DatasetError, match=r"000000.json: is not (a sidecar|JSON)") as caught:
        gear.open_dataset(tmp_path)[0]
    assert "\n" not in str(caught.value)
