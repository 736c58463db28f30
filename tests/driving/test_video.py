from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest

from gear.contracts.controllers import Action
from gear.driving import video as video_module
from gear.driving.drawing import LINE_PX, drawn, drawn_end
from gear.driving.scenario import Scenario
from gear.driving.simulation import DriveSimulation, Situation
from gear.driving.start import Draw
from gear.driving.video import GAP_PX, HELD_FRAMES, Video, beside_each_other, check_video, decoded, encoded
from gear.testing.tiny_town import tiny_world

CALM = Action(acceleration_mps2=0.5, steering_rad=0.0, notes={"gap_m": 12.0, "is_emergency": 0.0})


@pytest.fixture(scope="module")
def situation() -> Situation:
    world = tiny_world()
    return DriveSimulation(world, world.scene).reset(Draw(name="free_road", scenario=Scenario(), speed_mps=8.0, seed=0))


def test_a_video_has_all_frames_and_repeats(situation: Situation) -> None:
    av = pytest.importorskip("av")
    check_video()

    def made() -> bytes:
        video = Video("depth at 40 km/h")
        for number in range(5):
            video.watch(situation, {"left": np.full((96, 1000, 3), 40 * number, np.uint8)}, None, CALM)
        video.watch(replace(situation, ending="stood"), {"left": np.full((96, 1000, 3), 10, np.uint8)}, None, None)
        return video.mp4()

    data = made()
    assert data == made()
    pictures = [np.full((96, 1000, 3), 40 * number, np.uint8) for number in range(5)]
    drawings = [drawn("depth at 40 km/h", situation, picture, None, CALM) for picture in pictures]
    ended = replace(situation, ending="stood")
    end = drawn_end("depth at 40 km/h", ended, np.full((96, 1000, 3), 10, np.uint8), drawings[0].shape[0])
    assert data == encoded([*drawings, *[end] * HELD_FRAMES]), "the thread changes no byte"
    with av.open(io.BytesIO(data)) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264" and stream.average_rate == 10
    frames = list(decoded(data))
    assert len(frames) == 5 + HELD_FRAMES and frames[0].shape == (3 * LINE_PX + 80, 832, 3)
    assert abs(float(frames[4][100:].mean()) - 160) < 6
    assert abs(float(frames[-1][100:140, 50:-50].mean()) - 10) < 6, "the last picture stays"


def test_an_error_of_the_encoder_is_raised_at_the_end(situation: Situation, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError("no memory")

    monkeypatch.setattr(video_module._Encoder, "add", fail)
    video = Video("")
    video.watch(situation, {"left": np.zeros((96, 128, 3), np.uint8)}, None, CALM)
    with pytest.raises(OSError, match="no memory"):
        video.mp4()


def test_without_pictures_there_is_no_video(situation: Situation) -> None:
    video = Video("")
    video.watch(situation, {}, None, CALM)
    video.watch(situation, {}, None, None)
    assert video.mp4() == b""


def test_twins_beside_each_other_are_in_step_and_the_shorter_one_keeps_its_end() -> None:
    pytest.importorskip("av")

    def video(levels: list[int], width: int = 640) -> bytes:
        return encoded([np.full((96, width, 3), level, np.uint8) for level in levels])

    drives = [video([20, 60]), video([20, 60, 100, 140]), video([200] * 3, 832)]
    together = beside_each_other(drives)
    assert together == beside_each_other(drives)
    frames = list(decoded(together))
    assert len(frames) == 4 and frames[0].shape == (96, 3 * 640 + 2 * GAP_PX, 3)
    middles = [[float(frame[40, 320 + column * (640 + GAP_PX)].mean()) for column in range(3)] for frame in frames]
    wanted = np.array([[20, 20, 200], [60, 60, 200], [60, 100, 200], [60, 140, 200]])
    assert np.array(middles) == pytest.approx(wanted, abs=6)


@pytest.mark.parametrize("data", [b"", b"no video", b"\0" * 4096])
def test_a_damaged_video_is_named(data: bytes) -> None:
    pytest.importorskip("av")
    with pytest.raises(ValueError, match="no video"):
        beside_each_other([data, data])
