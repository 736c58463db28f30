import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gear.dataset.checks.exported_files import LISTED
from gear.plugins.datasets import open_dataset
from gear.verbs.export import export
from tests.dataset.splits import tree
from tests.formats.exports.trees import dataset

READER = """
import json, sys
import numpy as np
from datasets import load_dataset

read = load_dataset(sys.argv[1], cache_dir=sys.argv[2])
shown = {name: [
    {key: list(np.asarray(value).shape) if hasattr(value, "getbands") else value for key, value in row.items()}
    for row in split] for name, split in read.items()}
first = read["validation"][0]
np.savez(sys.argv[3], image=np.asarray(first["leftimg8bit"]), depth=np.asarray(first["gtfine_tiff"]),
         units=np.asarray(first["gtfine_png"]))
print(json.dumps(shown))
"""


@pytest.mark.slow  # importing the package takes seconds
def test_datasets_reads_the_folder_offline(tmp_path: Path) -> None:
    pytest.importorskip("datasets")
    data = dataset(tmp_path / "data", "depth", ("train", "val"))
    assert export(data, layout="hf", out=tmp_path / "hf") == 4
    environment = {"HF_HUB_OFFLINE": "1", "HF_HOME": str(tmp_path / "home"), "PATH": "", "HOME": str(tmp_path)}
    command = [sys.executable, "-c", READER, str(tmp_path / "hf"), str(tmp_path / "cache"), str(tmp_path / "a.npz")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    shown = json.loads(done.stdout.splitlines()[-1])
    assert sorted(shown) == ["train", "validation"] and [len(rows) for rows in shown.values()] == [2, 2]
    assert shown["train"][1]["index"] == 1 and shown["train"][1]["leftimg8bit"] == [80, 160, 3]
    sample = open_dataset(data, "val")[0]
    with np.load(tmp_path / "a.npz") as read:
        assert np.array_equal(read["image"], sample.images["left"])
        known = np.isfinite(sample.depth_m)
        assert np.array_equal(read["depth"][known], sample.depth_m[known])
        known &= sample.depth_m < 255
        assert read["units"][known] / 256 == pytest.approx(sample.depth_m[known], abs=1 / 512 + 1e-4)


def test_the_tree_is_a_card_and_data(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    data = dataset(tmp_path / "data", "detect2d", ("train", "val"))
    for name in ("a", "b"):
        export(data, layout="hf", out=tmp_path / name)
    assert tree(tmp_path / "a") == tree(tmp_path / "b")
    assert sorted(tree(tmp_path / "a")) == [LISTED, "README.md", "data/train-000000.parquet", "data/val-000000.parquet"]
