"""The raster renderer: light on surfaces, shadows, and the same pictures as Filament's."""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt
import pytest

from gear.camera import response_for
from gear.contracts.rendering import Quality, Renderer, Stage
from gear.render import open_renderer
from gear.render.glcontext import is_software
from gear.render.probing import renderer_info
from gear.render.raster import geometry, gl
from gear.values.array_shelf import NO_SHELF, ArrayShelf
from gear.values.geometry import RigidTransform
from gear.values.scene import CameraRecord, Pose
from gear.world.compilation.quiet_mjcf import mjcf
from gear.world.weather.presets import PRESETS, apply_weather
from tests.render.conftest import STREET, camera, posed

LAMBERT = """
<mujoco>
  <custom><text name="filament.material.base_color_type" data="linear"/></custom>
  <asset><material name="white" rgba="0.5 0.5 0.5 1" metallic="0" roughness="1"/></asset>
  <worldbody>
    <light type="directional" dir="{sun}" diffuse="1 1 1" intensity="60000"/>
    <geom type="box" size="0.01 3 3" pos="5 0 1.6" material="white"/>
  </worldbody>
</mujoco>
"""


@pytest.mark.parametrize("sun", [(1.0, 0.0, 0.0), (0.8, 0.6, 0.0), (0.5, 0.0, -0.8660254)])
@pytest.mark.parametrize("quality", ["film", "fast"])
def test_a_matte_wall_shows_what_lambert_says(sun: tuple[float, float, float], quality: Quality) -> None:
    model = mujoco.MjModel.from_xml_string(LAMBERT.format(sun=" ".join(map(str, sun))))
    renderer = open_renderer("raster", model, quality=quality)
    try:
        (view,) = renderer.render(Stage(model=model, data=posed(model)), (camera(32, 32, y_m=0.0, yaw_deg=0.0),))
    finally:
        renderer.close()
    assert view.linear_rgb is not None
    matte = 0.5 / math.pi * 60000 / 38400 * sun[0] * 1020
    # Straight ahead a dielectric of this roughness adds some per cent of gloss.
    assert matte * 0.99 <= view.linear_rgb[14:18, 14:18].mean() <= matte * 1.04


def street(weather: str) -> mujoco.MjModel:
    """The tests' street under a real sky, in materials of the kind that towns are made of."""
    xml = re.sub(r'(<geom name="[a-z]+" type="box" [^>]*)rgba', r'\1material="matte" rgba', STREET)
    xml = xml.replace('name="red"', 'name="red" metallic="0.2" roughness="0.4"')
    xml = xml.replace("<asset>", '<asset><material name="matte" metallic="0" roughness="0.8"/>')
    root = mjcf.from_xml_string(xml)
    apply_weather(root, PRESETS[weather])
    return mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())


def pictures_with(shelf: ArrayShelf, model: mujoco.MjModel, quality: Quality) -> list[bytes]:
    """Colour, depth and ids of two pictures, the second from another place."""
    renderer = open_renderer("raster", model, quality=quality, shelf=shelf)
    try:
        stage = Stage(model=model, data=posed(model))
        views = [renderer.render(stage, (camera(160, 96, y_m=y_m),))[0] for y_m in (0.0, 1.5)]
    finally:
        renderer.close()
    parts = [part for view in views for part in (view.linear_rgb, view.depth_m, view.geom_id)]
    return [np.ascontiguousarray(part).tobytes() for part in parts]


@pytest.mark.parametrize("quality", ["film", "fast"])
def test_what_lies_on_the_shelf_makes_the_same_pictures(
    quality: Quality, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    draws_shadows_anew = not is_software(renderer_info("raster").device)  # as a GPU does
    model = street("ClearSunset")
    shelf = ArrayShelf(folder=tmp_path, owner="street")
    expected = pictures_with(NO_SHELF, model, quality)
    assert pictures_with(shelf, model, quality) == expected
    uploaded: list[npt.NDArray[np.float32]] = []
    upload = gl.upload_depth

    def recorded(texture: int, left: int, top: int, depth: npt.NDArray[np.float32]) -> None:
        uploaded.append(depth)
        upload(texture, left, top, depth)

    monkeypatch.setattr(gl, "upload_depth", recorded)
    monkeypatch.setattr(geometry, "geometry_of", None)  # the triangles come from the shelf
    assert pictures_with(shelf, model, quality) == expected
    assert [(depth.min() < 1, depth.max() == 1) for depth in uploaded] == ([] if draws_shadows_anew else [(True, True)])


@pytest.mark.parametrize("weather", ["ClearNoon", "CloudySunset"])
@pytest.mark.parametrize("quality", ["film", "fast"])
def test_it_shows_what_filament_shows(weather: str, quality: Quality) -> None:
    pictures = {}
    for name, sun in (("filament", weather), ("raster", weather), ("raster", "ClearSunset")):
        model = street(sun)
        renderer = open_renderer(name, model, quality=quality)
        try:
            (view,) = renderer.render(Stage(model=model, data=posed(model)), (camera(320, 192),))
        finally:
            renderer.close()
        assert view.linear_rgb is not None
        pictures[name, sun] = response_for(name, PRESETS[weather]).apply(view.linear_rgb).astype(float)
    likeness = {
        key: -10 * math.log10(((picture - pictures["filament", weather]) ** 2).mean() / 255**2 + 1e-9)
        for key, picture in pictures.items()
    }
    assert likeness["raster", weather] > 34
    assert likeness["raster", "ClearSunset"] < 26, "another sun would be noticed"


def test_nothing_is_drawn_of_what_is_all_clear() -> None:
    xml = STREET.replace('rgba="0.1 0.3 0.6 1"', 'rgba="0.1 0.3 0.6 0"')
    model = mujoco.MjModel.from_xml_string(xml)
    renderer = open_renderer("raster", model, quality="fast")
    try:
        (view,) = renderer.render(Stage(model=model, data=posed(model)), (camera(),), colour=False)
    finally:
        renderer.close()
    assert int(model.geom("kiosk").id) not in view.geom_id


def test_a_model_without_anything_is_an_empty_picture() -> None:
    model = mujoco.MjModel.from_xml_string("<mujoco><worldbody/></mujoco>")
    renderer = open_renderer("raster", model)
    try:
        (view,) = renderer.render(Stage(model=model, data=posed(model)), (camera(33, 17),))
    finally:
        renderer.close()
    assert view.linear_rgb is not None and not view.linear_rgb.any()
    assert (view.geom_id == -1).all() and np.isnan(view.depth_m).all()


def test_two_of_them_do_not_disturb_each_other() -> None:
    model = street("ClearNoon")
    stage = Stage(model=model, data=posed(model))
    first, second = (open_renderer("raster", model, quality=quality) for quality in ("film", "fast"))
    try:
        alone = first.render(stage, (camera(),))[0].linear_rgb
        between = second.render(stage, (camera(yaw_deg=30),))[0].linear_rgb
        again = first.render(stage, (camera(),))[0].linear_rgb
        assert alone is not None and again is not None and between is not None
        assert np.array_equal(alone, again) and not np.array_equal(alone, between)
    finally:
        first.close()
        second.close()


def test_a_picture_from_below_shows_what_stands_above() -> None:
    """The cube of a sky is the right way round for whoever looks up."""
    model = street("ClearNoon")
    axes = np.stack([[0, -1, 0], [1, 0, 0], [0, 0, 1]], axis=1)
    record = CameraRecord(
        name="c",
        width_px=33,
        height_px=33,
        focal_px=20.0,
        world_from_camera=Pose.from_transform(RigidTransform.from_parts("world", "camera", axes, (500.0, 500.0, 0.0))),
    )
    frames = []
    for name in ("filament", "raster"):
        renderer = open_renderer(name, model, quality="fast")
        try:
            (view,) = renderer.render(Stage(model=model, data=posed(model)), (record,))
        finally:
            renderer.close()
        assert view.linear_rgb is not None
        frames.append(view.linear_rgb.astype(int))
    assert np.median(np.abs(frames[0] - frames[1])) <= 4


def rendered(renderer: Renderer, stage: Stage, record: CameraRecord) -> np.ndarray:
    (view,) = renderer.render(stage, (record,))
    assert view.linear_rgb is not None
    return view.linear_rgb


def test_a_picture_of_half_the_size_is_no_other_than_it_would_be_alone() -> None:
    """One of them is as large as what the other's samples are kept in."""
    model = street("ClearNoon")
    stage = Stage(model=model, data=posed(model))
    frames = []
    for sizes in (((80, 48), (40, 24)), ((40, 24),)):
        renderer = open_renderer("raster", model)
        frames.append([rendered(renderer, stage, camera(*size)) for size in sizes][-1])
        renderer.close()
    assert np.array_equal(*frames)


def test_what_lies_beyond_the_map_of_the_town_is_lit() -> None:
    blocks = "".join(
        f'<geom type="box" size="5 5 6" pos="{20 * x} {20 * y} 6"/>' for x in range(-3, 4) for y in range(-3, 4)
    )
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><light type="directional" dir="0.8 0 -0.35" diffuse="1 1 1"/>'
        f'<geom name="ground" type="plane" size="2000 2000 1" rgba="0.5 0.5 0.5 1"/>{blocks}</worldbody></mujoco>'
    )
    renderer = open_renderer("raster", model, quality="fast")
    try:
        frame = rendered(renderer, Stage(model=model, data=posed(model)), camera(64, 64, x_m=300, yaw_deg=0))
    finally:
        renderer.close()
    ground = frame[34:, 20:44]
    assert 50 < ground.max() < 2 * int(ground.min()), "near the camera and kilometres away"


@pytest.mark.parametrize("front_first", [True, False])
def test_a_sheet_shows_the_side_that_looks_at_the_camera(*, front_first: bool) -> None:
    """Both sides lie at the very same depth, and in one mesh."""
    sides = ["0 1 2 0 2 3", "4 6 5 4 7 6"]
    corners = "0 -1 -1 0 1 -1 0 1 1 0 -1 1"
    normals = "1 0 0 " * 4 + "-1 0 0 " * 4
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><asset><mesh name="sheet" inertia="shell" vertex="{corners} {corners}" normal="{normals}"'
        f' face="{" ".join(sides if front_first else sides[::-1])}"/></asset><worldbody>'
        '<light type="directional" dir="1 0.2 -0.3" diffuse="1 1 1"/>'
        '<geom type="mesh" mesh="sheet" pos="5 0 1.6" rgba="0.6 0.6 0.6 1" contype="0" conaffinity="0"/>'
        "</worldbody></mujoco>"
    )
    stage, cameras = Stage(model=model, data=posed(model)), (camera(),)
    renderer = open_renderer("raster", model, quality="fast")
    try:
        (first,) = renderer.render(stage, cameras)
        (again,) = renderer.render(stage, cameras, shapes=(first,))
    finally:
        renderer.close()
    assert first.linear_rgb is not None and again.linear_rgb is not None
    assert first.linear_rgb[first.geom_id == 0].min() > 100, "the sun shines on this side"
    assert np.array_equal(first.linear_rgb, again.linear_rgb)


def test_a_stage_may_have_more_faces_than_are_kept() -> None:
    parts = "".join(
        f'<texture name="t{k}" type="2d" builtin="flat" width="8" height="8" colorspace="sRGB"/>'
        f'<material name="m{k}" texture="t{k}" metallic="0" roughness="1" emission="1"/>'
        for k in range(18)
    )
    boxes = "".join(f'<geom type="box" size="0.01 0.4 0.4" pos="12 {8.5 - k} 1.6" material="m{k}"/>' for k in range(18))
    model = mujoco.MjModel.from_xml_string(f"<mujoco><asset>{parts}</asset><worldbody>{boxes}</worldbody></mujoco>")
    faces = {k: np.full((8, 8, 3), 90 + 8 * k, np.uint8) for k in range(18)}
    renderer = open_renderer("raster", model, quality="fast")
    try:
        stage = Stage(model=model, data=posed(model), faces=faces)
        record = camera(640, 64, y_m=0.0, yaw_deg=0.0)
        (view,) = renderer.render(stage, (record,))
        again = rendered(renderer, stage, record)
    finally:
        renderer.close()
    assert view.linear_rgb is not None and np.array_equal(again, view.linear_rgb)
    shown = [float(np.median(view.linear_rgb[view.geom_id == k])) for k in range(18)]
    expected = [1020 * ((value / 255 + 0.055) / 1.055) ** 2.4 for value in range(90, 90 + 8 * 18, 8)]
    assert shown == pytest.approx(expected, abs=1.5)


def test_a_closed_renderer_says_so() -> None:
    model = street("ClearNoon")
    renderer = open_renderer("raster", model)
    renderer.close()
    with pytest.raises(RuntimeError, match="closed"):
        renderer.render(Stage(model=model, data=posed(model)), (camera(),))


@pytest.mark.parametrize("names", [("raster",), ("raster", "classic"), ("classic", "raster")])
def test_it_starts_in_a_process_that_says_nothing_of_opengl(names: tuple[str, ...]) -> None:
    code = "; ".join(["from gear.render import probe", *(f"print(probe({name!r}).info.backend)" for name in names)])
    environment = {key: value for key, value in os.environ.items() if key not in ("MUJOCO_GL", "PYOPENGL_PLATFORM")}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["egl"] * len(names)


@pytest.mark.parametrize("quality", ["film", "fast"])
def test_shadows_do_not_depend_on_earlier_pictures(quality: Quality) -> None:
    """Maps are drawn where they are seen only; beside that part lies what an earlier picture left."""
    model = street("ClearSunset")
    stage = Stage(model=model, data=posed(model))
    records = [camera(yaw_deg=yaw) for yaw in (90, 4, 250)]
    one = open_renderer("raster", model, quality=quality)
    try:
        together = [rendered(one, stage, record) for record in (*records, *records)]
    finally:
        one.close()
    for record, first, second in zip(records, together[:3], together[3:], strict=True):
        other = open_renderer("raster", model, quality=quality)
        try:
            assert np.array_equal(rendered(other, stage, record), first) and np.array_equal(first, second)
        finally:
            other.close()


def test_geoms_that_a_stage_leaves_out_are_drawn_nowhere() -> None:
    model = street("ClearNoon")
    data = posed(model)
    is_absent = np.arange(model.ngeom) == model.geom("car").id
    shown, left_out = Stage(model=model, data=data), Stage(model=model, data=data, is_absent=is_absent)
    with_car = posed(model)
    with_car.geom_xpos[is_absent, 2] = -500.0
    gone = Stage(model=model, data=with_car)
    renderer = open_renderer("raster", model, quality="fast")
    try:
        frames = [rendered(renderer, stage, camera()) for stage in (shown, left_out, gone)]
    finally:
        renderer.close()
    assert np.array_equal(frames[1], frames[2]) and not np.array_equal(frames[0], frames[1])


def test_more_pieces_than_one_draw_call_takes_are_all_in_their_places() -> None:
    """Shaders find the pose of a piece by its number in a draw call of at most 800 pieces."""
    side = 30
    places = [(10.0, 0.3 * (column - side / 2), 0.3 * row - 2.8) for row in range(side) for column in range(side)]
    boxes = "".join(f'<geom type="box" size=".12 .12 .12" pos="{x} {y:.2f} {z:.2f}"/>' for x, y, z in places)
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{boxes}</worldbody></mujoco>")
    record = camera(320, 192, y_m=0.0, yaw_deg=0.0)
    renderer = open_renderer("raster", model, quality="fast")
    try:
        (view,) = renderer.render(Stage(model=model, data=posed(model)), (record,))
    finally:
        renderer.close()
    in_camera = record.world_from_camera_transform.inverse().apply(np.array(places))
    columns, rows = np.rint(record.intrinsics.project(in_camera)).astype(int).T
    is_inside = (columns >= 0) & (columns < 320) & (rows >= 0) & (rows < 192)
    assert is_inside.sum() > 800
    assert np.array_equal(view.geom_id[rows[is_inside], columns[is_inside]], np.flatnonzero(is_inside))
