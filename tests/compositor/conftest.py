"""Small splits of the tiny town with probes, and their twins with random patches, made once a session."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

import gear
from gear.collecting.patch_sources import random_patch
from gear.dataset.reading import Dataset
from gear.measuring.gap.picture_gap import PictureGap, picture_gap, visible_mask
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.verbs.collect.run import collect

Twins = tuple[Dataset[Any], Dataset[Any]]
MakeTwins = Callable[..., Twins]


@pytest.fixture(scope="session")
def twins(tmp_path_factory: pytest.TempPathFactory) -> MakeTwins:
    """A split with probes and its twin with random patches."""

    @cache
    def make(
        scene: str = "board", renderer: str = "classic", quality: str = "fast", task: str = "semseg",
        settings: tuple[str, ...] = (),
    ) -> Twins:  # fmt: skip
        root = tmp_path_factory.mktemp(f"{scene}-{renderer}-{quality}")
        size = ["options.width_px=320", f"options.height_px={96 if task == 'stereo3d' else 160}"]
        common: dict[str, Any] = {
            "town": TINY_TOWN, "scene": scene, "split": "train", "samples": 2, "renderer": renderer,
            "quality": quality, "settings": [f"scenes={TINY_SCENES}", *size, *settings],
        }  # fmt: skip
        collect(task, out=root / "clean", probes=True, **common)
        collect(task, out=root / "twin", patch="random", **common)
        return gear.open_dataset(root / "clean"), gear.open_dataset(root / "twin")

    return make


def random_patches(number: int) -> list[Tensor]:
    """The patches of a twin, as tensors."""
    return [torch.from_numpy(random_patch(0, i).copy()).permute(2, 0, 1).float() / 255 for i in range(number)]


def gaps(compositor: Any, twin: Dataset[Any]) -> list[PictureGap]:
    """Composed against rendered, for each picture that shows a patch."""
    found = []
    for index in range(len(twin)):
        sample = twin[index]
        for view, picture in sample.images.items():
            mask = visible_mask(sample.surfaces, view, *picture.shape[:2])
            if mask.any():
                digital = compositor.compose(random_patches(compositor.surfaces), [index], view)[0]
                shown = np.rint(digital.permute(1, 2, 0).numpy() * 255).astype(np.uint8)
                found.append(picture_gap(shown, picture, mask))
    return found


def files(root: Path) -> dict[str, bytes]:
    """Every file by relative path."""
    return {p.relative_to(root).as_posix(): p.read_bytes() for p in sorted(root.rglob("*")) if p.is_file()}
