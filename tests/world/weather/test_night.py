"""The lamps and windows of towns are found where they stand."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import mujoco
import numpy as np
import pytest

from authoring.mesh import Mesh, grid, merge, rotation, write_obj
from gear.testing.tiny_town import CLEAR, TINY_TOWN, tiny_scenes, tiny_world
from gear.values.errors import TownError
from gear.values.labels import GROUND_CODES, LABEL_BY_NAME
from gear.values.resources import data_dir
from gear.values.rng import derive_rng
from gear.values.scene import Weather
from gear.world.assets.geom_triangles import world_triangles
from gear.world.weather.lamps import GLAZINGS, find_lamps, find_windows
from gear.world.weather.light import ambient_radiance, lighting_of
from gear.world.weather.night import lit_panes, materials_of, night_of
from gear.world.weather.shadow_casters import find_shadow_casters
from gear.world.world import World

NIGHT = Weather(name="night", sun_altitude_deg=-90)


@cache
def compiled(town: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_path(str(data_dir("mjcf") / "towns" / f"{town}.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data


def posts_m(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> np.ndarray:
    """(N, 2) where the felt posts of lamps stand."""
    found = [i for i in range(model.ngeom) if re.fullmatch(rf"{name}(_\d+)?", model.geom(i).name)]
    return np.asarray(data.geom_xpos[found, :2])


@pytest.mark.parametrize(
    "town", ["suburb", pytest.param("town10", marks=pytest.mark.slow), pytest.param("harbour", marks=pytest.mark.slow)]
)
def test_every_street_lamp_is_found_over_its_street(town: str) -> None:
    model, data = compiled(town)
    street = find_lamps(model, data)["street"]
    posts = posts_m(model, data, "lamp_modern")
    assert len(posts) >= 50
    away_m = np.linalg.norm(street.position_m[None, :, :2] - posts[:, None], axis=2)
    assert (away_m.min(axis=1) < 3.0).all(), "each post bears a lamp"
    modern = away_m.min(axis=0) < 3.0
    assert modern.sum() == len(posts)
    assert (street.axis[modern, 2] < -0.99).all()
    assert ((street.position_m[modern, 2] > 5) & (street.position_m[modern, 2] < 12)).all()


@pytest.mark.slow
def test_heritage_lamps_shine_to_all_sides() -> None:
    model, data = compiled("town10")
    globes = find_lamps(model, data)["globe"]
    posts = np.concatenate([posts_m(model, data, name) for name in ("lamp_heritage", "lamp")])
    assert len(globes.intensity) == len(posts) == 56
    assert np.linalg.norm(globes.position_m[None, :, :2] - posts[:, None], axis=2).min(axis=1).max() < 0.5


def test_the_same_windows_are_lit_every_night_and_face_away_from_their_houses() -> None:
    model, data = compiled("suburb")
    first, again = (find_windows(model, data, derive_rng(0, "windows", "suburb")) for _ in range(2))
    np.testing.assert_array_equal(first.corners_m, again.corners_m)
    glazed = [
        i for i in range(model.ngeom) if model.geom_matid[i] >= 0 and model.mat(model.geom_matid[i]).name == "windows"
    ]
    panes = sum(model.mesh_facenum[model.geom_dataid[i]] for i in glazed) / 2
    lit = np.isin(first.geom_id, glazed).sum()
    assert lit == pytest.approx(GLAZINGS["windows"].lit * panes, rel=0.1)
    # A ray from before a pane against its normal meets the pane's own geom.
    hits = 0
    for index in range(0, len(first.geom_id), 40):
        start = first.corners_m[index].mean(axis=0) + 0.05 * first.normal[index]
        geom = np.zeros(1, np.int32)
        group = np.array([1, 1, 1, 0, 0, 0], np.uint8)
        distance = mujoco.mj_ray(model, data, start, -first.normal[index], group, 1, -1, geom)
        hits += int(geom[0] == first.geom_id[index] and distance < 0.1)
    assert hits >= 0.95 * len(range(0, len(first.geom_id), 40))


def test_lamp_glass_of_other_towns_is_a_material_of_that_name() -> None:
    model = mujoco.MjModel.from_xml_string("""
        <mujoco>
          <asset>
            <material name="lamp_glass"/>
            <mesh name="pane" vertex="0 0 0  0.3 0 0  0.3 0.3 0  0 0.3 0  0.1 0.1 0.02" face="0 2 1  0 3 2"
                  inertia="shell"/>
          </asset>
          <worldbody>
            <geom type="mesh" mesh="pane" material="lamp_glass" pos="4 5 6" contype="0" conaffinity="0"/>
            <geom type="sphere" size="0.2" material="lamp_glass" pos="-4 5 3" contype="0" conaffinity="0"/>
          </worldbody>
        </mujoco>""")
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    found = find_lamps(model, data)
    np.testing.assert_allclose(found["street"].position_m, [[4.15, 5.15, 6.0]], atol=0.05)
    np.testing.assert_allclose(found["street"].axis, [[0, 0, -1]], atol=1e-6)
    np.testing.assert_allclose(found["globe"].position_m, [[-4, 5, 3]], atol=0.01)


def test_lamp_glass_without_a_surface_is_one_line(tmp_path: Path) -> None:
    glass = '<geom name="pane" class="pole" material="lamp_glass" type="plane" size="0.2 0.2 1" pos="0 -6 4"/>'
    text = TINY_TOWN.read_text().replace("</asset>", '<material name="lamp_glass"/></asset>')
    town = tmp_path / "towns" / "odd.xml"
    town.parent.mkdir()
    town.write_text(text.replace('<geom name="hedge"', f'{glass}<geom name="hedge"'))
    for kind in ("vehicles", "pedestrians", "surfaces"):
        (tmp_path / kind).symlink_to(TINY_TOWN.parents[1] / kind)
    world = World.build(town=town, scene_name="board", scene=tiny_scenes().scenes["board"], weather=NIGHT)
    with pytest.raises(TownError, match=r"odd\.xml: geom 'pane' is a plane.*; make the glass of lamps of meshes"):
        night_of(world, NIGHT, "classic")


def test_static_objects_cast_lamp_shadows_and_ground_actors_and_collision_geoms_do_not() -> None:
    world = tiny_world()
    model, codes = world.model, world.classes.label_code
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    corners = find_shadow_casters(model, data, codes)
    assert corners.dtype == np.float32 and corners.shape[1:] == (3, 3) and len(corners)
    (face,) = world.faces
    board_m = data.geom_xpos[face.geom_id]
    assert np.linalg.norm(corners.mean(axis=1) - board_m, axis=1).min() < 3.0, "the board is there"
    data.mocap_pos[:, 2] = -500.0
    mujoco.mj_kinematics(model, data)
    np.testing.assert_array_equal(find_shadow_casters(model, data, codes), corners)
    ground = np.isin(codes, GROUND_CODES) & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE)
    flat = np.concatenate(
        [np.zeros((0, 3, 3)), *(world_triangles(model, data, geom) for geom in np.flatnonzero(ground))]
    )
    middles = {tuple(np.round(middle, 3)) for middle in flat.mean(axis=1)}
    assert not middles & {tuple(np.round(middle, 3)) for middle in corners.astype(float).mean(axis=1)}


def test_there_is_a_night_only_without_the_sun() -> None:
    world = tiny_world()
    assert night_of(world, CLEAR, "filament") is None
    dusk, dark = (night_of(world, Weather(name="x", sun_altitude_deg=a), "classic") for a in (-2, -90))
    assert dusk is not None and dark is not None
    assert dark.level < 0.1 < dusk.level < 1 and 0 < dusk.lit < dark.lit < 1 and dark.is_display
    assert not len(dark.windows.geom_id) and not len(dark.lamps["street"].intensity)
    assert dark.vehicles and all(lamps.front_m > 0 for lamps in dark.vehicles.values())
    assert not dark.is_pane.any(), "the tiny town has no bus"


def test_a_bus_is_found_by_its_label_and_its_glass() -> None:
    model = mujoco.MjModel.from_xml_path(str(data_dir("mjcf") / "vehicles" / "bus_city.xml"))
    names = [model.mesh(mesh).name if mesh >= 0 else "" for mesh in model.geom_dataid]
    for label, panes in (("bus", [name == "glass" for name in names]), ("van", [False] * model.ngeom)):
        labels = np.full(model.ngeom, LABEL_BY_NAME[label].code, np.uint8)
        np.testing.assert_array_equal(lit_panes(materials_of(model), labels), panes)


def test_even_light_is_what_the_sky_and_the_houses_give() -> None:
    above, aside, below = ambient_radiance(NIGHT)
    assert (above > aside).all() and (aside > below).all() and (below > 0).all()
    assert above.mean() == pytest.approx(lighting_of(NIGHT, sky_face_px=16).ambient.mean(), rel=0.4)


@pytest.mark.parametrize("width_m", [0.6, 1.0, 1.4], ids=["tall", "square", "wide"])
def test_every_pane_is_found_however_its_quad_was_cut(
    width_m: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Gear's own files have quads, which MuJoCo cuts along one diagonal or the other; a triangle may be in between."""
    monkeypatch.setitem(GLAZINGS, "windows", replace(GLAZINGS["windows"], lit=1.0))
    panes = [
        grid([[(x, 0, z) for x in (2 * k, 2 * k + width_m)] for z in (0, 1)]).transformed(rotation("z", 17.0 * k))
        for k in range(6)
    ]
    lone = Mesh.of([(0, 0, 5), (1, 0, 5), (1, 0, 6)], [[0, 1, 2]])
    write_obj(tmp_path / "panes.obj", merge([*panes[:3], lone, *panes[3:]]), is_patchwork=True)
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><asset><material name="windows"/><mesh name="p" file="{tmp_path}/panes.obj" inertia="shell"/></asset>'
        '<worldbody><geom type="mesh" mesh="p" material="windows" contype="0" conaffinity="0"/></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    found = find_windows(model, data, derive_rng(0, "windows", "test"))
    assert len(found.corners_m) == len(panes)
    for pane, corners in zip(panes, found.corners_m, strict=True):
        np.testing.assert_allclose(corners.mean(axis=0), pane.vertices.mean(axis=0), atol=2e-3)
        sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
        np.testing.assert_allclose(sorted(sides), sorted([width_m, width_m, 1, 1]), atol=4e-3)
