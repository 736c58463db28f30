"""Wear of roads: it keeps to the asphalt, under the paint, in sheets that do not meet, the same for the same seed."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt
import pytest
from shapely import contains_xy  # type: ignore[import-untyped]

from authoring.kit.parts import Part, Sink
from authoring.materials import MATERIALS, ground
from authoring.towns.chunks import chunked
from authoring.towns.markings import LIFT_M
from authoring.towns.network import Network, Node, Profile, Street
from authoring.towns.regions import Regions, canal_polygon
from authoring.towns.wear import LANE_LIFT_M, PATCH_LIFT_M, SEAL_LIFT_M, of_street, wear_streets
from gear.world.weather.wet_ground import WET_LABELS

Array = npt.NDArray[np.float64]
TOWNS = Path(__file__).parents[2] / "mjcf" / "towns"
NODES = (
    Node(name="a", position=(0.0, 0.0)),
    Node(name="b", position=(160.0, 0.0)),
    Node(name="c", position=(160.0, 150.0)),
)
STREETS = (
    Street(name="wide", start="a", end="b", profile=Profile(forward=2, backward=2, median_m=2.0)),
    Street(name="hump", start="b", end="c", hump_m=1.1),
    Street(name="bend", start="c", end="a", corners=((0.0, 150.0, 40.0),)),
)
NETWORK = Network({node.name: node for node in NODES}, {street.name: street for street in STREETS})
REGIONS = Regions(NETWORK, canal_polygon([(-300, -300), (-290, -300)], 1.0))


def worn(seed: int) -> list[Part]:
    """The marks on all streets and junctions."""
    sink = Sink("static")
    wear_streets(sink, REGIONS, seed=seed)
    return sink.parts()


def of_material(parts: list[Part], *names: str) -> list[Part]:
    """The parts of some materials."""
    return [part for part in parts if part.material in names]


def test_every_kind_of_mark_is_there_and_is_road() -> None:
    kinds = {part.material for seed in range(3) for part in worn(seed)}
    assert kinds == {"asphalt_lane", "asphalt_lane_end", "asphalt_fresh", "asphalt_patch", "asphalt_seal"}
    assert {part.label for part in worn(0)} == {"road"}


@pytest.mark.parametrize("seed", range(4))
def test_marks_keep_to_the_carriageway(seed: int) -> None:
    asphalt = REGIONS.carriageways.buffer(0.05)
    for part in worn(seed):
        assert contains_xy(asphalt, part.mesh.vertices[:, :2]).all(), part.material


@pytest.mark.parametrize("seed", range(4))
def test_marks_face_up_and_lie_in_sheets_under_the_paint(seed: int) -> None:
    sheets = {"asphalt_lane": LANE_LIFT_M, "asphalt_lane_end": LANE_LIFT_M, "asphalt_seal": SEAL_LIFT_M}
    assert 0 < LANE_LIFT_M < PATCH_LIFT_M < SEAL_LIFT_M < LIFT_M
    for part in worn(seed):
        level = part.mesh.vertices[(part.mesh.vertices[:, 0] < 150) & (part.mesh.vertices[:, 1] < 140)]
        np.testing.assert_allclose(level[:, 2], sheets.get(part.material, PATCH_LIFT_M), atol=1e-9)
        a, b, c = (part.mesh.vertices[part.mesh.faces[:, corner]] for corner in range(3))
        assert (np.cross(b - a, c - a)[:, 2] > 0).all(), part.material


def test_lanes_lie_on_the_folds_of_a_bridge() -> None:
    street = NETWORK.streets["hump"]
    road = of_street(NETWORK, street)
    start, end = road.span
    line, stations = road.piece(start + 3.3, end - 7.7)
    low, high = NETWORK.ramp("hump")
    inside = stations[(stations > low) & (stations < high)]
    np.testing.assert_allclose(np.diff(np.concatenate([[low], inside, [high]])), (high - low) / (len(inside) + 1))
    assert np.ptp(NETWORK.height_m("hump", inside)) == pytest.approx(1.1, abs=0.02)
    assert not road.is_level(low, high) and road.is_level(start, low - 0.1)
    np.testing.assert_allclose(np.linalg.norm(np.diff(line, axis=0), axis=1), np.diff(stations), atol=1e-9)


def test_a_lane_has_its_middle_in_the_middle_of_the_texture_and_whole_tiles() -> None:
    lanes = of_material(worn(0), "asphalt_lane")
    u, v = np.concatenate([part.mesh.uvs for part in lanes]).T
    assert set(np.round(np.abs(u - 0.5) * 12, 6)) == {3.5}
    assert v.min() == 0 and v.max() == pytest.approx(round(float(v.max())))
    ends = of_material(worn(0), "asphalt_lane_end")
    v = np.concatenate([part.mesh.uvs for part in ends])[:, 1]
    assert v.min() == pytest.approx(0) and v.max() == pytest.approx(1)


def test_one_seed_is_one_town_and_another_another() -> None:
    first, again, other = (of_material(worn(seed), "asphalt_seal")[0].mesh.vertices for seed in (5, 5, 6))
    np.testing.assert_array_equal(first, again)
    assert first.shape != other.shape or not np.allclose(first, other)


def test_oil_and_tracks_fade_into_plain_asphalt() -> None:
    textures = ground.asphalt_lanes(rng=np.random.default_rng(0))
    plain = ground.asphalt(rng=np.random.default_rng(1))["asphalt"].astype(float).mean()
    lane, end = (textures[name].astype(float).mean(-1) for name in ("asphalt_lane", "asphalt_lane_end"))
    across_m = (np.arange(1024) + 0.5) / 1024 * 6 - 3
    profile = lane.mean(0)
    assert profile[np.abs(across_m) > 1.6].mean() == pytest.approx(plain, rel=0.01)
    assert profile[np.abs(across_m) < 0.2].mean() < 0.93 * plain
    assert profile[np.abs(np.abs(across_m) - 0.85) < 0.1].mean() > 1.02 * plain
    middle = end[:, np.abs(across_m) < 0.2].mean(1)
    # Row 0 is the top of the picture, v = 1, where nothing is left.
    assert middle[:100].mean() == pytest.approx(plain, rel=0.02) and middle[-100:].mean() < 0.93 * plain


@pytest.mark.parametrize("town", ["town10", "suburb", "harbour"])
def test_rain_does_not_wet_the_palette_of_plain_things(town: str) -> None:
    spec = mujoco.MjSpec.from_file(str(TOWNS / f"{town}.xml"))
    open_ground = {geom.material for geom in spec.geoms if geom.classname.name.partition(".")[0] in WET_LABELS}
    assert "asphalt_seal" in open_ground and "palette" not in open_ground
    assert open_ground & set(MATERIALS)


def test_parts_with_few_triangles_are_one_mesh() -> None:
    sink = Sink("static")
    for index in range(200):
        x = 40.0 * index - 4000
        sink.polygon("asphalt", [(x, 0, 0), (x + 1, 0, 0), (x + 1, 1, 0)], [(0, 0), (1, 0), (1, 1)], label="few")
        for _ in range(2):
            sink.polygon("asphalt", [(x, 0, 0), (x + 1, 0, 0), (x + 1, 1, 0)], [(0, 0), (1, 0), (1, 1)], label="many")
    chunks = list(chunked(sink.parts(), cell_m=110.0))
    assert [len(c.mesh.faces) for c in chunks if c.label == "few"] == [200]
    assert len([c for c in chunks if c.label == "many"]) > 1
    assert sum(len(c.mesh.faces) for c in chunks) == 600
