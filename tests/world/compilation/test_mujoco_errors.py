"""A file that cannot be used is named, with its own lines, in one line."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from gear.testing.tiny_town import CLEAR, DATA, tiny_scenes
from gear.values.errors import TownError
from gear.world.world import World

TOWN, BOARD, CAR = "towns/tiny.xml", "surfaces/billboard.xml", "vehicles/car_saloon.xml"
LAMP = '<geom name="lamp_post" class="pole"'
FACE = 'class="billboard.face" type="mesh"'
STEEL = '<material name="steel"'


def refusal(folder: Path, file: str, old: str, new: str) -> str:
    """What is said of the tiny town with a piece of one of its files replaced."""
    shutil.copytree(DATA / "mjcf", folder, dirs_exist_ok=True)
    path = folder / file
    text = path.read_text(encoding="utf-8")
    assert old in text, f"the tiny town has changed: no {old!r}"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(TownError) as caught:
        World.build(town=folder / TOWN, scene_name="board", scene=tiny_scenes().scenes["board"], weather=CLEAR)
    told = str(caught.value)
    assert "\n" not in told and told.startswith(f"{path}: "), told
    return told


def line_of(file: str, piece: str) -> int:
    text = (DATA / "mjcf" / file).read_text(encoding="utf-8")
    return text[: text.index(piece)].count("\n") + 1


@pytest.mark.parametrize(
    ("file", "old", "new", "told"),
    [
        (TOWN, LAMP, LAMP.replace("pole", "ploe"), "unknown default class name 'ploe' Element 'geom', line {}"),
        (TOWN, LAMP, LAMP.replace("lamp_post", "hedge"), "repeated name 'hedge' in geom Element 'geom', line {}"),
        (TOWN, LAMP, LAMP + ' size="0 1"/>' + LAMP.replace("post", "two"), "'lamp_post', id 15, line {}"),
        (TOWN, STEEL, STEEL.replace("steel", "paint"), "Line {}: error while parsing element <material>"),
        (
            TOWN,
            LAMP,
            "<frame/>" + LAMP,
            "Line {}: error while parsing element <frame>: 'frame' is not known here; write bodies",
        ),
        (TOWN, LAMP, "<house/>" + LAMP, "Line {}: error while parsing element <house>: 'house' is not known here (see"),
        (BOARD, FACE, FACE.replace("billboard", "bilboard"), "unknown default class name 'bilboard.face'"),
        (BOARD, FACE, 'class="billboard.face" type="box" size="0 0 0"', "Element name 'face', id 0, line {}"),
        (CAR, '<geom name="hull"', '<geom name="hull" mesh="no"', "mesh 'no' not found in geom 0"),
    ],
)
def test_a_file_that_mujoco_refuses_is_named_with_its_own_line(
    tmp_path: Path, file: str, old: str, new: str, told: str
) -> None:
    assert told.format(line_of(file, old)) in refusal(tmp_path, file, old, new)


def test_a_line_of_the_whole_is_nobodys(tmp_path: Path) -> None:
    """Alone the bench has the inertia of its geoms."""
    bench = '<body name="bench_0" pos="5 -6.1 0.15">'
    told = refusal(tmp_path, TOWN, bench, f"{bench}<freejoint/>")
    assert "Element name 'bench_0', id 3 (see" in told


def test_a_picture_that_is_none_is_named_as_the_file_names_it(tmp_path: Path) -> None:
    (tmp_path / "towns").mkdir()
    (tmp_path / "towns" / "t.png").write_bytes(b"no picture")
    texture = f'<texture name="t" type="2d" file="t.png"/>{STEEL} texture="t"'
    assert f"PNG file '{tmp_path / 'towns' / 't.png'}'" in refusal(tmp_path, TOWN, STEEL, texture)


@pytest.mark.parametrize("file", [TOWN, BOARD])
def test_files_that_include_each_other_are_told(tmp_path: Path, file: str) -> None:
    (tmp_path / file).parent.mkdir()
    (tmp_path / file).with_name("more.xml").write_text('<mujoco><include file="again.xml"/></mujoco>')
    (tmp_path / file).with_name("again.xml").write_text('<mujoco><include file="more.xml"/></mujoco>')
    told = refusal(tmp_path, file, "<worldbody>", '<include file="more.xml"/><worldbody>')
    assert "File 'more.xml' already included" in told


def test_a_broken_file_that_is_included_is_told_by_the_line_that_includes_it(tmp_path: Path) -> None:
    (tmp_path / "towns").mkdir()
    (tmp_path / "towns" / "more.xml").write_text("<mujoco>")
    told = refusal(tmp_path, TOWN, "<worldbody>", '<include file="more.xml"/><worldbody>')
    assert f"Element 'include', line {line_of(TOWN, '<worldbody>')}" in told


@pytest.mark.parametrize("file", [TOWN, BOARD, CAR])
@pytest.mark.parametrize(("encoding", "told"), [("klingon", "unknown encoding"), ("gb2312", "multi-byte encodings")])
def test_a_file_in_an_unknown_encoding_is_told(tmp_path: Path, file: str, encoding: str, told: str) -> None:
    assert told in refusal(tmp_path, file, "<mujoco", f'<?xml version="1.0" encoding="{encoding}"?><mujoco')


def test_a_face_of_a_material_that_is_not_there_is_told(tmp_path: Path) -> None:
    told = refusal(tmp_path, BOARD, 'mesh="face" material="face"', 'mesh="face" material="fce"')
    assert "face 'face' has the material 'fce', which is not there" in told


@pytest.mark.parametrize(
    ("file", "old", "new", "told"),
    [
        (TOWN, 'pos="-30 -6.2 3.15"', 'pos="nan -6.2 3.15"', "pos of geom 'lamp_post' is no number: 'nan -6.2 3.15'"),
        (TOWN, 'rgba="0.30 0.31 0.32 1"', 'rgba="0.3 0.3 NaN 1"', "rgba of material 'steel' is no number"),
        (TOWN, 'extent="100"', 'extent="-nan"', "extent of statistic '' is no number"),
        (BOARD, '<site name="surface" pos="0 0 2.6"', '<site name="surface" pos="0 0 nan"', "pos of site 'surface'"),
        (CAR, 'pos="-0.35 0 1.17"', 'pos="-0.35 nan 1.17"', "pos of geom 'cabin' is no number"),
    ],
)
def test_a_number_that_is_none_is_told(tmp_path: Path, file: str, old: str, new: str, told: str) -> None:
    """MuJoCo compiles it, and what has it is missing from the pictures."""
    assert told in refusal(tmp_path, file, old, new)


@pytest.mark.parametrize(
    ("file", "new", "told"),
    [
        (CAR, 'angle="radian"', "angle=radian eulerseq=xyz and the town by angle=degree eulerseq=xyz"),
        (CAR, 'angle="degree" eulerseq="ZYX"', "angle=degree eulerseq=ZYX and the town by angle=degree eulerseq=xyz"),
        (BOARD, 'eulerseq="zyx"', "angle=degree eulerseq=zyx and the town by angle=degree eulerseq=xyz"),
    ],
)
def test_angles_are_written_one_way_in_a_world(tmp_path: Path, file: str, new: str, told: str) -> None:
    """MuJoCo would read all of them as one file says, where the others say nothing."""
    assert f"turns geoms by {told}" in refusal(tmp_path, file, 'angle="degree"', new)


def test_two_files_of_one_name_in_a_world_are_told(tmp_path: Path) -> None:
    (tmp_path / "vehicles").mkdir()
    shutil.copy(DATA / "mjcf" / CAR, tmp_path / "vehicles" / "billboard.xml")
    told = refusal(tmp_path, "vehicles/billboard.xml", '"car_saloon"', '"billboard"')
    assert f"has the name of {tmp_path / BOARD}" in told
