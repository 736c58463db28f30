from __future__ import annotations

import gc
import logging
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gear.formats.croissant import CONTEXT, FilePattern, croissant
from gear.formats.dataset_card import SplitFacts
from gear.plugins.datasets import open_dataset
from gear.testing.task_contract import INFO
from tests.formats.exports.trees import SMALL, dataset

FACTS = SplitFacts.of(INFO, "depth", 2, {})


def test_it_says_how_responsible_the_data_are() -> None:
    content = croissant([FACTS], [], {"filenames/val.txt": "0" * 64})
    wanted = {
        "rai:dataCollection", "rai:dataCollectionType", "rai:dataLimitations", "rai:dataBiases", "rai:dataUseCases",
        "rai:machineAnnotationTools", "rai:personalSensitiveInformation",
    }  # fmt: skip
    assert all(content[key] for key in wanted)
    assert content["distribution"][0]["encodingFormat"] == "text/plain"
    assert "rai" in CONTEXT and content["@context"] == CONTEXT


def test_only_pictures_that_readers_decode_are_records() -> None:
    patterns = [FilePattern(name=suffix, suffix=suffix, globs=["a"]) for suffix in ("png", "tiff", "txt", "odd")]
    content = croissant([FACTS], patterns, {})
    assert [one["name"] for one in content["recordSet"]] == ["splits", "png_pictures"]
    kinds = [one["encodingFormat"] for one in content["distribution"]]
    assert kinds == ["image/png", "image/tiff", "text/plain", "application/octet-stream"]


def test_the_name_of_a_split_is_no_regular_expression() -> None:
    facts = SplitFacts.of(replace(INFO, split="v.l"), "depth", 2, {})
    content = croissant([facts], [FilePattern(name="a", suffix="png", globs=["a"])], {})
    field = next(one for one in content["recordSet"][1]["field"] if one["name"] == "split")
    regex = re.compile(field["source"]["transform"]["regex"])
    assert regex.fullmatch("images/v.l/a.png") and not regex.fullmatch("images/val/a.png")


@pytest.mark.slow  # importing the package takes seconds
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("task", SMALL)
def test_mlcroissant_validates_and_reads_it(tmp_path: Path, task: str, caplog: pytest.LogCaptureFixture) -> None:
    mlcroissant = pytest.importorskip("mlcroissant")
    dataset(tmp_path, task, ("train", "val_night"))
    caplog.set_level(logging.WARNING)
    read = mlcroissant.Dataset(str(tmp_path / "croissant.json"))
    assert not read.metadata.ctx.issues.errors and not read.metadata.ctx.issues.warnings
    names = [one.uuid for one in read.metadata.record_sets]
    assert names[0] == "splits" and len(names) > 1
    splits = list(read.records("splits"))
    assert [(one["splits/name"], one["splits/samples"]) for one in splits] == [("train", 2), ("val_night", 2)]
    name = next(one for one in ("leftimg8bit_pictures", "images_pictures", "image_2_pictures") if one in names)
    records = list(read.records(name))
    assert [one[f"{name}/split"] for one in records] == [b"train"] * 2 + [b"val_night"] * 2
    pictures = [sample.images["left"] for split in ("train", "val_night") for sample in open_dataset(tmp_path, split)]
    for record, picture in zip(records, pictures, strict=True):
        assert np.array_equal(np.asarray(record[f"{name}/picture"]), picture)
    assert not caplog.records, caplog.text
    gc.collect()
