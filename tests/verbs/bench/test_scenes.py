"""The scenes of a bench."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from gear.config.nodes import parse_text
from gear.config.reader import read_node
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import ConfigError
from gear.verbs.bench.config import BenchConfig
from gear.verbs.bench.scenes import Scene, calibration_scene, measured_scenes


def scenes_of(names: Sequence[str], calibration: str = "") -> tuple[tuple[Scene, ...], Scene | None]:
    listed = ", ".join(f"'{TINY_SCENES}:{name}'" for name in names)
    text = f"tasks: {{semseg: {{models: {{ddrnet23_slim: {{}}}}}}}}\nplaces: {{'{TINY_TOWN}': [{listed}]}}\n"
    if calibration:
        text += f"calibration: {{town: '{TINY_TOWN}', scene: '{TINY_SCENES}:{calibration}'}}\n"
    node = parse_text(text, "b.yml")
    config = read_node(BenchConfig, node)
    found = measured_scenes(config, node)
    return found, calibration_scene(config, node, found)


def test_scenes_have_labels_and_surfaces() -> None:
    found, calibration = scenes_of(["board", "double"], "truck")
    assert [(one.label, one.surfaces) for one in found] == [("tiny-board", 1), ("tiny-double", 2)]
    assert calibration is not None
    assert calibration.label == "tiny-truck"
    assert scenes_of(["board"])[1] is None


@pytest.mark.parametrize(
    ("names", "calibration", "message"),
    [
        (["board", "board"], "", "is named twice"),
        (["bord"], "", "named 'bord'; did you mean board"),
        (["no_billboard"], "", "has neither a board nor the truck"),
        (["board"], "board", "is also a measured scene"),
    ],
)
def test_mistakes_have_their_place_in_the_file(names: list[str], calibration: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message) as caught:
        scenes_of(names, calibration)
    assert "b.yml:" in str(caught.value)
