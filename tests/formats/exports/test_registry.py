import pytest

from gear.formats.exports.layout import Layout
from gear.formats.exports.registry import find_layout, layout_names
from gear.formats.exports.sequences import TASKS
from gear.values.errors import UnknownNameError


def test_every_module_of_the_folder_is_a_layout() -> None:
    for name in layout_names():
        layout = find_layout(name)
        assert isinstance(layout, Layout) and layout.summary
        assert layout.options() == layout.options(), "every option has a default"


def test_each_layout_takes_the_datasets_of_its_task() -> None:
    found = {name: find_layout(name).tasks for name in layout_names()}
    assert found == {
        "cityscapes": ("semseg",), "coco": ("detect2d",), "kitti": ("stereo3d",), "kitti-depth": ("depth",),
        "hf": (), "parquet": (), "webdataset": (),
        "yolo": ("detect2d",), "mot": ("detect2d",), "kitti-tracking": ("stereo3d",),
        "kitti-odometry": TASKS, "kitti-raw": TASKS, "kitti-flow": TASKS,
    }  # fmt: skip


def test_an_unknown_layout_is_refused_with_the_known_ones() -> None:
    with pytest.raises(UnknownNameError, match="kitti-depth"):
        find_layout("kitti-dept")
    with pytest.raises(UnknownNameError):
        find_layout("registry")
