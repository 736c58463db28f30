"""Presets, the sky, and what a weather does to a world."""

from __future__ import annotations

import math
from itertools import pairwise

import mujoco
import numpy as np
import pytest

from gear.contracts.rendering import Stage
from gear.render import RENDERERS, open_renderer
from gear.values.geometry import Intrinsics, RigidTransform
from gear.values.scene import CameraRecord, Pose, Weather
from gear.world.light import FACE_ORDER, WHITE_ALBEDO, face_directions, lighting_of
from gear.world.quiet_mjcf import mjcf
from gear.world.sky import Sky
from gear.world.weather import PRESETS, apply_weather, fog_per_m, wetness

TOWN = """
<mujoco model="town">
  <default>
    <default class="road"><geom material="asphalt"/><default class="road.lane"/></default>
    <default class="building"/>
  </default>
  <custom><numeric name="filament.fog.enabled" data="1"/></custom>
  <asset>
    <texture name="old_sky" type="skybox" builtin="gradient" rgb1="1 0 0" rgb2="0 1 0" width="8" height="48"/>
    <material name="asphalt" rgba="0.2 0.2 0.2 1" metallic="0" roughness="0.9"/>
    <material name="brick" rgba="0.4 0.2 0.1 1" metallic="0" roughness="0.9"/>
    <mesh name="slab" vertex="-30 -30 0  30 -30 0  30 30 0  -30 30 0" texcoord="0 0  1 0  1 1  0 1"
          face="0 1 2  0 2 3" inertia="shell"/>
    <mesh name="wall" vertex="0 -0.3 0  0 0.3 0  0 0.3 6  0 -0.3 6  0.3 -0.3 0  0.3 0.3 0  0.3 0.3 6  0.3 -0.3 6"
          texcoord="0 0 1 0 1 1 0 1 0 0 1 0 1 1 0 1"/>
  </asset>
  <worldbody>
    <light name="old" pos="0 0 9"/>
    <geom class="road.lane" type="mesh" mesh="slab" contype="0" conaffinity="0"/>
    <geom name="pillar" class="building" type="mesh" mesh="wall" material="brick"/>
  </worldbody>
</mujoco>
"""


def world(weather: Weather) -> mujoco.MjModel:
    root = mjcf.from_xml_string(TOWN)
    apply_weather(root, weather)
    return mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())


def looking(rotation: np.ndarray, position_m: tuple[float, float, float], size: int = 96) -> CameraRecord:
    intrinsics = Intrinsics.from_hfov(size, size, math.radians(80))
    pose = Pose.from_transform(RigidTransform.from_parts("world", "camera", rotation, position_m))
    return CameraRecord(name="c", width_px=size, height_px=size, focal_px=intrinsics.focal_px, world_from_camera=pose)


DOWN = np.array([[1.0, 0, 0], [0, -1.0, 0], [0, 0, -1.0]])


def stage_of(model: mujoco.MjModel) -> Stage:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return Stage(model=model, data=data)


def test_presets_are_carlas() -> None:
    assert set(PRESETS) == {
        "ClearNoon", "CloudyNoon", "ClearSunset", "CloudySunset", "SoftRainNoon", "WetNoon", "MidRainyNoon",
        "HardRainNoon",
    }  # fmt: skip
    assert all(weather.name == name for name, weather in PRESETS.items())
    clear, soft, hard = PRESETS["ClearNoon"], PRESETS["SoftRainNoon"], PRESETS["HardRainNoon"]
    assert (clear.cloudiness, clear.sun_altitude_deg, clear.fog_density, clear.sun_azimuth_deg) == (5, 45, 2, 225)
    assert (soft.cloudiness, soft.precipitation, soft.precipitation_deposits, soft.wind_intensity) == (20, 30, 50, 30)
    assert (hard.cloudiness, hard.precipitation, hard.precipitation_deposits, hard.fog_density) == (100, 100, 90, 7)
    assert PRESETS["ClearSunset"].sun_altitude_deg == 15
    assert clear.mie_scattering_scale == 0.03 and clear.rayleigh_scattering_scale == 0.0331


def test_faces_of_the_sky_look_outwards_all_around() -> None:
    directions = face_directions(8)
    assert directions.shape == (6, 8, 8, 3)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=-1), 1)
    middles = dict(zip(FACE_ORDER, directions.mean(axis=(1, 2)).round(6), strict=True))
    axes = {"R": (1, 0, 0), "L": (-1, 0, 0), "U": (0, 0, 1), "D": (0, 0, -1), "F": (0, -1, 0), "B": (0, 1, 0)}
    for face, axis in axes.items():
        assert np.argmax(middles[face] @ np.array(list(axes.values())).T) == list(axes).index(face), axis
    np.testing.assert_allclose(directions.reshape(-1, 3).sum(axis=0), 0, atol=1e-9)


@pytest.mark.parametrize("name", RENDERERS)
def test_renderers_show_each_part_of_the_sky_where_it_is(name: str) -> None:
    weather = Weather(name="x", sun_azimuth_deg=130, sun_altitude_deg=35, cloudiness=40)
    model = world(weather)
    faces, directions = lighting_of(weather).sky_faces, face_directions(512).reshape(-1, 3)
    texels = faces.reshape(-1, 3)
    renderer = open_renderer(name, model, quality="fast")
    rng = np.random.Generator(np.random.PCG64(5))
    try:
        for _ in range(3):
            rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
            record = looking(rotation * np.linalg.det(rotation), (0, 0, 200.0), 48)
            (view,) = renderer.render(stage_of(model), (record,))
            assert view.linear_rgb is not None and view.geom_id is not None
            nothing = view.geom_id < 0
            rays = record.intrinsics.unproject(np.argwhere(nothing)[:, ::-1], np.ones(nothing.sum()))
            rays = rays @ record.world_from_camera_transform.rotation.T
            rays /= np.linalg.norm(rays, axis=1, keepdims=True)
            chosen = rng.choice(len(rays), 150, replace=False)
            expected = texels[np.argmax(rays[chosen] @ directions.T, axis=1)] / 255
            if name == "filament":
                expected = np.where(expected <= 0.04045, expected / 12.92, ((expected + 0.055) / 1.055) ** 2.4)
            got = view.linear_rgb[nothing][chosen] / 1020
            assert np.median(np.abs(got - expected)) < 0.01
            assert np.median(np.abs(got - expected[::-1])) > 0.02, "a shuffled sky would be noticed"
    finally:
        renderer.close()


@pytest.mark.parametrize("name", RENDERERS)
@pytest.mark.parametrize("azimuth_deg", [20.0, 225.0])
def test_shadows_point_away_from_the_sun(name: str, azimuth_deg: float) -> None:
    model = world(Weather(name="x", sun_azimuth_deg=azimuth_deg, sun_altitude_deg=40))
    renderer = open_renderer(name, model, quality="film")
    try:
        (view,) = renderer.render(stage_of(model), (looking(DOWN, (0, 0, 30.0)),))
    finally:
        renderer.close()
    assert view.linear_rgb is not None and view.geom_id is not None
    ground = view.geom_id == 0
    light = view.linear_rgb.sum(axis=-1).astype(float)
    dark = ground & (light < 0.7 * np.median(light[ground]))
    rows, columns = np.nonzero(dark)
    assert len(rows) > 15
    # Seen from above with north up; the pillar stands in the middle.
    away = np.array([columns.mean() - 47.5, 47.5 - rows.mean()])
    expected = -np.array([math.cos(math.radians(azimuth_deg)), math.sin(math.radians(azimuth_deg))])
    assert away @ expected / np.linalg.norm(away) > 0.97


def test_the_sky_is_brightest_at_the_sun_and_blue_across_from_it() -> None:
    sky = Sky.of(Weather(name="x", sun_azimuth_deg=70, sun_altitude_deg=30))
    directions = face_directions(32).reshape(-1, 3)
    light = sky.radiance(directions)
    above = directions[:, 2] > 0.2
    brightest = directions[above][np.argmax(light[above].sum(axis=1))]
    assert brightest @ sky.towards_sun > math.cos(math.radians(4))
    opposite = light[above & (directions @ sky.towards_sun < 0)].mean(axis=0)
    assert opposite[2] > 1.4 * opposite[0]
    assert (light >= 0).all() and np.isfinite(light).all()


def test_clouds_grey_the_light() -> None:
    clear, overcast = (lighting_of(Weather(name="x", cloudiness=c), sky_face_px=32) for c in (0, 100))
    assert clear.sun.mean() > 8 * clear.ambient.mean()
    assert overcast.sun.mean() < overcast.ambient.mean()
    assert np.ptp(overcast.ambient) / overcast.ambient.mean() < 0.3 < np.ptp(clear.ambient) / clear.ambient.mean()


def test_a_low_sun_is_red_and_weak() -> None:
    noon, evening = (Sky.of(Weather(name="x", sun_altitude_deg=a)).sun_klx for a in (45, 8))
    assert evening.sum() < 0.6 * noon.sum()
    assert evening[0] / evening[2] > 1.5 * noon[0] / noon[2]
    assert Sky.of(Weather(name="x", sun_altitude_deg=-10)).sun_klx.sum() < 0.05 * noon.sum()


@pytest.mark.parametrize("name", sorted(PRESETS))
def test_white_walls_do_not_clip_and_shadows_keep_their_levels(name: str) -> None:
    light = lighting_of(PRESETS[name], sky_face_px=32)
    sunlit = WHITE_ALBEDO * (light.sun / math.pi + light.ambient)
    assert 0.3 < sunlit.max() < 1.0
    assert WHITE_ALBEDO * light.ambient.min() * 255 > 10
    assert (light.haze > 0.1).all() and (light.haze <= 1).all()


def test_a_weather_replaces_the_light_of_its_town() -> None:
    model = world(PRESETS["ClearNoon"])
    names = {mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_LIGHT, i) for i in range(model.nlight)}
    assert names == {"sun", "sky"}
    assert (model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX).sum() == 1
    azimuth, altitude = math.radians(225), math.radians(45)
    level = math.cos(altitude)
    towards = (math.cos(azimuth) * level, math.sin(azimuth) * level, math.sin(altitude))
    np.testing.assert_allclose(-model.light("sun").dir, towards, atol=1e-6)
    density = model.numeric("filament.fog.density").data[0]
    assert density == pytest.approx(fog_per_m(PRESETS["ClearNoon"]))


def test_water_darkens_and_smooths_open_ground_only() -> None:
    dry, wet = world(PRESETS["ClearNoon"]), world(PRESETS["HardRainNoon"])
    asphalt, brick = dry.material("asphalt").id, dry.material("brick").id
    assert (wet.mat_rgba[asphalt, :3] < 0.7 * dry.mat_rgba[asphalt, :3]).all() and wet.mat_rgba[asphalt, 3] == 1
    assert wet.mat_roughness[asphalt] < 0.5 * dry.mat_roughness[asphalt]
    assert np.array_equal(wet.mat_rgba[brick], dry.mat_rgba[brick])
    assert wet.mat_roughness[brick] == dry.mat_roughness[brick]


def test_wetness_and_fog_follow_their_parameters() -> None:
    assert wetness(PRESETS["ClearNoon"]) == 0 < wetness(PRESETS["SoftRainNoon"]) < wetness(PRESETS["HardRainNoon"]) == 1
    assert wetness(Weather(name="x", wetness=30)) == pytest.approx(0.3)
    thicker = [fog_per_m(Weather(name="x", fog_density=d)) for d in (0, 2, 7, 50, 100)]
    assert thicker[0] == 0 and all(a < b for a, b in pairwise(thicker))
    assert thicker[-1] * 60 == pytest.approx(3), "the thickest fog hides what is 60 m away"
    assert fog_per_m(Weather(name="x", fog_density=50, scattering_intensity=0)) == 0


def test_fog_hides_what_is_far() -> None:
    contrasts = []
    for density in (0.0, 60.0):
        model = world(Weather(name="x", fog_density=density))
        renderer = open_renderer("filament", model, quality="fast")
        try:
            rotation = np.array([[0, 0, 1.0], [-1.0, 0, 0], [0, -1.0, 0]])
            (view,) = renderer.render(stage_of(model), (looking(rotation, (-28.0, 0, 2.0)),))
        finally:
            renderer.close()
        assert view.linear_rgb is not None and view.geom_id is not None
        pillar = view.linear_rgb[view.geom_id == 1].mean()
        beside = view.linear_rgb[40:46, 20:30].mean()
        contrasts.append(abs(pillar - beside))
    assert contrasts[1] < 0.7 * contrasts[0]
