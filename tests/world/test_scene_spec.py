from __future__ import annotations

from pathlib import Path

import pytest

from gear.config.nodes import parse_file
from gear.config.reader import read_node
from gear.testing.tiny_town import tiny_scenes
from gear.values.errors import ConfigError, FieldError
from gear.values.labels import VEHICLES
from gear.values.serial import from_json, to_json
from gear.world.scene_spec import BoardSpec, EgoLimits, NpcLimits, SceneLibrary, SceneSpec, TruckSpec, VehicleLimits


def test_the_library_reads_from_yaml_and_survives_json() -> None:
    library = tiny_scenes()
    assert list(library.scenes) == ["board", "double", "truck", "no_billboard"]
    assert library.scenes["board"].boards[0].facing_deg == 175.0
    assert library.scenes["truck"].truck == TruckSpec(asset="truck_box", gap_m=(3.0, 20.0))
    assert from_json(SceneLibrary, to_json(library)) == library


def test_errors_have_a_place(tmp_path: Path) -> None:
    file = tmp_path / "scenes.yml"
    file.write_text("town: t\nscenes:\n  a:\n    npc_vehicles: {count: [5, 2]}\n")
    with pytest.raises(ConfigError, match=r"scenes.yml:4:.*count.*the smaller first"):
        read_node(SceneLibrary, parse_file(file))


BOARD = BoardSpec(position_m=(0.0, 0.0, 0.0), facing_deg=0.0)
EGO = EgoLimits(ahead_m=(5.0, 10.0), lateral_m=(-1.0, 1.0))


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: SceneSpec(boards=(BOARD,)), "ego"),
        (lambda: SceneSpec(ego=EGO), "ego"),
        (
            lambda: SceneSpec(boards=(BOARD, BoardSpec(position_m=(0.0, 0.01, 0.0), facing_deg=359.0)), ego=EGO),
            "boards",
        ),
        (lambda: SceneSpec(boards=(BOARD,), ego=EGO, truck=TruckSpec()), "truck"),
        (lambda: SceneSpec(npc_vehicles=VehicleLimits(count=(1, 2), ahead_m=(0.0, 1.0))), "npc_vehicles"),
        (lambda: EgoLimits(ahead_m=(9.0, 5.0), lateral_m=(0.0, 1.0)), "ahead_m"),
        (lambda: EgoLimits(ahead_m=(-3.0, 5.0), lateral_m=(0.0, 1.0)), "ahead_m"),
        (lambda: NpcLimits(count=(-1, 2)), "count"),
        (lambda: TruckSpec(gap_m=(0.0, 2.0)), "gap_m"),
        (lambda: VehicleLimits(count=(0, 1), parked_share=1.5), "parked_share"),
        (lambda: BoardSpec(position_m=(0.0, 0.0, 0.0), facing_deg=1000.0), "facing_deg"),
        (lambda: BoardSpec(position_m=(0.0, -2e4, 0.0), facing_deg=0.0), "position_m"),
    ],
)
def test_nonsense_is_refused(make: object, field: str) -> None:
    with pytest.raises(FieldError) as caught:
        make()  # type: ignore[operator]
    assert caught.value.field == field


def test_boards_may_stand_back_to_back() -> None:
    behind = BoardSpec(position_m=(-0.3, 0.0, 0.0), facing_deg=180.0)
    assert SceneSpec(boards=(BOARD, behind), ego=EGO).boards == (BOARD, behind)


def test_caps_lower_both_ends() -> None:
    capped = SceneSpec(npc_vehicles=VehicleLimits(count=(3, 7)), pedestrians=NpcLimits(count=(6, 20))).capped(2, 10)
    assert capped.npc_vehicles.count == (2, 2)
    assert capped.pedestrians.count == (6, 10)


def test_a_mix_goes_on_top_of_the_scenes_own() -> None:
    scene = SceneSpec(
        npc_vehicles=VehicleLimits(count=(3, 7), mix={"bus": 2.0, "car": 0.5}), pedestrians=NpcLimits(count=(0, 0))
    )
    assert scene.mixed({}) is scene
    assert scene.mixed({"bus": 3.0, "van": 2.0}).npc_vehicles.mix == {"car": 0.5, "van": 2.0, "bus": 6.0}
    for mix, told in (
        ({"tram": 1.0}, r"mix\.tram: is no kind of vehicle; there are car, van"),
        ({"person": 1.0}, r"mix\.person: is no kind"),
        ({"bus": -1.0}, r"mix\.bus: must be 0 to 1000"),
        ({"bus": 1e4}, r"mix\.bus: must be 0 to 1000"),
        (dict.fromkeys(VEHICLES, 0.0), r"mix: leaves no vehicle"),
    ):
        with pytest.raises(FieldError, match=told):
            VehicleLimits(count=(3, 7), mix=mix)


def test_a_crowd_multiplies_both_ends_up_to_the_most_there_may_be() -> None:
    scene = SceneSpec(npc_vehicles=VehicleLimits(count=(3, 7)), pedestrians=NpcLimits(count=(6, 200)))
    crowded = scene.crowded(2.5)
    assert crowded.npc_vehicles == VehicleLimits(count=(8, 18))
    assert crowded.pedestrians.count == (15, 500)
    assert scene.crowded(10).pedestrians.count == (60, 1000)
    assert scene.crowded(0).npc_vehicles.count == (0, 0)
    assert scene.crowded(1.0) is scene
    third = SceneSpec().crowded(0.333)
    assert (third.npc_vehicles.count, third.pedestrians.count) == ((3, 7), (6, 20)), "three digits are enough"
