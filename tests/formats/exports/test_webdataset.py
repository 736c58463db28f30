import gc
import io
import json
import tarfile
from pathlib import Path

import cv2
import numpy as np
import pytest

from gear.dataset.checks.exported_files import LISTED
from gear.dataset.files import sha256
from gear.plugins.datasets import open_dataset
from gear.values.errors import ConfigError
from gear.verbs.export import export
from tests.dataset.splits import tree
from tests.formats.exports.trees import SMALL, dataset

PARTS = {
    "semseg": ["camera.json", "gtfine_color.png", "gtfine_instanceids.png", "gtfine_labelids.png",
               "gtfine_polygons.json", "leftimg8bit.png"],
    "detect2d": ["images.png"],
    "stereo3d": ["calib.txt", "image_2.png", "image_3.png", "label_2.txt"],
    "depth": ["gtfine.png", "gtfine.tiff", "leftimg8bit.png"],
}  # fmt: skip


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("task", SMALL)
def test_webdataset_reads_every_task(tmp_path: Path, task: str) -> None:
    webdataset = pytest.importorskip("webdataset")
    data = dataset(tmp_path / "data", task)
    assert export(data, layout="webdataset", out=tmp_path / "tars") == 2
    read = list(webdataset.WebDataset(str(tmp_path / "tars/val-000000.tar"), shardshuffle=False))
    gc.collect()  # it leaves its files open
    ours = open_dataset(data)
    assert len(read) == 2
    for index, item in enumerate(read):
        assert item["__key__"] == f"{index:06d}"
        assert sorted(key for key in item if key[0] != "_") == sorted([*PARTS[task], "json"])
        sidecar = json.loads(item["json"])
        hashes = sorted(sidecar["files"].values())
        assert hashes == sorted(sha256(item[part]) for part in PARTS[task]), "every file, to the byte"
        picture = next(part for part in ("leftimg8bit.png", "images.png", "image_2.png") if part in item)
        decoded = cv2.imdecode(np.frombuffer(item[picture], np.uint8), cv2.IMREAD_COLOR)
        assert np.array_equal(decoded[..., ::-1], ours[index].images["left"])


def test_the_same_dataset_gives_the_same_tars_without_time_and_owner(tmp_path: Path) -> None:
    data = dataset(tmp_path / "data", "depth", ("val", "train"))
    export(data, layout="webdataset", out=tmp_path / "a")
    for path in data.rglob("*"):
        path.touch()
    export(data, layout="webdataset", out=tmp_path / "b")
    assert tree(tmp_path / "a") == tree(tmp_path / "b")
    assert sorted(tree(tmp_path / "a")) == [LISTED, "train-000000.tar", "train.json", "val-000000.tar", "val.json"]
    data = (tmp_path / "a/val-000000.tar").read_bytes()
    assert data[257:263] == b"ustar\0"
    with tarfile.open(fileobj=io.BytesIO(data)) as archive:
        found = [(m.mtime, m.uid, m.gid, m.uname, m.gname, m.mode, m.type) for m in archive]
    assert set(found) == {(0, 0, 0, "", "", 0o644, tarfile.REGTYPE)} and len(found) == 8


def test_no_tar_exceeds_the_size_and_no_sample_is_cut(tmp_path: Path) -> None:
    data = dataset(tmp_path / "data", "depth")
    whole = export_sizes(data, tmp_path / "one", "1")
    assert len(whole) == 1
    limit = whole[0] - 1
    halves = export_sizes(data, tmp_path / "two", f"{limit / 1e6:.6f}")
    assert len(halves) == 2 and max(halves) <= limit
    smallest = export_sizes(data, tmp_path / "least", "0.01")
    assert smallest == halves, "a tar holds a sample, however large"
    listed = json.loads((tmp_path / "two/val.json").read_text())
    assert listed["shardlist"] == [
        {"url": f"val-{number:06d}.tar", "nsamples": 1, "filesize": size} for number, size in enumerate(halves)
    ]


def export_sizes(data: Path, out: Path, shard_mb: str) -> list[int]:
    export(data, layout="webdataset", out=out, settings=[f"shard_mb={shard_mb}"])
    return [path.stat().st_size for path in sorted(out.glob("*.tar"))]


def test_sizes_out_of_range_are_refused(tmp_path: Path) -> None:
    data = dataset(tmp_path / "data", "depth")
    with pytest.raises(ConfigError, match=r"shard_mb.*0\.01 to 10000"):
        export(data, layout="webdataset", out=tmp_path / "tars", settings=["shard_mb=0"])
