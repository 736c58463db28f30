from gear.formats.export_kitti import kitti_tree
from gear.formats.export_kitti_depth import kitti_depth_tree
from gear.formats.exports import layouts


def test_each_layout_takes_the_datasets_of_its_task() -> None:
    found = {name: (layout.task, layout.tree) for name, layout in layouts().items()}
    assert found == {"kitti": ("stereo3d", kitti_tree), "kitti-depth": ("depth", kitti_depth_tree)}
