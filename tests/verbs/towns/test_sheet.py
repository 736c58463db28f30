"""Thumbnails repeat, and follow their seed."""

from __future__ import annotations

import dataclasses

import numpy as np

from gear.testing.tiny_town import CLEAR
from gear.verbs.towns.facts import Town
from gear.verbs.towns.sheet import SheetOptions, draw_sheet

from .conftest import only

OPTIONS = SheetOptions(renderer="classic", quality="fast", weather=CLEAR, seed=3, width_px=160, height_px=80)


def test_thumbnails_repeat_and_follow_the_seed(tiny: Town) -> None:
    town = only(tiny, "board", "truck")
    first, problems = draw_sheet(town, OPTIONS)
    again, _ = draw_sheet(town, OPTIONS)
    other, _ = draw_sheet(town, dataclasses.replace(OPTIONS, seed=4))
    assert not problems
    assert np.array_equal(first, again)
    assert (first != other).any(axis=-1)[:90].mean() > 0.1
    assert first[20:80, 20:160].std() > 10


def test_a_scene_without_a_place_is_reported_and_the_others_are_drawn(tiny: Town) -> None:
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
