"""`gear towns`: the list says what the files say, the map shows things where they are, thumbnails repeat."""

from __future__ import annotations

import dataclasses
import json
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import cv2
import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gear.cli.main import main
from gear.testing.tiny_town import CLEAR, DATA, TINY_SCENES, TINY_TOWN
from gear.values.errors import ConfigError, TownError, UnknownNameError
from gear.values.frames import UInt8Image
from gear.verbs.towns import ground_layer, scene_layer, town_map, traffic_layer
from gear.verbs.towns.canvas import Canvas, round_step_m
from gear.verbs.towns.facts import Town, read_town
from gear.verbs.towns.sheet import SheetOptions, draw_sheet
from gear.world.roads.lanes import LaneGraph
from gear.world.roads.regions import Region
from gear.world.scene_spec import BoardSpec

OPTIONS = SheetOptions(renderer="classic", quality="fast", weather=CLEAR, seed=3, width_px=160, height_px=80)


@pytest.fixture(scope="module")
def tiny() -> Town:
    return read_town(TINY_TOWN, TINY_SCENES)


@pytest.fixture(scope="module")
def tiny_map(tiny: Town) -> UInt8Image:
    return town_map.draw_map(tiny, ground_layer.TownGeometry.of(TINY_TOWN))


def only(town: Town, *names: str) -> Town:
    assert town.scenes is not None
    scenes = {name: town.scenes.scenes[name] for name in names}
    return dataclasses.replace(town, scenes=dataclasses.replace(town.scenes, scenes=scenes))


def edited_town(folder: Path, old: str, new: str) -> Path:
    shutil.copytree(DATA / "mjcf", folder / "mjcf")
    path = folder / "mjcf" / "towns" / "tiny.xml"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


def test_facts_are_those_of_the_file(tiny: Town) -> None:
    numerics = {
        n.get("name", ""): np.array(n.get("data", "").split(), float) for n in ET.parse(TINY_TOWN).iter("numeric")
    }
    lanes = {name: values[2:].reshape(-1, 3)[:, :2] for name, values in numerics.items() if name.startswith("lane.")}
    km = sum(float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()) for line in lanes.values()) / 1000
    assert (tiny.name, tiny.size_m, len(tiny.lanes.lanes)) == ("tiny", (160.0, 120.0), len(lanes))
    assert tiny.lane_km == pytest.approx(km)
    assert tiny.scenes is not None and list(tiny.scenes.scenes) == ["board", "double", "truck", "no_billboard"]


def test_lanes_read_alone_are_those_of_the_compiled_town(tiny: Town) -> None:
    compiled = LaneGraph.from_model(mujoco.MjModel.from_xml_path(str(TINY_TOWN)), TINY_TOWN)
    assert compiled.lanes.keys() == tiny.lanes.lanes.keys() and compiled.bays == tiny.lanes.bays
    for name, lane in compiled.lanes.items():
        other = tiny.lanes.lanes[name]
        assert (lane.next, lane.width_m, lane.speed_mps) == (other.next, other.width_m, other.speed_mps)
        assert np.array_equal(lane.line.points_m, other.line.points_m)


def test_town10_is_listed_with_its_scenes() -> None:
    town = read_town("town10")
    assert town.size_m == (440.0, 440.0)
    assert town.scenes is not None and {f"billboard0{n}" for n in range(1, 10)} < set(town.scenes.scenes)


def test_what_is_asked_for_wrongly_is_told(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="did you mean town10"):
        read_town("town1O")
    with pytest.raises(UnknownNameError, match=r"nowhere\.yml"):
        read_town(TINY_TOWN, tmp_path / "nowhere.yml")
    with pytest.raises(ConfigError, match="stand in tiny, not in town10"):
        read_town("town10", TINY_SCENES)
    with pytest.raises(TownError, match=r"town\.bounds must be"):
        read_town(edited_town(tmp_path, 'name="town.bounds"', 'name="town.bonds"'))
    (tmp_path / "no.xml").write_text("<mujoco><worldbody><", encoding="utf-8")
    with pytest.raises(TownError, match=r"no.xml: cannot be read as MJCF: unclosed token"):
        read_town(tmp_path / "no.xml")


@pytest.mark.parametrize(("file", "said"), [("tiny.xml", "tiny"), ("tiny", "tiny"), ("tiny.mjcf", "tiny.mjcf")])
def test_a_town_is_read_by_every_spelling_that_collections_take(
    file: str, said: str, tmp_path: Path, tiny: Town, tiny_map: UInt8Image
) -> None:
    path = edited_town(tmp_path, "</custom>", "</custom><include file='more.xml'/>")
    (path.parent / "more.xml").write_text("<mujoco><worldbody/></mujoco>", encoding="utf-8")
    path = path.rename(path.with_name(file))
    town = read_town(path.with_name(said), TINY_SCENES)
    assert town.library.town == path.resolve() and town.to_json() | {"path": ""} == tiny.to_json() | {"path": ""}
    assert np.array_equal(town_map.draw_map(town, ground_layer.TownGeometry.of(path)), tiny_map)


def test_an_unlabelled_geom_stops_the_map(tmp_path: Path) -> None:
    path = edited_town(tmp_path, '<geom name="lamp_post" class="pole"', '<geom name="lamp_post" class="seen"')
    with pytest.raises(TownError, match="geom 'lamp_post' can be seen but has class 'seen'"):
        ground_layer.TownGeometry.of(path)


def test_a_height_field_stops_the_map(tmp_path: Path) -> None:
    field = '<hfield name="h" nrow="4" ncol="4" size="9 9 1 1"/><material name="steel"'
    path = edited_town(tmp_path, '<material name="steel"', field)
    hill = '<geom name="hill" class="terrain" type="hfield" hfield="h"/><geom name="lamp_post"'
    path.write_text(path.read_text(encoding="utf-8").replace('<geom name="lamp_post"', hill), encoding="utf-8")
    with pytest.raises(TownError, match=f"{path.name}: geom 'hill' is a hfield, which has no finite surface; make it"):
        town_map.draw_map(read_town(path), ground_layer.TownGeometry.of(path))


def pixel(picture: UInt8Image, x_m: float, y_m: float) -> tuple[int, ...]:
    """Of the tiny town's map; its bounds are 160 m x 120 m about the origin."""
    scale = town_map.LONG_SIDE_PX / 160
    x, y = town_map.MARGIN_PX + (x_m + 80) * scale, town_map.MARGIN_PX + (60 - y_m) * scale
    return tuple(int(v) for v in picture[round(y), round(x)])


def test_the_map_shows_things_where_they_are(tiny_map: UInt8Image) -> None:
    terrain, _, road, parking, sidewalk, _ = (colour for _, _, colour in ground_layer.COVERS)
    assert pixel(tiny_map, -37, 25) == pixel(tiny_map, 3, -22) == ground_layer.BUILDING
    assert pixel(tiny_map, -37, -25) == pixel(tiny_map, 37, 55) == pixel(tiny_map, -60, 30) == terrain
    assert pixel(tiny_map, -70, 3) == pixel(tiny_map, 30, 50) == pixel(tiny_map, 30, -50) == road
    assert pixel(tiny_map, -15, 5.2) == parking
    assert pixel(tiny_map, -70, 8.5) == pixel(tiny_map, 77, -4) == sidewalk
    for lane in ((31.75, 30.0), (28.25, -30.0)):  # thin, so its edges are mixed with the road's grey
        red, _, blue = pixel(tiny_map, *lane)
        assert blue - red > 40
    assert min(pixel(tiny_map, 22, 0.57)) > max(pixel(tiny_map, 19, 0.57))


def test_what_closes_cracks_from_below_hides_nothing(tmp_path: Path, tiny_map: UInt8Image) -> None:
    """As wide as the town, it would be paved ground above the terrain; a square that is only low is none. Hills may
    reach further."""
    classes = '<default class="pole"/>'
    path = edited_town(tmp_path, classes, f'{classes}<default class="ground"/>')
    text, post = path.read_text(encoding="utf-8"), '<geom name="lamp_post"'
    under = '<geom name="under" class="ground" material="asphalt" size="90 70 0.1" pos="0 0 -9"/>'
    square = '<geom name="square" class="ground" material="asphalt" size="9 9 0.1" pos="-60 40 -0.5"/>'
    path.write_text(text.replace(post, under + post), encoding="utf-8")
    assert np.array_equal(town_map.draw_map(read_town(path, TINY_SCENES), ground_layer.TownGeometry.of(path)), tiny_map)
    path.write_text(text.replace(post, square + post), encoding="utf-8")
    paved = ground_layer.COVERS[1][2]
    assert pixel(town_map.draw_map(read_town(path), ground_layer.TownGeometry.of(path)), -60, 40) == paved


def test_the_map_shows_boards_and_limits(tiny: Town) -> None:
    geometry = ground_layer.TownGeometry.of(TINY_TOWN)
    with_board = town_map.draw_map(only(tiny, "board"), geometry)
    without = town_map.draw_map(only(tiny, "no_billboard"), geometry)
    colour = scene_layer.PALETTE[0]
    assert pixel(with_board, 55, -8.5) == colour
    inside, outside = (25.0, -10.0), (60.0, -10.0)
    assert pixel(with_board, *inside) != pixel(without, *inside)
    assert pixel(with_board, *outside) == pixel(without, *outside)
    wedge, behind = (45.0, -7.6), (60.0, -20.0)
    assert pixel(with_board, *wedge) != pixel(without, *wedge)
    assert pixel(with_board, *behind) == pixel(without, *behind)


@pytest.mark.parametrize("heading_deg", [0, 90, 180, 270])
def test_arrows_point_the_way(heading_deg: int) -> None:
    canvas = Canvas((60, 60), (255, 255, 255))
    traffic_layer.lane_arrow(canvas, np.array([30.0, 30.0]), np.radians(heading_deg), 40.0, (0, 0, 0))
    ink = 255 - canvas.picture()[..., 0].astype(float)
    turned = np.rot90(ink, -heading_deg // 90)  # now it should point to the right
    widths = (turned > 100).sum(axis=0)
    assert 0 < widths[45] < widths[30] < widths[21]


@given(
    facing_deg=st.floats(-180, 180), ahead=st.floats(-50, 50), lateral=st.floats(-50, 50),
    length=st.floats(1, 100), width=st.floats(1, 100), u=st.floats(-0.5, 1.5), v=st.floats(-0.5, 1.5),
)  # fmt: skip
def test_outlines_hold_what_regions_hold(
    facing_deg: float, ahead: float, lateral: float, length: float, width: float, u: float, v: float
) -> None:
    board = BoardSpec(position_m=(7.0, -3.0, 0.0), facing_deg=facing_deg)
    ahead_m, lateral_m = (ahead, ahead + length), (lateral, lateral + width)
    corners = scene_layer.board_rectangle_m(board, ahead_m, lateral_m)
    place = corners[0] + u * (corners[1] - corners[0]) + v * (corners[3] - corners[0])
    if min(abs(u), abs(1 - u), abs(v), abs(1 - v)) > 1e-6:
        region = Region(board=board, ahead_m=ahead_m, lateral_m=lateral_m)
        assert region.holds(place)[0] == (0 < u < 1 and 0 < v < 1)


@given(span=st.floats(0.5, 1e5), most=st.integers(1, 20))
def test_steps_are_round_and_few(span: float, most: int) -> None:
    step = round_step_m(span, most)
    assert span / step <= most * (1 + 1e-9)
    assert f"{step:.0e}"[0] in "125"
    assert span / step > most / 2.6 or most == 1


def test_dashes_cover_their_share() -> None:
    canvas = Canvas((400, 20), (255, 255, 255))
    canvas.dashes([[0, 10], [400, 10]], (0, 0, 0), 2.0, dash_px=12.0, gap_px=8.0)
    row = canvas.picture()[10, :, 0]
    assert (row < 128).mean() == pytest.approx(0.6, abs=0.1)
    assert 18 <= np.count_nonzero(np.diff((row < 128).astype(int)) == 1) <= 21


def test_thumbnails_repeat_and_follow_the_seed(tiny: Town) -> None:
    town = only(tiny, "board", "truck")
    first, problems = draw_sheet(town, OPTIONS)
    again, _ = draw_sheet(town, OPTIONS)
    other, _ = draw_sheet(town, dataclasses.replace(OPTIONS, seed=4))
    assert not problems
    assert np.array_equal(first, again)
    assert (first != other).any(axis=-1)[:90].mean() > 0.1
    assert first[20:80, 20:160].std() > 10


def test_a_scene_without_a_place_is_told_and_the_others_are_drawn(tiny: Town) -> None:
    town = only(tiny, "board", "truck")
    assert town.scenes is not None
    board = town.scenes.scenes["board"]
    turned = dataclasses.replace(board, boards=(dataclasses.replace(board.boards[0], facing_deg=90.0),))
    scenes = dataclasses.replace(town.scenes, scenes={"board": turned, "truck": town.scenes.scenes["truck"]})
    seen: list[tuple[int, int]] = []
    sheet, problems = draw_sheet(
        dataclasses.replace(town, scenes=scenes), OPTIONS, lambda done, total: seen.append((done, total))
    )
    assert [problem.scene for problem in problems] == ["board"]
    assert sheet[20:80, 200:320].std() > 10
    assert seen == [(0, 2), (1, 2), (2, 2)]


def test_the_command_lists(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["towns"]) == 0
    listed = capsys.readouterr().out
    assert "town10: 440 m x 440 m" in listed and "billboard09" in listed and "truck_box" in listed
    assert main(["towns", str(TINY_TOWN), "--scenes", str(TINY_SCENES), "--json"]) == 0
    (town,) = json.loads(capsys.readouterr().out)["towns"]
    assert (town["name"], town["lanes"], town["bounds_m"]) == ("tiny", 13, [-80, -60, 80, 60])
    assert town["scenes"]["double"]["boards"][1]["position_m"] == [55.0, 13.0, 0.0]
    assert main(["towns", str(TINY_TOWN)]) == 0
    assert "no scenes" in capsys.readouterr().out


def test_the_command_draws(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenes = tmp_path / "one.yml"
    scenes.write_text("town: tiny\nscenes:\n  plain: {npc_vehicles: {count: [0, 0]}, pedestrians: {count: [0, 0]}}\n")
    assert main(["towns", str(TINY_TOWN), "--scenes", str(scenes), "--out", str(tmp_path / "out")]) == 0
    assert "tiny with 1 scene" in capsys.readouterr().out
    for name in ("tiny_map.png", "tiny_scenes.png"):
        assert cv2.imread(str(tmp_path / "out" / name)) is not None
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["tiny_map.png", "tiny_scenes.png"]


def test_faulty_scenes_do_not_stop_the_others(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One that cannot be read, one whose board is not there, and one whose board cannot be compiled."""
    shutil.copytree(TINY_TOWN.parents[1], tmp_path / "mjcf")
    town, scenes = tmp_path / "mjcf" / "towns" / "tiny.xml", tmp_path / "my.yml"
    (tmp_path / "mjcf" / "surfaces" / "broken.xml").write_text("<mujoco><worldbody/></mujoco>")
    nobody = "npc_vehicles: {count: [0, 0]}, pedestrians: {count: [0, 0]}"
    board = "ego: {ahead_m: [12, 45], lateral_m: [-12, 12]}, boards: [{position_m: [55, -8.5, 0], facing_deg: 175"
    scenes.write_text(
        "town: tiny\nscenes:\n"
        f"  plain: {{{nobody}}}\n"
        f"  unread: {{{nobody}, trucks: 1}}\n"
        f"  absent: {{{nobody}, {board}, asset: nowhere}}]}}\n"
        f"  broken: {{{nobody}, {board}, asset: broken}}]}}\n"
    )
    words = ["towns", str(town), "--scenes", str(scenes)]
    assert main(words) == 2
    shown = capsys.readouterr()
    assert "plain" in shown.out and "broken" in shown.out
    errors = shown.err.splitlines()
    assert len(errors) == 2 and "scenes.unread.trucks: unknown key" in errors[0] and "nowhere" in errors[1]
    assert main([*words, "--json"]) == 2
    (listed,) = json.loads(capsys.readouterr().out)["towns"]
    assert sorted(listed["faulty_scenes"]) == ["absent", "unread"]
    assert main([*words, "--out", str(tmp_path / "out")]) == 2
    shown = capsys.readouterr()
    assert "tiny with 1 scene" in shown.out
    assert len(shown.err.splitlines()) == 3 and "has no geom of a class ending in `.face`" in shown.err
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"tiny_map.png", "tiny_scenes.png"}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["tow10"], "did you mean town10?"),
        (["--out", "maps"], "needs a town"),
        (["town10", "--out", "maps", "--renderer", "clasic"], "did you mean classic?"),
        (["town10", "--out", "maps", "--weather", "ClearNon"], "did you mean ClearNoon?"),
        (["town10", "--out", "maps", "--quality", "best"], "no quality named"),
        (["town10", "--out", "maps", "--seed", "-1"], "must not be negative"),
        (["town10", "--renderer", "clasic"], "did you mean classic?"),
        (["--weather", "ClearNon"], "did you mean ClearNoon?"),
        (["town10", "--out", "/dev/null/maps"], "a file is where a folder should be; choose another --out"),
    ],
)
def test_the_command_tells_in_one_line(words: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["towns", *words]) == 2
    error = capsys.readouterr().err
    assert told in error and error.count("\n") == 1 and error.startswith("gear: ")
