"""KITTI object: one pool, with the ids and lists of the benchmark."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from gear.contracts.tasks import Auxiliary
from gear.formats.exports.kitti import kitti_tree, labels_of
from gear.formats.exports.layout import NoOptions
from gear.formats.kitti_object import SCAN, parse_labels
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
    assert files["ImageSets/test.txt"] == b""
    assert len(files) == 3 * 4 + 4


def test_every_file_comes_from_its_own_split_and_index() -> None:
    """Three splits, one with a gap in its indices; the lists of the benchmark keep the order of the ids."""
    splits = [
        split_of(replace(INFO, split=name), "stereo3d", *records(indices))
        for name, indices in (("val", (0, 3)), ("test", (5,)), ("train", (1, 2)))
    ]
    files = dict(kitti_tree(splits, str.encode, NoOptions()))
    places = {
        "training/{}/000000": "val/{}/000000", "training/{}/000001": "val/{}/000003",
        "testing/{}/000000": "test/{}/000005",
        "training/{}/000002": "train/{}/000001", "training/{}/000003": "train/{}/000002",
    }  # fmt: skip
    expected = {
        f"{place.format(folder)}.{suffix}": f"{source.format(folder)}.{suffix}".encode()
        for place, source in places.items()
        for folder, suffix in (("image_2", "png"), ("image_3", "png"), ("calib", "txt"), ("label_2", "txt"))
    }
    lists = {
        "ImageSets/val.txt": b"000000\n000001\n",
        "ImageSets/test.txt": b"000000\n",
        "ImageSets/train.txt": b"000002\n000003\n",
        "ImageSets/trainval.txt": b"000000\n000001\n000002\n000003\n",
    }
    assert files == expected | lists


def test_all_lists_of_the_benchmark_are_there() -> None:
    """Converters read all four."""
    for name in ("train", "val", "debug"):
        split = split_of(replace(INFO, split=name), "stereo3d", *records((0,)))
        lists = {path: data for path, data in kitti_tree([split], str.encode, NoOptions()) if "ImageSets" in path}
        wanted = {name, "trainval"} if name != "debug" else {name}
        assert {path: bool(data) for path, data in lists.items()} == {
            f"ImageSets/{one}.txt": one in wanted for one in ("train", "val", "trainval", "test", name)
        }


def test_a_split_that_is_called_as_the_joined_list_is_in_it() -> None:
    splits = [split_of(replace(INFO, split=name), "stereo3d", *records((0,))) for name in ("test", "trainval", "val")]
    files = dict(kitti_tree(splits, str.encode, NoOptions()))
    assert files["ImageSets/trainval.txt"] == b"000000\n000001\n" and files["ImageSets/val.txt"] == b"000001\n"


def test_scans_come_along_and_night_tests_are_tests() -> None:
    split = split_of(replace(INFO, split="test_night"), "stereo3d", *records((2,)))
    scan = Auxiliary(path="gear/test_night/scans/000002_velodyne.bin", facts={})
    sidecar = replace(split.sidecars[0], auxiliary={SCAN: scan})
    files = dict(kitti_tree([replace(split, sidecars=(sidecar,))], str.encode, NoOptions()))
    assert files["testing/velodyne/000000.bin"] == scan.path.encode()
    assert files["ImageSets/test_night.txt"] == b"000000\n" and files["ImageSets/test.txt"] == b""


def test_regions_come_last_and_no_label_file_is_empty() -> None:
    car = "Car 0.00 0 1.00 1.00 2.00 3.00 4.00 1.50 1.60 4.00 1.00 1.60 9.00 0.10\n"
    region = "DontCare -1 -1 -10 1.00 2.00 3.00 4.00 -1 -1 -1 -1000 -1000 -1000 -10\n"
    other = region.replace("1.00 2.00", "0.00 2.00")
    assert labels_of(f"{region}{car}{other}{car}".encode()).decode() == f"{car}{car}{region}{other}"
    (only,) = parse_labels(labels_of(b"").decode())
    assert only.type == "DontCare" and only.box_px == (0, 0, 0, 0)
