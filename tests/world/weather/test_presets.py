"""Presets, the sky, and what a weather does to a world."""

from __future__ import annotations

import dataclasses
import math
from itertools import pairwise

import mujoco
import numpy as np
import pytest

from gear.contracts.rendering import FULL_SCALE_LUX, Stage
from gear.render import RENDERERS, open_renderer
from gear.values.geometry import Intrinsics, RigidTransform
from gear.values.scene import MOST, WEATHER_PARAMETERS, CameraRecord, Pose, Weather
from gear.world.compilation.quiet_mjcf import mjcf
from gear.world.weather.air import RAIN_PER_M, air_of, camera_pipeline, fogs_of
from gear.world.weather.light import (
    FACE_ORDER,
    WHITE_ALBEDO,
    airlight,
    face_directions,
    lighting_of,
    mirrored_radiance,
)
from gear.world.weather.presets import PRESETS, apply_weather, wetness
from gear.world.weather.sky import Sky

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
    assert {name for name, weather in PRESETS.items() if not weather.night} == {
        "ClearNoon", "CloudyNoon", "ClearSunset", "CloudySunset", "SoftRainNoon", "WetNoon", "MidRainyNoon",
        "HardRainNoon",
    }  # fmt: skip
    for name, weather in PRESETS.items():
        if weather.night:
            noon = PRESETS[name.replace("Night", "Noon")]
            assert dataclasses.replace(noon, name=name, sun_altitude_deg=-90) == weather
    assert all(weather.name == name for name, weather in PRESETS.items())
    keys = ("cloudiness", "precipitation", "precipitation_deposits", "wind_intensity", "sun_altitude_deg",
            "fog_density")  # fmt: skip
    table = {
        "ClearNoon": (5, 0, 0, 10, 45, 2), "CloudyNoon": (60, 0, 0, 10, 45, 3), "ClearSunset": (5, 0, 0, 10, 15, 2),
        "CloudySunset": (60, 0, 0, 10, 15, 3), "SoftRainNoon": (20, 30, 50, 30, 45, 3),
        "WetNoon": (5, 0, 50, 10, 45, 3), "MidRainyNoon": (60, 60, 60, 60, 45, 3),
        "HardRainNoon": (100, 100, 90, 100, 45, 7),
    }  # fmt: skip
    for name, numbers in table.items():
        preset = PRESETS[name]
        assert tuple(getattr(preset, key) for key in keys) == numbers, name
        assert (preset.fog_distance_m, preset.fog_falloff, preset.wetness) == (0.75, 0.1, 0), name
        assert (preset.scattering_intensity, preset.mie_scattering_scale) == (1, 0.03), name
        assert (preset.rayleigh_scattering_scale, preset.sun_azimuth_deg) == (0.0331, 225), name


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
            assert view.linear_rgb is not None
            nothing = view.geom_id < 0
            rays = record.intrinsics.unproject(np.argwhere(nothing)[:, ::-1], np.ones(nothing.sum()))
            rays = rays @ record.world_from_camera_transform.rotation.T
            rays /= np.linalg.norm(rays, axis=1, keepdims=True)
            chosen = rng.choice(len(rays), 150, replace=False)
            expected = texels[np.argmax(rays[chosen] @ directions.T, axis=1)] / 255
            if name != "classic":
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
    assert view.linear_rgb is not None
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


def test_the_exposure_does_not_hang_on_where_the_suns_disc_falls() -> None:
    # 75, 85 and 90 degrees meet directions in which the sky is added up: pictures were black there.
    altitudes = [60, 65, 70, 75, 80, 85, 87.5, 90]
    lights = [lighting_of(Weather(name="x", sun_altitude_deg=a), sky_face_px=16) for a in altitudes]
    suns = np.array([light.sun.max() for light in lights])
    ambients = np.array([light.ambient.mean() for light in lights])
    assert np.ptp(suns) < 0.2 * suns.mean() and np.ptp(ambients) < 0.2 * ambients.mean()


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


def test_the_glow_of_the_sun_leaves_the_sky_at_night() -> None:
    directions = face_directions(32).reshape(-1, 3)
    above = directions[directions[:, 2] > 0.05]
    dusk, night = (Sky.of(Weather(name="x", sun_altitude_deg=a)) for a in (-1, -30))
    towards = above @ dusk.towards_sun > 0.9
    glow = [sky.radiance(above)[towards].mean() / sky.radiance(above)[~towards].mean() for sky in (dusk, night)]
    assert glow[0] > 1.5 and glow[1] == pytest.approx(1, abs=0.02)
    evening = lighting_of(Weather(name="x", sun_altitude_deg=0), sky_face_px=16)
    dark = lighting_of(Weather(name="x", sun_altitude_deg=-30), sky_face_px=16)
    assert dark.sky_faces.mean() < 0.7 * evening.sky_faces.mean()
    assert dark.sun.mean() < 0.1 * dark.ambient.mean(), "nothing casts a shadow"
    assert dark.ambient.mean() > 0.5 * evening.ambient.mean(), (
        "the frame keeps its levels; the night's light darkens it"
    )


@pytest.mark.parametrize("name", sorted(PRESETS))
def test_white_walls_do_not_clip_and_shadows_keep_their_levels(name: str) -> None:
    light = lighting_of(PRESETS[name], sky_face_px=32)
    sunlit = WHITE_ALBEDO * (light.sun / math.pi + light.ambient)
    assert 0.3 < sunlit.max() < 1.0
    assert WHITE_ALBEDO * light.ambient.min() * 255 > 10
    ring = airlight(PRESETS[name])
    assert (ring > 0.1).all() and (ring <= 1).all()


@pytest.mark.parametrize("name", [name for name, weather in PRESETS.items() if weather.night == 1])
def test_at_night_classic_has_no_sun_in_which_white_would_clip(name: str) -> None:
    model = world(PRESETS[name])
    sun = model.light("sun")
    assert (model.vis.headlight.ambient + sun.diffuse <= 1).all()
    assert sun.diffuse.max() * 1020 < 2 and sun.specular.max() == 0, "nothing casts a shadow"
    lighting = lighting_of(PRESETS[name], sky_face_px=16)
    shown = sun.diffuse * model.light_intensity[sun.id]
    assert shown == pytest.approx(lighting.sun * FULL_SCALE_LUX, rel=1e-4), "Filament's is the weather's"


def test_a_weather_replaces_the_light_of_its_town() -> None:
    model = world(PRESETS["ClearNoon"])
    names = {mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_LIGHT, i) for i in range(model.nlight)}
    assert names == {"sun", "sky"}
    assert (model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX).sum() == 1
    azimuth, altitude = math.radians(225), math.radians(45)
    level = math.cos(altitude)
    towards = (math.cos(azimuth) * level, math.sin(azimuth) * level, math.sin(altitude))
    np.testing.assert_allclose(-model.light("sun").dir, towards, atol=1e-6)
    numerics = {mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_NUMERIC, i) for i in range(model.nnumeric)}
    assert "filament.fog.enabled" not in numerics, "fog is gear's own"


def test_water_darkens_and_smooths_open_ground_only() -> None:
    dry, wet = world(PRESETS["ClearNoon"]), world(PRESETS["HardRainNoon"])
    asphalt, brick = dry.material("asphalt").id, dry.material("brick").id
    assert (wet.mat_rgba[asphalt, :3] < 0.7 * dry.mat_rgba[asphalt, :3]).all() and wet.mat_rgba[asphalt, 3] == 1
    assert wet.mat_roughness[asphalt] < 0.5 * dry.mat_roughness[asphalt]
    assert np.array_equal(wet.mat_rgba[brick], dry.mat_rgba[brick])
    assert wet.mat_roughness[brick] == dry.mat_roughness[brick]


def fog_per_m(weather: Weather) -> float:
    return sum(fog.per_m for fog in fogs_of(weather))


def test_the_veil_of_rain_does_not_follow_the_fog() -> None:
    for changes in ({"fog_distance_m": 200.0}, {"fog_falloff": 5.0}, {"fog_distance_m": 90.0, "fog_density": 40.0}):
        *_, veil = fogs_of(Weather(name="x", precipitation=100, **changes))  # type: ignore[arg-type]
        assert (veil.per_m, veil.from_m, veil.thinning_per_m) == (RAIN_PER_M, 0.75, pytest.approx(0.00693))
    for name, weather in PRESETS.items():
        assert len(fogs_of(weather)) == 1, f"{name}: fog and rain are one"


def test_wetness_and_fog_follow_their_parameters() -> None:
    assert wetness(PRESETS["ClearNoon"]) == 0 < wetness(PRESETS["SoftRainNoon"]) < wetness(PRESETS["HardRainNoon"]) == 1
    assert wetness(Weather(name="x", wetness=30)) == pytest.approx(0.3)
    thicker = [fog_per_m(Weather(name="x", fog_density=d)) for d in (0, 2, 7, 50, 100)]
    assert thicker[0] == 0 and all(a < b for a, b in pairwise(thicker))
    assert thicker[-1] * 60 == pytest.approx(3), "the thickest fog hides what is 60 m away"
    assert fog_per_m(Weather(name="x", fog_density=50, scattering_intensity=0)) == 0


@pytest.mark.parametrize("name", RENDERERS)
def test_fog_hides_what_is_far(name: str) -> None:
    rotation = np.array([[0, 0, 1.0], [-1.0, 0, 0], [0, -1.0, 0]])
    record = looking(rotation, (-28.0, 0, 2.0))
    weathers = [Weather(name="x", fog_density=density, fog_falloff=0.0) for density in (0.0, 60.0)]
    model = world(weathers[0])
    renderer = open_renderer(name, model, quality="fast")
    try:
        (raw,) = renderer.render(stage_of(model), (record,))
    finally:
        renderer.close()
    assert raw.linear_rgb is not None
    veiled = [air_of(weather, name).apply(raw.linear_rgb, raw.depth_m, record).astype(float) for weather in weathers]
    pillar = raw.geom_id == 1
    contrasts = [np.abs(v[pillar].mean(axis=0) - v[raw.geom_id < 0].mean(axis=0)).mean() for v in veiled]
    assert contrasts[1] < 0.7 * contrasts[0]
    expected = math.exp(-fog_per_m(weathers[1]) * (28 - 0.75))
    through = air_of(weathers[1], name).transmittance(raw.depth_m, record)[pillar].mean()
    assert through == pytest.approx(expected, rel=0.03)


AMOUNTS = [name for name, field in WEATHER_PARAMETERS.items() if field.metadata["high"] == MOST]


@pytest.mark.parametrize("name", AMOUNTS)
@pytest.mark.parametrize("height_m", [2.0, 9000.0])
def test_air_of_the_most_and_the_least_that_a_config_takes_is_finite(name: str, height_m: float) -> None:
    depth_m = np.full((96, 96), 20, np.float32)
    depth_m[:20], depth_m[40:50] = np.nan, 9000
    record = looking(np.array([[0, 0, 1.0], [-1.0, 0, 0], [0, -1.0, 0]]), (0, 0, height_m))
    for others in (0.0, 1.0, float(MOST)):
        amounts = {**dict.fromkeys(AMOUNTS, others), name: float(MOST)}
        weather = dataclasses.replace(Weather(name="x", fog_density=60, precipitation=50), **amounts)
        through = air_of(weather, "filament").transmittance(depth_m, record)
        assert through.min() >= 0 and through.max() <= 1, "no number is neither"


def test_distant_air_has_the_colour_of_the_horizon_behind_it() -> None:
    weather = Weather(name="x", sun_azimuth_deg=0, sun_altitude_deg=15)
    ring = airlight(weather)
    assert ring[0].sum() > 1.3 * ring[32].sum(), "brighter towards the sun"
    assert air_of(weather, "classic").ring[32].sum() > ring[32].sum(), "classic shows display values"


def test_water_mirrors_houses_below_and_the_sky_above() -> None:
    light = mirrored_radiance(Weather(name="x", sun_azimuth_deg=90, sun_altitude_deg=40), 32, 64)
    assert light.shape == (32, 64, 3)
    brightest = np.unravel_index(np.argmax(light.sum(axis=-1)), light.shape[:2])
    assert abs(brightest[0] / 31 - math.sin(math.radians(40))) < 0.07 and abs(brightest[1] / 64 * 360 - 90) < 10
    assert light[20, 48, 2] > 1.3 * light[20, 48, 0] and light[0, 48, 2] < 1.3 * light[0, 48, 0]


def test_fog_at_dusk_has_the_colour_of_the_streets_light() -> None:
    def yellower(altitude_deg: float) -> float:
        weather = Weather(name="x", fog_density=60, sun_altitude_deg=altitude_deg)
        ring, ambient = airlight(weather).mean(axis=0), lighting_of(weather, sky_face_px=32).ambient
        return float(ring[0] / ring[2] / (ambient[0] / ambient[2]))

    steps = [yellower(altitude) for altitude in (0, -2, -4, -6, -10)]
    assert all(before > after for before, after in pairwise(steps[:4])), "the glow goes with the sun"
    assert steps[0] > 2 and steps[3] == pytest.approx(1, abs=0.03) and steps[4] == pytest.approx(1, abs=0.03)


def test_a_weather_says_what_the_camera_adds() -> None:
    dry, wet = (camera_pipeline(PRESETS[name], "filament", "t") for name in ("ClearNoon", "HardRainNoon"))
    assert dry.water.share == 0 == dry.rain.intensity and wet.water.share > 0.2 and wet.rain.intensity == 1
    assert wet.air.fogs[0].per_m > 5 * dry.air.fogs[0].per_m
    still = camera_pipeline(Weather(name="x", scattering_intensity=0, fog_density=50), "filament", "t").air
    assert still.fogs == () and not still.clear_per_m.any()
