import builtins
import json
from pathlib import Path
from typing import Any

import pytest

from gear.dataset.checks.exported_files import LISTED
from gear.formats.exports.layout import ExportSplit
from gear.formats.parquet_files import ParquetOptions, parquet_files
from gear.plugins.datasets import open_dataset
from gear.values.errors import DatasetError, GearError
from gear.values.scene import SceneRecord
from gear.values.serial import from_json
from gear.verbs.export import export
from tests.dataset.splits import tree
from tests.formats.exports.trees import dataset


def test_a_row_is_a_sample_with_the_bytes_of_its_files(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    data = dataset(tmp_path / "data", "stereo3d", ("val", "test"))
    assert export(data, layout="parquet", out=tmp_path / "a") == 4
    assert sorted(tree(tmp_path / "a")) == [LISTED, "test-000000.parquet", "val-000000.parquet"]
    table = parquet.read_table(tmp_path / "a/val-000000.parquet")
    columns = ["index", "sequence", "frame", "calib", "image_2", "image_3", "label_2", "record", "surfaces", "facts"]
    assert table.column_names == columns
    opened = open_dataset(data, "val")
    for index, row in enumerate(table.to_pylist()):
        sidecar = opened.sidecar(index)
        assert row["index"] == index
        assert row["image_3"] == (data / f"val/image_3/{index:06d}.png").read_bytes()
        assert row["label_2"] == (data / f"val/label_2/{index:06d}.txt").read_text()
        assert from_json(SceneRecord, json.loads(row["record"])) == sidecar.record
        assert json.loads(row["facts"]) == sidecar.facts


def test_text_that_is_not_utf_8_is_one_line(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    data = dataset(tmp_path / "data", "stereo3d")
    sidecars = [open_dataset(data, "val").sidecar(0)]
    split = ExportSplit(info=open_dataset(data, "val").plan.info, task="stereo3d", sidecars=sidecars)
    with pytest.raises(
        DatasetError, match=r"val/calib/000000.txt: is no text in UTF-8 \(byte 2\); export the dataset to"
    ):
        list(parquet_files(split, lambda _: b"P0\xff", ParquetOptions()))


def test_the_same_dataset_gives_the_same_files_of_limited_size(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    data = dataset(tmp_path / "data", "depth")
    for name in ("a", "b"):
        export(data, layout="parquet", out=tmp_path / name, settings=["shard_mb=0.01"])
    assert tree(tmp_path / "a") == tree(tmp_path / "b")
    assert sorted(tree(tmp_path / "a")) == [LISTED, "val-000000.parquet", "val-000001.parquet"]


@pytest.mark.parametrize("layout", ["parquet", "hf"])
def test_without_pyarrow_one_line_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, layout: str
) -> None:
    original = builtins.__import__

    def without(name: str, *arguments: Any, **further: Any) -> Any:
        if name.partition(".")[0] == "pyarrow":
            raise ImportError(name)
        return original(name, *arguments, **further)

    data = dataset(tmp_path / "data", "depth")
    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(GearError, match=r"needs pyarrow: pip install 'mujoco-gear\[export\]'"):
        export(data, layout=layout, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()
