from __future__ import annotations

import os
import re
import shutil
import time
from pathlib import Path

import pytest

from gear.testing.tiny_town import CLEAR, TINY_TOWN, tiny_scenes
from gear.values.errors import TownError, UnknownNameError
from gear.world.assets import asset_hash
from gear.world.assets.asset_hash import _referred, asset_files, assets_digest, key_points_digest
from gear.world.assets.library import AssetLibrary, read_actor_facts
from gear.world.assets.scene_assets import read_scene_assets
from gear.world.scene_spec import SceneSpec, TruckSpec
from gear.world.world import World


def actor(folder: Path, custom: str) -> Path:
    path = folder / "thing.xml"
    path.write_text(f"<mujoco><custom>{custom}</custom></mujoco>")
    return path


def test_facts_are_read_without_compiling() -> None:
    library = AssetLibrary.for_town(TINY_TOWN)
    assert library.town_name == "tiny"
    assert list(library.vehicles) == ["bicycle_rider", "car_saloon", "truck_box", "van_small"]
    walker = library.pedestrians["adult_walk"]
    assert (walker.kind, walker.gait) == ("person", "walk")
    car = library.vehicles["car_saloon"]
    assert car.palette[0] == ((0.6, 0.6, 0.6), 3.0)
    assert car.label.kitti_type == "Car"
    assert car.weight > library.vehicles["truck_box"].weight > 0


def test_a_town_by_name_uses_the_assets_of_gear() -> None:
    library = AssetLibrary.for_town("town10")
    assert library.path("vehicle", "car_saloon").is_file()
    with pytest.raises(UnknownNameError, match="did you mean car_saloon"):
        library.path("vehicle", "car_salon")


def test_a_town_elsewhere_without_assets_of_its_own_uses_those_of_gear(tmp_path: Path) -> None:
    town = tmp_path / "mine.xml"
    town.write_text("<mujoco/>")
    assert AssetLibrary.for_town(town).folder("vehicle").parent.name == "mjcf"
    with pytest.raises(UnknownNameError, match="that file does not exist; or give the path of a MJCF"):
        AssetLibrary.for_town(tmp_path / "other.xml")


@pytest.mark.parametrize("town", ["town10", "suburb", "harbour"])
def test_gears_own_files_refer_to_nothing_from_afar(town: str) -> None:
    """So the digest need not look into each."""
    files = asset_files(AssetLibrary.for_town(town))
    known = {path.resolve() for path in files.values()}
    named = [found for path in files.values() if path.suffix == ".xml" for _, found in _referred(path)]
    assert len(named) > 100 and {found.resolve() for found in named} <= known


def test_key_points_change_a_digest_of_their_own(tmp_path: Path) -> None:
    """No picture shows them, so trained weights still fit a town whose people get key points."""
    mjcf = tmp_path / "mjcf"
    shutil.copytree(TINY_TOWN.parents[1], mjcf)
    library = AssetLibrary(mjcf / "towns/tiny.xml")
    person = mjcf / "pedestrians/adult_stand.xml"
    text = person.read_text()
    line = '    <numeric name="key_point.nose" data="0.12 0 1.66"/>\n'
    assert line in text
    pictures, points = assets_digest(library), key_points_digest(library)
    person.write_text(text.replace("0.12 0 1.66", "0.12 0 1.67"))
    assert assets_digest(library) == pictures and key_points_digest(library) != points
    person.write_text(text.replace(line, ""))
    assert assets_digest(library) == pictures and key_points_digest(library) not in (points, "")
    person.write_text(text.replace("</custom>", '<numeric name="other" data="1"/></custom>'))
    assert assets_digest(library) != pictures and key_points_digest(library) == points
    person.write_text(text)
    for path in (mjcf / "pedestrians").glob("*.xml"):
        path.write_text(re.sub(r'\s*<numeric name="key_point[^>]*>', "", path.read_text()))
    assert assets_digest(library) == pictures and key_points_digest(library) == ""


def test_the_digest_covers_whatever_a_town_refers_to(tmp_path: Path) -> None:
    """Meshes, textures and included files may lie anywhere."""
    town = tmp_path / "towns/mine.xml"
    files = {
        "towns/mine.xml": '<mujoco><compiler meshdir="../shapes" texturedir="../paint"/><include file="more.inc"/>'
        '<asset><mesh name="a" file="a.obj"/><texture name="b" type="2d" file="b.jpg"/></asset></mujoco>',
        "towns/more.inc": '<mujoco><asset><mesh name="c" file="c.obj"/></asset><include file="more.inc"/></mujoco>',
        "shapes/a.obj": "a",
        "shapes/c.obj": "c",
        "paint/b.jpg": "b",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    digests = {assets_digest(AssetLibrary.for_town(town))}
    for name in files:
        (tmp_path / name).write_text(files[name] + " ")
        digests.add(assets_digest(AssetLibrary.for_town(town)))
    assert len(digests) == 1 + len(files)


def test_the_digest_covers_what_included_files_include_beside_them(tmp_path: Path) -> None:
    for kind in ("towns", "vehicles", "pedestrians", "surfaces"):
        (tmp_path / kind).mkdir()
    town, parts = tmp_path / "towns" / "mine.xml", tmp_path / "towns" / "parts"
    parts.mkdir()
    files = {
        town: '<mujoco><include file="parts/street.inc"/><include file="lamps.inc"/></mujoco>',
        town.parent / "lamps.inc": "<mujoco/>",
        parts / "street.inc": '<mujoco><include file="lamps.inc"/><include file="../parts/street.inc"/></mujoco>',
        parts / "lamps.inc": '<mujoco><asset><mesh name="a" file="a.obj"/></asset></mujoco>',
        parts / "a.obj": "a",
    }
    for path, text in files.items():
        path.write_text(text)
    digests = {assets_digest(AssetLibrary.for_town(town))}
    for path, text in files.items():
        path.write_text(text + " ")
        digests.add(assets_digest(AssetLibrary.for_town(town)))
    assert len(digests) == 1 + len(files)


@pytest.mark.parametrize("name", ["mine.mjcf", "mine"])
def test_the_digest_covers_a_town_whatever_its_file_is_called(tmp_path: Path, name: str) -> None:
    town, mesh = tmp_path / name, tmp_path / "shapes" / "a.obj"
    mesh.parent.mkdir()
    mesh.write_text("a")
    town.write_text('<mujoco><compiler meshdir="shapes"/><asset><mesh name="a" file="a.obj"/></asset></mujoco>')
    digests = {assets_digest(AssetLibrary.for_town(town))}
    for edited in (mesh, town):
        edited.write_text(edited.read_text() + " ")
        digests.add(assets_digest(AssetLibrary.for_town(town)))
    assert len(digests) == 3


@pytest.mark.parametrize("name", ["../vehicles/truck_box", "./truck_box", "a" * 300, ""])
def test_an_asset_is_asked_for_by_a_plain_name(name: str) -> None:
    library = AssetLibrary.for_town(TINY_TOWN)
    with pytest.raises(UnknownNameError, match="no vehicle named"):
        library.path("vehicle", name)
    with pytest.raises(UnknownNameError, match="no vehicle named"):
        read_scene_assets(library, SceneSpec(truck=TruckSpec(asset=name)))


@pytest.mark.parametrize("town", ["~nosuchuser/x.xml", "a" * 300, f"/{'a' * 300}/x.xml"])
def test_an_unreadable_town_is_one_line(town: str) -> None:
    with pytest.raises(UnknownNameError, match=r"\(cannot look there: (Could not determine home|File name too long)"):
        AssetLibrary.for_town(town)


@pytest.mark.parametrize(
    ("custom", "told"),
    [
        ("", "actor.kind must be one of car,"),
        ('<text name="actor.kind" data="tank"/>', "got 'tank'"),
        ('<text name="actor.kind" data="person"/><text name="actor.pose" data="sit"/>', "actor.pose must be walk"),
        ('<text name="actor.kind" data="car"/><numeric name="paint.palette" data="1 1 1"/>', "groups of four"),
        ('<text name="actor.kind" data="car"/><numeric name="paint.palette" data="1 1 x 1"/>', "must be numbers"),
        ('<text name="actor.kind" data="car"/><numeric name="actor.weight" data="-1"/>', "not negative, got '-1'"),
        ('<text name="actor.kind" data="car"/><numeric name="actor.weight" data="nan"/>', "not negative, got 'nan'"),
        ('<text name="actor.kind" data="car"/><numeric name="paint.palette" data="nan 0 0 1"/>', "none negative"),
        ('<text name="actor.kind" data="car"/><numeric name="paint.palette" data="0 0 0 inf"/>', "none negative"),
        ('<text name="actor.kind" data="car"/><numeric name="paint.palette" data="255 0 0 1"/>', "albedo, 0 to 1"),
        ('<text name="actor.kind" data="car"/><numeric name="actor.weight" data="1e308"/>', r"one number up to 1e\+06"),
        ('<text name="actor.kind" data="car"/><numeric name="paint.palette" data="0 0 0 1e308"/>', r"above 1e\+06"),
        ("<text", "cannot be read as MJCF"),
    ],
)
def test_actors_that_break_the_rules_are_refused(tmp_path: Path, custom: str, told: str) -> None:
    with pytest.raises(TownError, match=told):
        read_actor_facts(actor(tmp_path, custom))


def test_facts_may_stand_in_several_sections_and_in_files_that_are_included(tmp_path: Path) -> None:
    """As MuJoCo reads them: a palette that several cars share is one file."""
    (tmp_path / "shared").mkdir()
    for name, text in (
        (
            "shared/car",
            '<include file="rare.xml"/><custom><numeric name="paint.palette" data="0.6 0.5 0.4 3"/></custom>',
        ),
        ("shared/rare", '<custom><numeric name="actor.weight" data="0.5"/></custom>'),
    ):
        (tmp_path / f"{name}.xml").write_text(f"<mujoco>{text}</mujoco>")
    kind = '<text name="actor.kind" data="car"/></custom><custom><text name="author" data="me"/>'
    path = actor(tmp_path, f"{kind}</custom><include file='shared/car.xml'/><custom>")
    facts = read_actor_facts(path)
    assert (facts.kind, facts.weight, facts.palette) == ("car", 0.5, (((0.6, 0.5, 0.4), 3.0),))
    (tmp_path / "shared/rare.xml").unlink()
    with pytest.raises(TownError, match=r"rare.xml: cannot be read as MJCF: .*No such file"):
        read_actor_facts(path)


def test_a_person_does_not_park_among_vehicles(tmp_path: Path) -> None:
    (tmp_path / "towns").mkdir()
    (tmp_path / "vehicles").mkdir()
    (tmp_path / "towns" / "t.xml").write_text("<mujoco/>")
    actor(tmp_path / "vehicles", '<text name="actor.kind" data="person"/>')
    with pytest.raises(TownError, match="a person does not belong into vehicles"):
        _ = AssetLibrary.for_town(tmp_path / "towns" / "t.xml").vehicles


def test_a_folder_of_ones_own_must_hold_the_ego_car(tmp_path: Path) -> None:
    (tmp_path / "towns").mkdir()
    (tmp_path / "vehicles").mkdir()
    (tmp_path / "towns" / "t.xml").write_text("<mujoco/>")
    actor(tmp_path / "vehicles", '<text name="actor.kind" data="car"/>')
    with pytest.raises(UnknownNameError, match=r"no vehicle named 'car_saloon'.*thing.*takes the place of gear"):
        read_scene_assets(AssetLibrary.for_town(tmp_path / "towns" / "t.xml"), SceneSpec())


def test_a_vehicle_is_not_named_like_a_pedestrian(tmp_path: Path) -> None:
    """Records name assets, and a person would drive as one of them."""
    shutil.copytree(TINY_TOWN.parents[1], tmp_path, dirs_exist_ok=True)
    shutil.copy(tmp_path / "vehicles" / "van_small.xml", tmp_path / "vehicles" / "adult_walk.xml")
    with pytest.raises(TownError, match=r"vehicles/adult_walk.xml: has the name of .*pedestrians/adult_walk.xml"):
        read_scene_assets(AssetLibrary.for_town(tmp_path / "towns" / "tiny.xml"), SceneSpec())


def test_a_vehicle_is_not_named_like_the_boards(tmp_path: Path) -> None:
    shutil.copytree(TINY_TOWN.parents[1], tmp_path, dirs_exist_ok=True)
    (tmp_path / "vehicles" / "van_small.xml").rename(tmp_path / "vehicles" / "board.xml")
    town, scene = tmp_path / "towns" / "tiny.xml", tiny_scenes().scenes["board"]
    with pytest.raises(TownError, match=r"vehicles/board.xml: is called 'board', so its instances"):
        World.build(town=town, scene_name="board", scene=scene, weather=CLEAR)


@pytest.mark.parametrize("name", ["kübelwagen", "two words", "a&b"])
def test_an_asset_may_have_any_letters_in_its_name(tmp_path: Path, name: str) -> None:
    shutil.copytree(TINY_TOWN.parents[1], tmp_path, dirs_exist_ok=True)
    (tmp_path / "vehicles" / "van_small.xml").rename(tmp_path / "vehicles" / f"{name}.xml")
    town, scene = tmp_path / "towns" / "tiny.xml", tiny_scenes().scenes["board"]
    assert name in World.build(town=town, scene_name="board", scene=scene, weather=CLEAR).types


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('xyaxes="0 1 0 0 0 -1"', 'xyaxes="-1 0 0 0 0 -1"', "must be flat"),
        ('pos="0 0 2.6" xyaxes', 'pos="0 0 2" xyaxes', "in its middle"),
        ('name="surface"', 'name="front"', "a site `surface`"),
        ('class="billboard.face" type', 'class="billboard.back" type', "has 0"),
        ('name="back" class="billboard.back"', 'name="back" class="billboard.face"', "has 2"),
        ('<body name="billboard">', '<body name="billboard" euler="0 0 90">', r"along its \+x axis"),
        (' texcoord="0 0 1 0 1 1 0\n    1"', "", "no texture coordinates"),
        ('texcoord="0 0 1 0 1 1 0\n    1"', 'texcoord="1 0 0 0 0 1 1 1"', "u from left to right"),
        ('texcoord="0 0 1 0 1 1 0\n    1"', 'texcoord="0 1 1 1 1 0 0 0"', "u from left to right"),
        ('texcoord="0 0 1 0 1 1 0\n    1"', 'texcoord="0 0 .5 0 .5 1 0 1"', "once and whole"),
        ('face="0 2 1 0 3 2"', 'face="0 1 2 0 2 3"', "face the other way"),
        ('type="mesh" mesh="face"', 'type="plane" size="3.7 1.85 1" pos="0 0 2.6"', "a plane, which has no finite"),
        ('type="mesh" mesh="face"', 'type="ellipsoid" size="0.001 3.7 1.85" pos="0 0 2.6"', "a mesh or a box"),
        ('type="mesh" mesh="face"', 'type="box" size="1e-3 1e-6 1e-6" pos="0 0 2.6"', "face is 2e-06 m x 2e-06 m"),
        ('type="mesh" mesh="face"', 'type="box" size="1e-3 370 185" pos="0 0 2.6"', "740 m x 370 m, and its sides"),
    ],
)
def test_a_board_must_keep_the_conventions(tmp_path: Path, old: str, new: str, told: str) -> None:
    for folder in ("vehicles", "pedestrians"):
        (tmp_path / folder).symlink_to(TINY_TOWN.parents[1] / folder)
    text = (TINY_TOWN.parents[1] / "surfaces" / "billboard.xml").read_text()
    assert old in text
    for folder, name, content in (
        ("surfaces", "billboard.xml", text.replace(old, new)),
        ("towns", "tiny.xml", TINY_TOWN.read_text()),
    ):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / name).write_text(content)
    town = tmp_path / "towns" / "tiny.xml"
    with pytest.raises(TownError, match=told):
        World.build(town=town, scene_name="board", scene=tiny_scenes().scenes["board"], weather=CLEAR)


BLOCK = '<mesh name="block" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/>'


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            '<geom name="shell" class="collision"',
            '<geom name="shell" class="car.glass"',
            "car_saloon.xml: has no geom of class collision",
        ),
        (
            '<geom name="shell" class="collision"',
            '<geom name="shell" class="collision" type="mesh" mesh="block"',
            "car_saloon.xml: collision geom 'car_saloon_0_shell' must be a primitive",
        ),
        ('class="car.glass" material="glass"', 'class="car.glass" type="plane"', "'car_saloon_0_cabin' is a plane"),
        ('size="2.25 0.9 0.35"', 'size="225 90 0.35"', "car_saloon.xml: its longest side is 450 m; MJCF is in metres"),
    ],
)
def test_a_vehicle_must_keep_the_conventions(tmp_path: Path, old: str, new: str, told: str) -> None:
    own = TINY_TOWN.parents[1]
    for folder in ("pedestrians", "surfaces"):
        (tmp_path / folder).symlink_to(own / folder)
    for folder in ("vehicles", "towns"):
        (tmp_path / folder).mkdir()
    for path in (own / "vehicles").glob("*.xml"):
        text = path.read_text()
        if path.stem == "car_saloon":
            assert old in text
            text = text.replace(old, new).replace("<asset>", f"<asset>{BLOCK}")
        (tmp_path / "vehicles" / path.name).write_text(text)
    town = tmp_path / "towns" / "tiny.xml"
    town.write_text(TINY_TOWN.read_text())
    with pytest.raises(TownError, match=told):
        World.build(town=town, scene_name="board", scene=tiny_scenes().scenes["board"], weather=CLEAR)


@pytest.mark.parametrize("settled_ns", [0, 1 << 62])
def test_every_change_of_a_file_is_noticed(settled_ns: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Hashes of files that have not changed are remembered; size and time of change may stay as they are."""
    monkeypatch.setattr(asset_hash, "_SETTLED_NS", settled_ns)
    shutil.copytree(TINY_TOWN.parents[1], tmp_path / "mjcf")
    library = AssetLibrary(tmp_path / "mjcf/towns/tiny.xml")
    person = tmp_path / "mjcf/pedestrians/adult_stand.xml"
    times = person.stat()
    digests = {assets_digest(library)}
    for position in ("0.12 0 1.67", "0.12 0 1.68"):
        digests.add(key_points_digest(library))
        time.sleep(0.02)  # a tick of the clock
        person.write_text(person.read_text().replace("0.12 0 1.66", position).replace("0.12 0 1.67", position))
        os.utime(person, ns=(times.st_atime_ns, times.st_mtime_ns))
        digests.add(key_points_digest(library))
    assert len(digests) == 4
    assert bool(settled_ns) != any(path.is_relative_to(tmp_path) for path in asset_hash._HASHES)
