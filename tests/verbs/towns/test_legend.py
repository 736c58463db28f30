"""The panel of a map has room for its scenes, and a line says what is in each."""

from __future__ import annotations

from itertools import pairwise

from gear.verbs.towns.facts import Town
from gear.verbs.towns.legend import legend_height_px, scene_note


def test_a_line_says_what_is_in_a_scene(tiny: Town) -> None:
    assert tiny.scenes is not None
    notes = {name: scene_note(scene) for name, scene in tiny.scenes.scenes.items()}
    assert notes["board"] == "1 board; 2-4 vehicles, 2-6 people"
    assert notes["double"].startswith("2 boards; ")
    assert notes["truck"] == (
        "truck_box in the ego car's lane, 3-20 m ahead, on any road; 1-3 vehicles within 60 m, 1-4 people within 60 m"
    )
    assert notes["no_billboard"].startswith("no board; the ego car on any road; ")


def test_the_panel_grows_with_the_scenes() -> None:
    heights = [legend_height_px(scenes) for scenes in range(4)]
    assert len({high - low for low, high in pairwise(heights)}) == 1
    assert heights[1] > heights[0]
