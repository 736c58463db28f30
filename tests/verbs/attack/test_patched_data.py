"""Data that show a patch already are nothing to make one on: what networks say of them is no clean answer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gear
from gear.formats.png import encode_rgb
from gear.values.errors import DatasetError
from gear.verbs.attack.run import attack
from gear.verbs.attack.verify import check_held_out
from gear.verbs.collect.run import collect
from tests.verbs.attack.conftest import SMALL
from tests.verbs.conftest import TINY_SCENES, TINY_TOWN, Install, Small, size_settings


def shown(root: Path, patch: str | Path, split: str = "train") -> Path:
    collect(
        "semseg", town=TINY_TOWN, scene="board", split=split, samples=1, renderer="classic", quality="fast",
        probes=True, patch=str(patch), out=root, settings=[f"scenes={TINY_SCENES}", *size_settings("semseg")],
    )  # fmt: skip
    return root


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "patch_0.png").write_bytes(encode_rgb(np.full((8, 16, 3), 90, np.uint8)))
    return tmp_path / "mine"


def test_data_that_show_a_patch_are_refused(small: Small, install: Install, tmp_path: Path, folder: Path) -> None:
    train, val = shown(tmp_path / "data", folder), shown(tmp_path / "val", folder, "val")
    label = gear.open_dataset(train).plan.patch["label"]
    line = rf"{{}}: shows the patch {label} itself; collect the scene with --patch none or random"
    for data, judges, named in (([train], (), train), ([small(), train], (), train), ([small()], val, val)):
        with pytest.raises(DatasetError, match=line.format(named)):
            attack(data, model="tiny_segmenter", out=tmp_path / "p", val=judges, steps=1, settings=SMALL)
    assert not (tmp_path / "p").exists()


def test_a_random_patch_is_no_attack(install: Install, tmp_path: Path) -> None:
    data = shown(tmp_path / "data", "random")
    assert attack(data, model="tiny_segmenter", out=tmp_path / "p", steps=1, settings=SMALL).made


def test_a_check_on_them_is_refused_before_patches_are_made(
    small: Small, install: Install, tmp_path: Path, folder: Path
) -> None:
    held = shown(tmp_path / "val", folder, "val")
    with pytest.raises(DatasetError, match="name a dataset collected with --patch none"):
        check_held_out([small()], held)
