"""KITTI object: one pool, with the ids and lists of the benchmark."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from gear.formats.exports.kitti import kitti_tree
from gear.formats.exports.layout import NoOptions
from gear.formats.kitti_object import parse_labels
from gear.plugins.tasks.stereo3d import stereo3d
from gear.testing.synthetic import synthetic_frame
from gear.testing.task_contract import INFO
from gear.values.rig import CameraMount, Rig
from gear.values.scene import SceneRecord
from tests.formats.exports.trees import exported, split_of, written

RIG = Rig(cameras=(CameraMount(name="left", width_px=16, height_px=16),))


def records(indices: Sequence[int]) -> tuple[SceneRecord, ...]:
    return tuple(synthetic_frame(RIG, [], index=index)[1] for index in indices)


def test_kitti_is_one_pool_with_lists(tmp_path: Path) -> None:
    val = written(tmp_path, stereo3d, {"width_px": 306, "height_px": 92})
    for folder in ("image_2", "image_3", "calib", "label_2"):
        (tmp_path / "train" / folder).mkdir(parents=True)
        for path in (tmp_path / "val" / folder).glob("000000.*"):
            (tmp_path / "train" / folder / path.name).write_bytes(path.read_bytes())
    train = replace(val, info=replace(INFO, split="train"), sidecars=val.sidecars[:1])
    files = exported("kitti", [train, val], tmp_path)
    assert files["ImageSets/train.txt"] == b"000000\n"
    assert files["ImageSets/val.txt"] == b"000001\n000002\n"
    assert files["ImageSets/trainval.txt"] == b"000000\n000001\n000002\n"
    assert files["training/image_3/000002.png"] == (tmp_path / "val/image_3/000001.png").read_bytes()
    assert len(parse_labels(files["training/label_2/000001.txt"].decode())) > 3
    assert len(files) == 3 * 4 + 3


def test_every_file_comes_from_its_own_split_and_index() -> None:
    """Three splits, one with a gap in its indices; the lists of the benchmark keep the order of the ids."""
    splits = [
        split_of(replace(INFO, split=name), "stereo3d", *records(indices))
        for name, indices in (("val", (0, 3)), ("test", (5,)), ("train", (1, 2)))
    ]
    files = dict(kitti_tree(splits, str.encode, NoOptions()))
    sources = ["val/{}/000000", "val/{}/000003", "test/{}/000005", "train/{}/000001", "train/{}/000002"]
    expected = {
        f"training/{folder}/{number:06d}.{suffix}": f"{source.format(folder)}.{suffix}".encode()
        for number, source in enumerate(sources)
        for folder, suffix in (("image_2", "png"), ("image_3", "png"), ("calib", "txt"), ("label_2", "txt"))
    }
    lists = {
        "ImageSets/val.txt": b"000000\n000001\n",
        "ImageSets/test.txt": b"000002\n",
        "ImageSets/train.txt": b"000003\n000004\n",
        "ImageSets/trainval.txt": b"000000\n000001\n000003\n000004\n",
    }
    assert files == expected | lists


def test_one_list_alone_makes_no_trainval() -> None:
    for name in ("train", "val"):
        split = split_of(replace(INFO, split=name), "stereo3d", *records((0,)))
        assert [path for path, _ in kitti_tree([split], str.encode, NoOptions()) if "ImageSets" in path] == [
            f"ImageSets/{name}.txt"
        ]
