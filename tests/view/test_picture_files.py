"""The file of a camera's picture is found by its pixels, inside the dataset only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gear.view.picture_files import is_inside, picture_file


def test_each_camera_has_its_own_file(opened: Callable[..., Any]) -> None:
    dataset = opened("stereo3d", 1)
    sidecar, images = dataset.sidecar(0), dataset[0].images
    found = {camera: picture_file(dataset.root, sidecar, pixels) for camera, pixels in images.items()}
    assert found == {"left": "test/image_2/000000.png", "right": "test/image_3/000000.png"}
    assert picture_file(dataset.root, sidecar, 255 - images["left"]) is None


def test_files_outside_the_dataset_are_not_read(opened: Callable[..., Any], tmp_path: Path) -> None:
    dataset = opened("depth", 1)
    sidecar, pixels = dataset.sidecar(0), dataset[0].images["left"]
    picture = picture_file(dataset.root, sidecar, pixels)
    assert picture is not None
    (tmp_path / "outside.png").write_bytes((dataset.root / picture).read_bytes())
    (dataset.root / "link.png").symlink_to(tmp_path / "outside.png")
    for path in ("../outside.png", str(tmp_path / "outside.png"), "link.png"):
        assert picture_file(dataset.root, replace(sidecar, files={path: ""}), pixels) is None


@pytest.mark.parametrize("path", ["/a.png", "../a.png", "a/../../b.png", "a\\b.png", "a\0.png"])
def test_paths_that_lead_outside(path: str) -> None:
    assert not is_inside(path)
