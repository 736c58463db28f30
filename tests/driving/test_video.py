from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest

from gear.contracts.controllers import Action
from gear.driving.scenario import Scenario
from gear.driving.simulation import DriveSimulation, Situation
from gear.driving.start import Draw
from gear.driving.video import RED, Video, check_video, drawn
from gear.formats.coco import Detection
from gear.testing.tiny_town import tiny_world

PICTURE = np.full((96, 320, 3), 90, np.uint8)
CALM = Action(acceleration_mps2=0.5, steering_rad=0.0, notes={"gap_m": 12.0, "is_emergency": 0.0})
HARD = Action(acceleration_mps2=-8.0, steering_rad=0.0, notes={"is_emergency": 1.0})


@pytest.fixture(scope="module")
def situation() -> Situation:
    world = tiny_world()
    return DriveSimulation(world, world.scene).reset(Draw(name="free_road", scenario=Scenario(), speed_mps=8.0, seed=0))


@pytest.mark.parametrize(
    ("seen", "is_dense"),
    [
        (None, False),
        (np.full((96, 320), 20.0, np.float32), True),
        (np.full((96, 320), 7, np.uint8), True),
        ((Detection(category_id=3, box_px=(10.0, 20.0, 60.0, 80.0), score=0.9),), False),
    ],
)
def test_a_frame_shows_what_the_network_saw(situation: Situation, seen: Any, is_dense: bool) -> None:
    frame = drawn(situation, PICTURE, seen, CALM)
    assert frame.dtype == np.uint8 and frame.shape[1] == 320 and not any(side % 2 for side in frame.shape[:2])
    assert frame.shape[0] == 36 + 96 * (1 + is_dense)
    has_box = bool((frame == np.array(RED, np.uint8)).all(axis=2).any())
    assert has_box == isinstance(seen, tuple)
    assert (PICTURE == 90).all(), "the picture itself is not drawn on"


def test_an_emergency_is_red(situation: Situation) -> None:
    assert drawn(situation, PICTURE, None, HARD)[0, -1].tolist() == list(RED)
    assert drawn(situation, PICTURE, None, CALM)[0, -1].tolist() == [0, 0, 0]


def test_a_video_has_all_frames_and_repeats(situation: Situation) -> None:
    av = pytest.importorskip("av")
    check_video()

    def made() -> bytes:
        video = Video()
        for number in range(5):
            video.watch(situation, {"left": np.full((96, 1000, 3), 40 * number, np.uint8)}, None, CALM)
        return video.mp4()

    data = made()
    assert data == made()
    with av.open(io.BytesIO(data)) as container:
        stream = container.streams.video[0]
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
        assert stream.codec_context.name == "h264" and stream.average_rate == 10
    assert len(frames) == 5 and frames[0].shape == (36 + 80, 832, 3)
    assert abs(float(frames[4][60:].mean()) - 160) < 6


def test_without_pictures_there_is_no_video(situation: Situation) -> None:
    video = Video()
    video.watch(situation, {}, None, CALM)
    assert video.mp4() == b""
