import gc
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from gear.dataset.checks.exported_files import LISTED
from gear.networks.torchvision_import import prepare
from gear.plugins.datasets import open_dataset
from gear.values.errors import ConfigError
from gear.verbs.export import export
from tests.formats.exports.trees import dataset

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
"""torchvision leaves its files open."""


@pytest.fixture(autouse=True)
def closed_files() -> Iterator[None]:
    yield
    gc.collect()


@pytest.mark.parametrize(("settings", "year"), [((), "2017"), (("year=0",), "")])
def test_torchvision_reads_it(tmp_path: Path, settings: tuple[str, ...], year: str) -> None:
    prepare()
    from torchvision.datasets import CocoDetection

    data = dataset(tmp_path / "data", "detect2d", ("train", "val"))
    assert export(data, layout="coco", out=tmp_path / "coco", settings=settings) == 4
    for split in ("train", "val"):
        ours = open_dataset(data, split)
        annotations = tmp_path / f"coco/annotations/instances_{split}{year}.json"
        read = CocoDetection(str(tmp_path / f"coco/{split}{year}"), str(annotations))
        assert len(read) == len(ours) == 2
        for index, sample in enumerate(ours):
            picture, found = read[index]
            assert np.array_equal(np.asarray(picture), sample.images["left"])
            assert [one["category_id"] for one in found] == [thing.category_id for thing in sample.objects]
            assert [one["area"] for one in found] == [thing.area_px for thing in sample.objects] != []
    assert {path.name for path in (tmp_path / "coco").iterdir()} == {
        f"train{year}",
        f"val{year}",
        "annotations",
        LISTED,
    }


def test_options_are_read_like_all_others(tmp_path: Path) -> None:
    data = dataset(tmp_path / "data", "detect2d")
    for setting, problem in (("yaer=1", "yaer"), ("year=x", "year"), ("year=-1", "0 to 9999")):
        with pytest.raises(ConfigError, match=problem):
            export(data, layout="coco", out=tmp_path / "coco", settings=[setting])
    assert not (tmp_path / "coco").exists()
