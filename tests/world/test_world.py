"""Worlds: shared parts, labels, and records put into place without compiling anything."""

from __future__ import annotations

import dataclasses
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from gear.camera.effects import CameraEffects
from gear.contracts.rendering import RawView
from gear.render.registry import open_renderer
from gear.testing.tiny_town import CLEAR, SMALL_RIG, TINY_TOWN, build_tiny_world, tiny_scenes, tiny_world
from gear.values.errors import PlacementError, TownError, UnknownNameError
from gear.values.frames import STATIC_OBJECT_BASE
from gear.values.labels import GROUND_CODES, LABEL_BY_NAME
from gear.values.scene import ActorRecord, Pose, SceneRecord, Weather
from gear.world.assets.geom_classes import HIDDEN_CODE
from gear.world.assets.scene_assets import AssetFile
from gear.world.compilation.instances import AssetInstances
from gear.world.compilation.quiet_mjcf import mjcf
from gear.world.compilation.static_parts import split_asset
from gear.world.surfaces.face_texture import FACE_SIZE_PX
from gear.world.weather.air import camera_pipeline
from gear.world.weather.presets import PRESETS
from gear.world.world import World

MJCF = Path(__file__).parents[2] / "mjcf"
POSE = Pose(position_m=(10.0, -1.75, 0.0), quat_wxyz=(0.8660254, 0.0, 0.0, 0.5))


def record(world: World, *actors: ActorRecord) -> SceneRecord:
    ego = ActorRecord(id=1, asset="car_saloon", role="ego", world_from_actor=POSE)
    return SceneRecord(
        town="tiny",
        scene=world.scene_name,
        split="test",
        seed=0,
        index=0,
        sequence=0,
        frame=0,
        time_s=0.0,
        weather=CLEAR,
        actors=(ego, *actors),
        surfaces=world.surface_records(),
        cameras=SMALL_RIG.place(POSE.transform("world", "ego")),
    )


def actor(number: int, asset: str, x_m: float, **more: object) -> ActorRecord:
    pose = Pose(position_m=(x_m, 1.75, 0.0))
    return ActorRecord(id=number, asset=asset, role="npc", world_from_actor=pose, **more)  # type: ignore[arg-type]


def geoms_of(world: World, body: str) -> list[int]:
    return [g for g in range(world.model.ngeom) if world.model.geom_bodyid[g] in bodies_of(world, body)]


def bodies_of(world: World, body: str) -> set[int]:
    root = world.model.body(body).id
    return {b for b in range(world.model.nbody) if world.model.body_rootid[b] == root}


def test_instances_share_meshes_and_materials() -> None:
    world = tiny_world("no_billboard")
    slots = [slot.body for slot in world.slots if slot.actor.name == "truck_box"]
    assert len(slots) > 1
    first, second = (geoms_of(world, body) for body in slots[:2])
    assert list(world.model.geom_matid[first]) == list(world.model.geom_matid[second])
    assert list(world.model.geom_dataid[first]) == list(world.model.geom_dataid[second])
    assert world.model.nmesh == 1, "the only mesh is the truck's face"


def test_instances_have_different_number_plates() -> None:
    root = mjcf.RootElement(model="town")
    car = AssetFile(MJCF / "vehicles" / "car_city.xml")
    parts = AssetInstances(root, {car: split_asset(car)})
    plates = []
    for k in range(8):
        body = root.worldbody.add("body", name=f"car_{k}")
        parts.add_instance(car, body)
        plates += [geom.mesh.name for geom in body.find_all("geom") if geom.mesh and geom.mesh.name.startswith("plate")]
    assert plates == ["plate", *(f"plate_{k}" for k in range(1, 6)), "plate", "plate_1"]


def test_every_board_has_a_material_and_a_texture_of_its_own() -> None:
    world = tiny_world("double")
    model = world.model
    materials = [int(model.geom_matid[face.geom_id]) for face in world.faces]
    textures = [max(int(t) for t in model.mat_texid[m]) for m in materials]
    assert len(set(materials)) == len(set(textures)) == 2
    for material, texture in zip(materials, textures, strict=True):
        assert (model.tex_width[texture], model.tex_height[texture]) == FACE_SIZE_PX
        assert sum(int(m) == material for m in model.geom_matid) == 1


def test_collision_geoms_are_not_in_the_render_model() -> None:
    world = tiny_world()
    assert not (world.model.geom_group >= 3).any()
    assert not (world.classes.label_code == HIDDEN_CODE).any()
    assert {int(c) for c in world.classes.label_code} <= {label.code for label in LABEL_BY_NAME.values()} - {0}


def test_labels_follow_the_first_part_of_the_class() -> None:
    world = tiny_world()
    for geom, label in (("main_road", "road"), ("hedge", "vegetation"), ("house_north", "building")):
        assert world.classes.label_code[world.model.geom(geom).id] == LABEL_BY_NAME[label].code
    rider = world.classes.label_code[world.model.geom("bicycle_rider_0_head").id]
    assert rider == LABEL_BY_NAME["rider"].code


STEEL = '<material name="steel" '
SIDES = '<texture name="sides" type="cube" builtin="flat" width="16" height="96"/>'
DEADLY_CUBE = (STEEL, SIDES + STEEL + 'texture="sides" ')
GREY = '<texture name="grey" type="2d" file="grey.png" nchannel="1" colorspace="sRGB"/>'
DEADLY_GREY = (STEEL, GREY + STEEL + 'texture="grey" ')
VAST = '<texture name="vast" type="2d" builtin="flat" width="16385" height="8"/>'
TOO_LARGE = (STEEL, VAST + STEEL + 'texture="vast" ')


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('"vegetation"', '"shrub"', "geom 'hedge' can be seen but has class 'shrub'"),
        ('name="hedge" class="vegetation"', 'name="hedge"', "geom 'hedge' can be seen but has no class"),
        ('<body name="bench_0" pos="5 -6.1 0.15">', "<frame>", "cannot be read as MJCF"),
        (
            "<worldbody>",
            "<worldbody><frame><body/></frame>",
            "<frame>: 'frame' is not known here; write bodies",
        ),
        ('size="80 3.5 0.25"', 'size="80 3.5 -1"', "MuJoCo cannot compile it"),
        (*DEADLY_CUBE, "material 'steel' of geom 'lamp_post' has metallic or roughness and a cube texture, 'sides'"),
        (*DEADLY_GREY, "material 'steel' of geom 'lamp_post' has a texture of one channel, 'grey', that is marked"),
        (*TOO_LARGE, "steel' of geom 'lamp_post' has a texture, 'vast', of 16385 x 8 pixels, and renderers take 16384"),
        ("next=lane.main_east_b", "next=lane.moon", "lane.x_east: next names lane.moon"),
    ],
)
def test_a_town_that_breaks_the_rules_is_refused(tmp_path: Path, old: str, new: str, told: str) -> None:
    text = TINY_TOWN.read_text()
    assert old in text
    town = tmp_path / "towns" / "odd.xml"
    town.parent.mkdir()
    town.write_text(text.replace(old, new))
    cv2.imwrite(str(town.parent / "grey.png"), np.full((16, 16), 90, np.uint8))
    for kind in ("vehicles", "pedestrians", "surfaces"):
        (tmp_path / kind).symlink_to(TINY_TOWN.parents[1] / kind)
    with pytest.raises(TownError, match=told) as caught:
        World.build(town=town, scene_name="board", scene=tiny_scenes().scenes["board"], weather=CLEAR)
    assert "odd.xml" in str(caught.value)


@pytest.mark.parametrize("elsewhere", ["", '<include file="more.inc"/>'])
def test_nothing_in_a_town_has_the_name_of_a_cars_part(tmp_path: Path, elsewhere: str) -> None:
    """Also in a town that is read whole, since it includes another file."""
    town = tmp_path / "towns" / "odd.xml"
    town.parent.mkdir()
    text = TINY_TOWN.read_text().replace('name="hedge"', 'name="car_saloon_0_hull"')
    town.write_text(text.replace("<custom>", f"{elsewhere}<custom>"))
    (town.parent / "more.inc").write_text('<mujoco><custom><numeric name="more" data="1"/></custom></mujoco>')
    for kind in ("vehicles", "pedestrians", "surfaces"):
        (tmp_path / kind).symlink_to(TINY_TOWN.parents[1] / kind)
    with pytest.raises(TownError, match="'car_saloon_0_hull'"):
        World.build(town=town, scene_name="board", scene=tiny_scenes().scenes["board"], weather=CLEAR)


def test_a_town_may_call_its_textures_and_materials_what_it_likes(tmp_path: Path) -> None:
    """Those that gear puts there, for the sky, for what lights a street and for faces, then have other names."""
    names = ("sky", "street_light", "board_0_face")
    flat = 'type="2d" builtin="flat" width="8" height="8"'
    own = "".join(f'<texture name="{name}" {flat}/><material name="{name}" texture="{name}"/>' for name in names)
    town = tmp_path / "towns" / "own.xml"
    town.parent.mkdir()
    town.write_text(TINY_TOWN.read_text().replace("<asset>", f"<asset>{own}"))
    for kind in ("vehicles", "pedestrians", "surfaces"):
        (tmp_path / kind).symlink_to(TINY_TOWN.parents[1] / kind)
    model = World.build(town=town, scene_name="board", scene=tiny_scenes().scenes["board"], weather=CLEAR).model
    usual = tiny_world("board").model
    assert [model.tex(name).width[0] for name in names] == [8, 8, 8]
    assert [int((model.tex_type == kind).sum() - (usual.tex_type == kind).sum()) for kind in range(3)] == [3, 0, 0]
    assert model.nmat == usual.nmat + 3


def test_rain_wets_ground_that_has_a_colour_of_its_own(tmp_path: Path) -> None:
    """With a material or without one; what rain runs off, such as a lamp post, keeps its colour."""
    text = TINY_TOWN.read_text()
    for name, old, new in (
        ("main_road", 'material="asphalt"', 'material="asphalt" rgba="0.2 0.1 0.1 1"'),
        ("cross_south", 'material="asphalt"', 'rgba="0.2 0.2 0.2 1"'),
        ("lamp_post", 'material="steel"', 'rgba="0.2 0.2 0.2 1"'),
    ):
        before, found, after = text.partition(f'<geom name="{name}"')
        assert found and old in after
        text = before + found + after.replace(old, new, 1)
    town = tmp_path / "towns" / "own.xml"
    town.parent.mkdir()
    town.write_text(text)
    for kind in ("vehicles", "pedestrians", "surfaces"):
        (tmp_path / kind).symlink_to(TINY_TOWN.parents[1] / kind)
    scene = tiny_scenes().scenes["board"]
    dry, wet = (
        World.build(town=town, scene_name="board", scene=scene, weather=PRESETS[name]).model
        for name in ("ClearNoon", "HardRainNoon")
    )
    for name, share in (("main_road", 0.55), ("cross_south", 0.55), ("lamp_post", 1.0), ("cross_north", 1.0)):
        np.testing.assert_allclose(wet.geom(name).rgba[:3], share * dry.geom(name).rgba[:3], rtol=1e-6)
        assert wet.geom(name).rgba[3] == 1
    assert wet.material("asphalt").rgba[0] == pytest.approx(0.55 * dry.material("asphalt").rgba[0])


def test_errors_about_unknown_names_suggest_the_right_one() -> None:
    scenes = tiny_scenes().scenes
    with pytest.raises(UnknownNameError, match="no town named 'twon10'"):
        World.build(town="twon10", scene_name="board", scene=scenes["board"], weather=CLEAR)
    board = dataclasses.replace(scenes["board"].boards[0], asset="bilboard")
    with pytest.raises(UnknownNameError, match="did you mean billboard"):
        World.build(
            town=TINY_TOWN, scene_name="b", scene=dataclasses.replace(scenes["board"], boards=(board,)), weather=CLEAR
        )


def test_actors_stand_where_the_record_says_and_the_rest_is_out_of_sight() -> None:
    world = build_tiny_world()
    van = actor(2, "van_small", 20.0, paint_rgb=(0.1, 0.2, 0.3))
    placed = world.place(record(world, van))
    data, model = placed.stage.data, placed.stage.model
    hull = model.geom("car_saloon_0_hull").id
    assert data.geom_xpos[hull] == pytest.approx(POSE.transform("world", "ego").apply([0, 0, 0.6]))
    assert placed.geoms.object_id[hull] == 1
    van_hull = model.geom("van_small_0_hull").id
    assert data.geom_xpos[van_hull] == pytest.approx([20, 1.75, 1.1])
    assert placed.stage.paint_rgb == {van_hull: (0.1, 0.2, 0.3)}
    used = placed.geoms.object_id > 0
    slots = np.isin(model.body_rootid[model.geom_bodyid], [model.body(s.body).id for s in world.slots])
    assert (data.geom_xpos[slots & ~used][:, 2] < -50).all()
    assert placed.objects[1].is_ego
    assert not placed.objects[2].is_ego
    assert placed.objects[2].kitti_type == "Van"
    assert np.allclose(placed.objects[1].world_from_object.translation_m, POSE.position_m)


def test_an_object_is_where_its_pixels_are() -> None:
    world = build_tiny_world()
    placed = world.place(record(world, actor(2, "truck_box", 0.0), actor(3, "bicycle_rider", 30.0)))
    data, model = placed.stage.data, placed.stage.model
    for thing in placed.objects.values():
        ids = np.flatnonzero(placed.geoms.object_id == thing.id)
        corners_m = thing.world_from_object.apply(thing.shape.vertices_m)
        for geom in ids:
            reach_m = model.geom_rbound[geom] + 1e-6
            assert np.linalg.norm(corners_m - data.geom_xpos[geom], axis=1).min() <= reach_m, thing.asset
        low, high = thing.shape.vertices_m.min(axis=0), thing.shape.vertices_m.max(axis=0)
        assert thing.shape.box_size_m == pytest.approx(high - low)
        assert thing.shape.box_centre_m == pytest.approx((high + low) / 2)
    rider = placed.objects[3]
    assert rider.label_code == LABEL_BY_NAME["bicycle"].code
    assert set(rider.shape.face_label_code) == {LABEL_BY_NAME["bicycle"].code, LABEL_BY_NAME["rider"].code}


def test_countable_things_of_the_town_are_objects() -> None:
    world = tiny_world()
    things = {thing.asset: thing for thing in world.statics.objects.values()}
    assert set(things) == {"light_main_east", "stop_cross_south", "bench_0"}
    assert all(number >= STATIC_OBJECT_BASE for number in world.statics.objects)
    bench = things["bench_0"]
    assert bench.world_from_object.translation_m == pytest.approx([5, -6.1, 0.15])
    assert bench.shape.box_size_m == pytest.approx([1.8, 0.45, 0.56])
    post = world.model.geom("light_main_east_post").id
    assert world.statics.object_id[post] == -1, "a pole is no traffic light"


def test_placing_again_leaves_nothing_behind() -> None:
    world = build_tiny_world()
    first = record(world, actor(2, "van_small", 20.0))
    alone = record(world)
    fresh = world.place(alone).stage.data.geom_xpos.copy()
    world.place(first)
    again = world.place(alone)
    assert np.array_equal(again.stage.data.geom_xpos, fresh)
    assert 2 not in again.objects
    assert 2 not in again.geoms.object_id


def test_surfaces_show_the_given_patches() -> None:
    world = tiny_world("double")
    patch = np.zeros((3, 5, 3), np.uint8)
    patch[0, 0] = (255, 0, 0)
    first, second = world.faces
    placed = world.place(record(world), {"surface_0": patch, "surface_1": "white"})
    assert tuple(placed.stage.faces[first.geom_id][0, 0]) == (255, 0, 0)
    assert (placed.stage.faces[first.geom_id][-1, -1] == 0).all()
    assert (placed.stage.faces[second.geom_id] == 255).all()
    assert list(placed.geoms.surface_index[[first.geom_id, second.geom_id]]) == [0, 1]
    assert (placed.geoms.surface_index >= 0).sum() == 2
    plain = world.place(record(world), {"surface_1": "black"})
    assert (plain.stage.faces[first.geom_id] == 153).all(), "the asset's own texture is albedo 0.6 in sRGB"
    assert (plain.stage.faces[second.geom_id] == 0).all()
    with pytest.raises(ValueError, match="no surface named surface_2"):
        world.place(record(world), {"surface_2": "white"})


def test_a_face_without_a_texture_shows_the_albedo_of_its_material(tmp_path: Path) -> None:
    (tmp_path / "towns").mkdir()
    town = shutil.copy(TINY_TOWN, tmp_path / "towns")
    for kind in ("vehicles", "pedestrians"):
        (tmp_path / kind).symlink_to(TINY_TOWN.parents[1] / kind)
    (tmp_path / "surfaces").mkdir()
    board = (TINY_TOWN.parents[1] / "surfaces" / "billboard.xml").read_text()
    old = '<material name="face" texture="face"'
    assert old in board
    (tmp_path / "surfaces" / "billboard.xml").write_text(board.replace(old, '<material name="face" rgba="0.5 0.2 0 1"'))
    world = World.build(town=town, scene_name="board", scene=tiny_scenes().scenes["board"], weather=CLEAR)
    (face,) = world.faces
    assert face.neutral[0, 0] == pytest.approx([188, 124, 0], abs=1), "linear albedo, as all colours of materials are"


def test_a_surface_is_where_its_face_is() -> None:
    world = tiny_world("board")
    (surface,) = world.surface_records()
    assert (surface.width_m, surface.height_m, surface.actor_id) == (7.4, 3.7, None)
    frame = surface.parent_from_surface.transform("world", "surface_0")
    assert frame.translation_m == pytest.approx([55, -8.5, 2.6])
    outward = -frame.rotation[:, 2]
    assert np.degrees(np.arctan2(outward[1], outward[0])) == pytest.approx(175)
    assert frame.rotation[:, 1] == pytest.approx([0, 0, -1], abs=1e-6), "y is down"


def test_a_carried_surface_is_in_the_frame_of_its_truck() -> None:
    world = tiny_world("truck")
    (surface,) = world.surface_records(carrier_id=2)
    assert surface.actor_id == 2
    assert (surface.width_m, surface.height_m) == (2.2, 2.2)
    frame = surface.parent_from_surface.transform("actor", "surface_0")
    assert frame.translation_m == pytest.approx([-4.01, 0, 2.4])
    assert -frame.rotation[:, 2] == pytest.approx([-1, 0, 0], abs=1e-6)


def test_a_record_that_needs_too_much_is_refused() -> None:
    world = tiny_world()
    many = [actor(number, "van_small", 5.0 * number) for number in range(2, 30)]
    with pytest.raises(PlacementError, match="one more van_small"):
        world.place(record(world, *many))


def test_an_open_shutter_smears_what_the_ego_car_passes_and_not_its_bonnet() -> None:
    world = tiny_world("no_billboard")
    shot = record(world)
    driving = dataclasses.replace(shot.actors[0], velocity_world_mps=(10.0, 0.0, 0.0))
    shot = dataclasses.replace(shot, actors=(driving,))
    placed, camera = world.place(shot), shot.cameras[0]
    size = (camera.height_px, camera.width_px)
    ids = np.full(size, world.model.geom("main_road").id, np.int32)
    ids[size[0] // 2 :] = world.model.geom("car_saloon_0_hull").id
    light = np.random.default_rng(0).integers(0, 1000, (*size, 3)).astype(np.uint16)
    raw = RawView(linear_rgb=light, depth_m=np.full(size, 1.5, np.float32), geom_id=ids)
    clear = Weather(name="x", scattering_intensity=0)
    sharp, smeared = (
        camera_pipeline(clear, "filament", "t", CameraEffects(shutter_s=shutter_s)).view(
            raw, camera, shot, placed.geoms
        )
        for shutter_s in (0.0, 0.05)
    )
    changed = (sharp.linear_rgb != smeared.linear_rgb).any(axis=-1)
    assert changed[: size[0] // 3].mean() > 0.9 and not changed[size[0] // 2 :].any()


def test_the_ground_under_a_car_gets_less_of_the_sky_and_nothing_else_changes() -> None:
    world = tiny_world("no_billboard")
    shot = record(world, actor(2, "van_small", 20.0))
    placed, camera = world.place(shot), shot.cameras[0]
    renderer = open_renderer("classic", world.model)
    try:
        (raw,) = renderer.render(placed.stage, [camera])
    finally:
        renderer.close()
    cloudy = PRESETS["CloudyNoon"]
    plain, shaded = (
        camera_pipeline(cloudy, "classic", "t", shapes=shapes)
        .view(raw, camera, shot, placed.geoms)
        .linear_rgb.astype(int)
        for shapes in (None, world.shapes)
    )
    darker, changed = (shaded < plain).any(axis=-1), (shaded != plain).any(axis=-1)
    is_ground = np.isin(np.append(placed.geoms.label_code, 0)[raw.geom_id], GROUND_CODES)
    outline = cv2.dilate(is_ground.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    assert darker.any() and (changed == darker).all()
    assert not changed[~outline].any()
    below_van = np.flatnonzero((raw.geom_id == world.model.geom("main_road").id) & changed)
    least = (shaded.sum(axis=-1).flat[below_van] / plain.sum(axis=-1).flat[below_van]).min()
    assert least < 0.6, "classic's values are a root of light"
