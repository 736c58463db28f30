from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gear.contracts.controllers import Action
from gear.driving.crash import Crash
from gear.driving.drawing import GREEN, LINE_PX, RED, _notes, drawn, drawn_end, outcome, padded
from gear.driving.scenario import Scenario
from gear.driving.simulation import DriveSimulation, Situation
from gear.driving.start import Draw
from gear.formats.coco import Detection
from gear.testing.tiny_town import tiny_world

PICTURE = np.full((96, 700, 3), 90, np.uint8)
CALM = Action(acceleration_mps2=0.5, steering_rad=0.0, notes={"gap_m": 12.0, "is_emergency": 0.0})
HARD = Action(acceleration_mps2=-8.0, steering_rad=0.0, notes={"is_emergency": 1.0})
CRASH = Crash(time_s=3.4, actor_id=2, kind="person", impact_mps=5.0)


@pytest.fixture(scope="module")
def situation() -> Situation:
    world = tiny_world()
    return DriveSimulation(world, world.scene).reset(Draw(name="free_road", scenario=Scenario(), speed_mps=8.0, seed=0))


def has(frame: np.ndarray, colour: tuple[int, int, int]) -> bool:
    return bool((frame == np.array(colour, np.uint8)).all(axis=2).any())


@pytest.mark.parametrize(
    ("seen", "is_dense"),
    [
        (None, False),
        (np.full((96, 700), 20.0, np.float32), True),
        (np.full((96, 700), 7, np.uint8), True),
        ((Detection(category_id=3, box_px=(10.0, 20.0, 60.0, 80.0), score=0.9),), False),
        ((Detection(category_id=3, box_px=(-1e300, 20.0, 1e300, float("inf")), score=0.9),), False),
    ],
)
def test_a_frame_shows_what_the_network_saw(situation: Situation, seen: Any, is_dense: bool) -> None:
    frame = drawn("title", situation, PICTURE, seen, CALM)
    assert frame.dtype == np.uint8 and frame.shape[1] == 700 and not any(side % 2 for side in frame.shape[:2])
    assert frame.shape[0] == 3 * LINE_PX + 96 + is_dense * (96 + LINE_PX)
    is_finite_box = isinstance(seen, tuple) and np.isfinite(seen[0].box_px).all()
    assert has(frame, RED) == is_finite_box
    assert (PICTURE == 90).all(), "the picture itself is not drawn on"


def test_small_pictures_are_enlarged_with_their_boxes(situation: Situation) -> None:
    small = np.full((40, 160, 3), 90, np.uint8)
    box = Detection(category_id=3, box_px=(80.0, 20.0, 120.0, 30.0), score=0.9)
    frame = drawn("title", situation, small, (box,), CALM)
    assert frame.shape == (3 * LINE_PX + 160, 640, 3)
    rows, columns = np.nonzero((frame == np.array(RED, np.uint8)).all(axis=2))
    assert abs(int(columns.min()) - 320) < 3 and abs(int(rows.max()) - 3 * LINE_PX - 120) < 3


def test_an_emergency_is_red_and_notes_have_units(situation: Situation) -> None:
    assert drawn("", situation, PICTURE, None, HARD)[LINE_PX + 1, -1].tolist() == list(RED)
    assert drawn("", situation, PICTURE, None, CALM)[LINE_PX + 1, -1].tolist() == [0, 0, 0]
    assert _notes(replace(CALM, notes={"gap_m": 12.0, "leader_mps": 3.0})) == "controller: gap 12.0 m   leader 3.0 m/s"
    assert _notes(HARD) == "controller: no obstacle"


@pytest.mark.parametrize(
    ("end", "words", "colour"),
    [
        ({"ending": "crash", "crash": CRASH}, "CRASH with a person: impact 18 km/h", RED),
        ({"ending": "stood"}, "no crash: the car stands", GREEN),
        ({"ending": "off_road"}, "left the road", RED),
        ({"ending": "passed", "ran_red_light": True}, "ran the red light", RED),
        ({"ending": "ran_out"}, "ran out", GREEN),
    ],
)
def test_the_end_is_written_on_the_last_frame(
    situation: Situation, end: dict[str, Any], words: str, colour: tuple[int, int, int]
) -> None:
    ended = replace(situation, **end)
    assert outcome(ended) == words
    frame = drawn_end("title", ended, PICTURE, 300)
    assert frame.shape == (300, 700, 3) and frame[LINE_PX + 1, -1].tolist() == list(colour)
    assert not has(drawn_end("title", ended, PICTURE, 300), GREEN if colour == RED else RED)


def test_frames_are_padded_and_cut() -> None:
    white = np.full((4, 6, 3), 255, np.uint8)
    assert padded(white, 6, 4).sum() == 255 * 3 * 16 and padded(white, 6, 4).shape == (6, 4, 3)


def test_letters_that_the_font_lacks_do_no_harm(situation: Situation) -> None:
    frame = drawn("\u30c6\u30b9\u30c8" * 200, situation, PICTURE, None, CALM)
    assert frame.shape[1] == 700
