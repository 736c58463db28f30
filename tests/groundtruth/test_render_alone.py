"""Silhouettes drawn from triangles against what a renderer shows of the same object alone."""

from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest

from gear.contracts.rendering import Renderer, Stage
from gear.groundtruth.objects import in_camera, observe_objects
from gear.groundtruth.silhouettes import bounds, fill, project_mesh
from gear.render.classic import ClassicRenderer
from gear.values.errors import BackendError
from gear.values.frames import GeomTable, SceneObject, Shape, View
from gear.values.geometry import RigidTransform
from gear.values.rig import CameraMount, Rig
from gear.values.scene import CameraRecord
from gear.world.assets.geom_triangles import geom_triangles

VEHICLES = Path(__file__).parents[2] / "mjcf/vehicles"
PRIMITIVES = """
<mujoco>
  <asset><mesh name="wedge" vertex="0 0 0  2 0 0  0 1.2 0  0 0 1.5"/></asset>
  <worldbody>
    <geom type="box" pos="0 0 0.8" size="2 0.9 0.4" euler="0 3 10"/>
    <geom type="ellipsoid" pos="0.2 0 1.4" size="1 0.8 0.5"/>
    <geom type="capsule" pos="-1 0 2" size="0.3 0.5" euler="20 0 0"/>
    <geom type="cylinder" pos="1.3 0.8 0.4" size="0.4 0.15" euler="90 0 0"/>
    <geom type="mesh" mesh="wedge" pos="-1 -0.5 1.2"/>
  </worldbody>
</mujoco>
"""
VIEWS = ((-9.0, 2.0, 0.2), (-14.0, -5.0, -0.3), (-7.0, -4.0, 0.5), (-28.0, 1.0, 0.2), (-5.0, 3.0, -0.7))
"""Where the ego car stands, and its heading."""


def shape_of(model: mujoco.MjModel, data: mujoco.MjData) -> Shape:
    vertices, faces, codes, count = [], [], [], 0
    for geom in range(model.ngeom):
        if model.geom_group[geom] > 2:
            continue
        own, triangles = geom_triangles(model, geom)
        vertices.append(own @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
        faces.append(triangles + count)
        codes.append(np.full(len(triangles), 25, dtype=np.uint8))
        count += len(own)
    points = np.concatenate(vertices)
    low, high = points.min(axis=0), points.max(axis=0)
    return Shape(
        vertices_m=points,
        faces=np.concatenate(faces).astype(np.int32),
        face_label_code=np.concatenate(codes),
        box_centre_m=(low + high) / 2,
        box_size_m=high - low,
    )


def cameras() -> Iterator[CameraRecord]:
    rig = Rig(cameras=(CameraMount(name="left", width_px=612, height_px=306),))
    for x, y, yaw in VIEWS:
        yield rig.place(RigidTransform.from_yaw("world", "ego", (x, y, 0.0), yaw))[0]


def overlap(a: np.ndarray, b: np.ndarray) -> float:
    return float((a & b).sum() / (a | b).sum())


def render(model: mujoco.MjModel, renderer: Renderer, data: mujoco.MjData, camera: CameraRecord) -> View:
    (raw,) = renderer.render(Stage(model=model, data=data), [camera], colour=False)
    blank = np.zeros((camera.height_px, camera.width_px, 3))
    return View(
        camera=camera,
        linear_rgb=blank.astype(np.uint16),
        rgb=blank.astype(np.uint8),
        depth_m=raw.depth_m,
        geom_id=raw.geom_id,
    )


@pytest.mark.parametrize("source", ["primitives", "car_saloon", "truck_box"])
def test_silhouettes_are_what_the_renderer_shows(source: str) -> None:
    if source == "primitives":
        model = mujoco.MjModel.from_xml_string(PRIMITIVES)
    else:
        model = mujoco.MjModel.from_xml_path(str(VEHICLES / f"{source}.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    thing = SceneObject(
        id=2,
        asset=source,
        label_code=25,
        kitti_type="Car",
        is_ego=False,
        world_from_object=RigidTransform("world", "object", np.eye(4)),
        shape=shape_of(model, data),
    )
    geoms = GeomTable(
        label_code=np.full(model.ngeom, 25, dtype=np.uint8),
        object_id=np.full(model.ngeom, 2, dtype=np.int32),
        surface_index=np.full(model.ngeom, -1, dtype=np.int16),
    )
    try:
        renderer = ClassicRenderer(model, quality="fast")
    except BackendError as error:
        pytest.skip(f"no OpenGL here: {error}")
    large = 0
    try:
        for camera in cameras():
            view = render(model, renderer, data, camera)
            (truth,) = observe_objects(view, geoms, {2: thing})
            triangles = project_mesh(in_camera(thing, camera), thing.shape.faces, camera.intrinsics)
            drawn = fill(triangles, (0, 0, camera.width_px, camera.height_px))
            shown = view.geom_id >= 0
            share = overlap(drawn, shown)
            if shown.sum() > 400:
                large += 1
                assert share > 0.98
                assert truth.visible_fraction + truth.truncated_fraction > 0.98
            assert truth.visible_px == shown.sum()
            # A silhouette one pixel aside, or mirrored, must not pass for the same.
            assert overlap(np.roll(drawn, 1, axis=1), shown) < share
            assert overlap(drawn[:, ::-1], shown) < share
            assert bounds(triangles)[2] > 0
    finally:
        renderer.close()
    assert large >= 4
