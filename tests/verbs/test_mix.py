"""How often kinds of vehicles come: in the pictures, in what a dataset says of itself, and where it cannot be."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import gear
from gear.collecting.lookup import look_up
from gear.collecting.run import CollectReport
from gear.config.load import load_collection
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import ConfigError

Collect = Callable[..., CollectReport]


def test_a_mix_is_in_the_content_where_there_is_one_and_in_the_pictures(tmp_path: Path, collect_small: Collect) -> None:
    """Datasets from before there were mixes go on."""
    crowd, mix = ["crowd=3"], ["mix.car=0", "mix.van=20"]
    for name, settings in (("usual", crowd), ("mixed", crowd + mix)):
        collect_small("depth", tmp_path / name, settings=settings, samples=4)
    usual, mixed = (gear.open_dataset(tmp_path / name) for name in ("usual", "mixed"))
    assert "mix" not in usual.plan.content["scene"]["npc_vehicles"]
    assert mixed.plan.content["scene"]["npc_vehicles"]["mix"] == {"car": 0.0, "van": 20.0}
    kinds = [
        {
            actor.asset.partition("_")[0]
            for sample in dataset
            for actor in sample.record.actors
            if actor.role in ("npc", "parked")
        }
        for dataset in (usual, mixed)
    ]
    assert "car" in kinds[0] and "car" not in kinds[1] and "van" in kinds[1]


@pytest.mark.parametrize(
    ("own", "ours", "told"),
    [
        ("{van: 500}", "{van: 20}", r"c.yml:5:12: mix\.van: must be 0 to 1000, got 10000 \(with the scene's own mix\)"),
        (
            "{car: 0, van: 0, truck: 0}",
            "{bus: 0, motorcycle: 0, bicycle: 0}",
            r"c.yml:5:6: mix: leaves no vehicle; .* \(with the scene's own mix\)",
        ),
    ],
)
def test_a_mix_that_the_scenes_own_makes_impossible_is_one_line(tmp_path: Path, own: str, ours: str, told: str) -> None:
    scenes, config = tmp_path / "scenes.yml", tmp_path / "c.yml"
    scenes.write_text(TINY_SCENES.read_text().replace("npc_vehicles: {", f"npc_vehicles: {{mix: {own}, ", 1))
    config.write_text(f"task: depth\ntown: {TINY_TOWN}\nscene: board\nscenes: {scenes}\nmix: {ours}\n")
    with pytest.raises(ConfigError, match=told):
        look_up(load_collection(str(config), {}))
