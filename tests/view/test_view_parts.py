from __future__ import annotations

import dataclasses
import json
import math
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gear.contracts.tasks import Sample, Sidecar
from gear.groundtruth.surfaces import observe_surfaces
from gear.testing.synthetic import synthetic_frame
from gear.testing.things import board
from gear.values.geometry import RigidTransform
from gear.values.rig import CameraMount, Rig
from gear.values.rng import derive_rng
from gear.values.scene import ActorRecord, Pose
from gear.view.build import deflated, is_inside
from gear.view.channels import Channel, PreviewError, aligned_with, previews
from gear.view.counts import count, without_identifiers
from gear.view.document import embedded
from gear.view.encoding import LEAST_WIDTH_PX, SCALES, encode, largest_scale
from gear.view.measures import measures
from gear.view.rows import finite, row
from gear.view.surface_occlusion import area_px2, clipped, hidden

RIG = Rig(cameras=(CameraMount(name="left", width_px=320, height_px=160),))
BUSY = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
"""Time says nothing of these tests, and machines may be busy."""

WORLD_FROM_EGO = RigidTransform.from_yaw("world", "ego", (100.0, 50.0, 0.0), math.pi / 2)


def sidecar_of(*things: Any, facts: Any = None, world_from_ego: RigidTransform = WORLD_FROM_EGO) -> Sidecar:
    frame, record = synthetic_frame(RIG, things, world_from_ego=world_from_ego)
    surfaces = observe_surfaces(frame.views["left"], frame.geoms, record)
    return Sidecar(record=record, surfaces=surfaces, facts=facts or {}, files={})


def sample_with(**images: tuple[int, int]) -> Sample:
    _, record = synthetic_frame(RIG)
    pictures = {name: np.zeros((*size, 3), np.uint8) for name, size in images.items()}
    return Sample(record=record, images=pictures, surfaces=())


class Drawn:
    def __init__(self, pictures: Any) -> None:
        self.pictures = pictures

    def preview(self, sample: Sample) -> Any:
        if isinstance(self.pictures, Exception):
            raise self.pictures
        return self.pictures


def test_a_preview_is_aligned_with_the_camera_it_names() -> None:
    sample = sample_with(left=(40, 80), right=(40, 80), top=(20, 20))
    same = np.zeros((40, 80, 3), np.uint8)
    assert aligned_with("right", same, sample) == "right"
    assert aligned_with("depth of right", same, sample) == "right"
    assert aligned_with("labels", same, sample) == "left"
    assert aligned_with("right", np.zeros((20, 20, 3), np.uint8), sample) == "top"
    assert aligned_with("chart", np.zeros((33, 7, 3), np.uint8), sample) is None


@pytest.mark.parametrize(
    "pictures",
    [
        ValueError("no"),
        {"x": np.zeros((4, 4), np.uint8)},
        {"x": np.zeros((4, 4, 4), np.uint8)},
        {"x": np.zeros((4, 4, 3), np.float32)},
        {"x": np.zeros((0, 4, 3), np.uint8)},
        {"x": "picture"},
        None,
    ],
)
def test_a_bad_preview_is_said_in_words(pictures: Any) -> None:
    with pytest.raises(PreviewError, match="preview"):
        previews(Drawn(pictures), sample_with(left=(4, 4)))  # type: ignore[arg-type]


def test_channels_keep_their_kinds_apart() -> None:
    shown = previews(Drawn({"left": np.zeros((4, 4, 3), np.uint8)}), sample_with(left=(4, 4)))  # type: ignore[arg-type]
    assert list(shown) == [Channel("preview", "left")]
    assert shown[Channel("preview", "left")].camera == "left"


def test_pictures_shrink_by_whole_pages_and_never_below_the_least() -> None:
    import cv2

    pixels = derive_rng(0, "picture").integers(0, 256, (100, 400, 3), dtype=np.uint8)
    whole, half, least = encode(pixels, 1.0), encode(pixels, 0.5), encode(pixels, 0.01)
    sizes = [cv2.imdecode(np.frombuffer(p.data, np.uint8), cv2.IMREAD_COLOR).shape for p in (whole, half, least)]
    assert sizes == [(100, 400, 3), (50, 200, 3), (40, LEAST_WIDTH_PX, 3)]
    assert [p.is_whole for p in (whole, half, least)] == [True, False, False]
    assert {(p.width_px, p.height_px) for p in (whole, half, least)} == {(400, 100)}


def test_pictures_longer_than_the_format_allows_shrink() -> None:
    import cv2

    for shape in ((16, 16400, 3), (16400, 400, 3)):
        picture = encode(np.zeros(shape, np.uint8), 1.0)
        shown = cv2.imdecode(np.frombuffer(picture.data, np.uint8), cv2.IMREAD_COLOR)
        assert max(shown.shape) <= 16383 and not picture.is_whole
        assert (picture.height_px, picture.width_px) == shape[:2]


def test_pictures_keep_their_colours_and_their_side() -> None:
    import cv2

    pixels = np.zeros((64, 128, 3), np.uint8)
    pixels[:, :64], pixels[:, 64:] = (220, 30, 30), (30, 30, 220)
    back = cv2.imdecode(np.frombuffer(encode(pixels, 1.0).data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    assert np.abs(back[32, 20].astype(int) - (220, 30, 30)).max() < 25
    assert np.abs(back[32, 100].astype(int) - (30, 30, 220)).max() < 25


def test_the_scale_is_the_largest_that_fits() -> None:
    pixels = derive_rng(1, "picture").integers(0, 256, (200, 800, 3), dtype=np.uint8)
    sizes = {scale: len(encode(pixels, scale).data) for scale in SCALES}
    for scale in (1.0, 0.5, 0.25):
        assert largest_scale([[pixels]], 10, 10 * sizes[scale] + 5) == scale
        assert largest_scale([[pixels]], 10, 10 * sizes[scale] - 5) < scale
    assert largest_scale([[pixels]], 10, 1) == SCALES[-1]


def test_occlusion_and_truncation_of_a_board() -> None:
    def measured(*things: Any) -> Any:
        sidecar = sidecar_of(*things)
        return hidden(sidecar.surfaces[0], sidecar.record.camera("left"))

    free = measured(board(20.0))
    assert free.truncated_fraction == pytest.approx(0.0, abs=1e-6)
    assert free.occluded_fraction == pytest.approx(0.0, abs=0.03)
    # The picture spans 90 degrees: at 20 m its left border is 18.5 m to the left of the car's camera.
    half_outside = measured(board(20.0, 18.5))
    assert half_outside.truncated_fraction == pytest.approx(0.5, abs=0.03)
    assert half_outside.occluded_fraction == pytest.approx(0.0, abs=0.05)
    behind_another = measured(board(20.0), board(12.0, 0.0, surface=1))
    assert behind_another.occluded_fraction > 0.9
    behind_the_car = measured(board(-20.0))
    assert behind_the_car.truncated_fraction is None and behind_the_car.occluded_fraction is None


coordinates = st.floats(-300, 600, allow_nan=False)


@BUSY
@given(st.tuples(coordinates, coordinates), st.floats(1, 400), st.floats(1, 400))
def test_clipping_a_rectangle_is_intersecting_intervals(
    corner: tuple[float, float], width: float, height: float
) -> None:
    x, y = corner
    rectangle = [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]
    inside = area_px2(clipped(rectangle, 319.5, 159.5))
    across = max(0.0, min(x + width, 319.5) - max(x, -0.5))
    down = max(0.0, min(y + height, 159.5) - max(y, -0.5))
    assert inside == pytest.approx(across * down, abs=1e-6 * max(1.0, across * down))


def test_the_index_places_things_in_the_world() -> None:
    told = row(sidecar_of(board(20.0)))
    asset, role, number, x, y, heading = told["actors"][0]
    assert (asset, role, number, x, y) == ("synthetic_ego", "ego", 1, 100.0, 50.0)
    assert heading == pytest.approx(math.pi / 2, abs=1e-3)
    camera = told["cameras"][0]
    assert (camera["x"], camera["y"]) == (100.0, 51.5)
    assert camera["heading"] == pytest.approx(math.pi / 2, abs=1e-3)
    # The car looks north, so the board lies 20 m north, spans east to west, and faces south.
    face = told["boards"][0]
    west, east = sorted(face["ends"])
    assert west == pytest.approx([96.3, 70.0], abs=0.02) and east == pytest.approx([103.7, 70.0], abs=0.02)
    assert face["outward"] == pytest.approx([0.0, -1.0], abs=1e-3)
    surface = told["surfaces"][0]
    assert surface["distance"] == pytest.approx(18.5, abs=0.05)
    assert surface["visible"] > 0.95


def test_a_surface_that_rides_is_where_its_carrier_is() -> None:
    sidecar = sidecar_of(board(20.0))
    surface = sidecar.record.surfaces[0]
    carrier = ActorRecord(id=9, asset="truck", role="carrier", world_from_actor=Pose(position_m=(5.0, 6.0, 0.0)))
    riding = dataclasses.replace(surface, actor_id=9, parent_from_surface=Pose(position_m=(1.0, 2.0, 3.0)))
    record = dataclasses.replace(sidecar.record, actors=(*sidecar.record.actors, carrier), surfaces=(riding,))
    ends = row(dataclasses.replace(sidecar, record=record))["boards"][0]["ends"]
    assert np.mean(ends, axis=0) == pytest.approx([6.0, 8.0])


def test_facts_are_counted_by_what_they_look_like() -> None:
    objects = [{"kitti_type": "Car", "rle": "x" * 60, "id": 3}, {"kitti_type": "Car", "rle": "y" * 60, "id": 4}]
    facts = {"label_px": {"road": 5, "sky": 2.5}, "objects": objects, "baseline_m": 0.5, "mixed": {"a": 1, "b": "c"}}
    assert count(facts) == {"label_px": {"road": 5.0, "sky": 2.5}, "objects.kitti_type": {"Car": 2.0}}
    assert count([1, 2]) == {} and count(None) == {} and count({"x": {}, "y": [], "z": {"flag": True}}) == {}
    assert count({"x": {"a": float("nan")}}) == {}


def test_objects_are_measured_by_what_their_fields_are_called() -> None:
    near = {"label": "car", "visible_fraction": 0.51234, "distance_m": 12, "box": [1, 2], "flag_fraction": True}
    far = {"label": "bus", "visible_fraction": float("nan"), "distance_m": 80.0, "seen_fraction": 0.5}
    found = measures({"objects": [near, far], "baseline_m": 0.5, "empty": [], "parts": [{"code": 3}]})
    assert found["labels"] == ["car", "bus", ""]
    assert found["values"] == {
        "visible_fraction": [0.512, None, None],
        "distance_m": [12.0, 80.0, None],
        "seen_fraction": [None, 0.5, None],
    }
    for facts in (None, [near], {"objects": [{"label": "car"}]}, {"objects": [near, 3]}):
        assert measures(facts) == {"labels": [], "values": {}}


def test_names_that_never_come_twice_are_no_classes() -> None:
    samples = [{"objects.code": {f"{i}-{j}": 1.0 for j in range(5)}, "objects.type": {"Car": 5.0}} for i in range(9)]
    assert without_identifiers(samples) == [{"objects.type": {"Car": 5.0}}] * 9


json_values = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=12,
)


@BUSY
@given(json_values)
def test_whatever_a_record_holds_comes_back_and_cannot_end_its_block(value: Any) -> None:
    clean = finite(value)
    text = embedded(clean)
    assert "<" not in text and ">" not in text and json.loads(text) == clean
    assert json.loads(zlib.decompress(deflated(clean)).decode()) == json.loads(
        json.dumps(clean, ensure_ascii=False).encode("utf-8", "replace")
    )


@pytest.mark.parametrize("path", ["/etc/passwd", "../x", "a/../../b", "a\\b", "a\0b"])
def test_links_stay_inside_the_dataset(path: str) -> None:
    assert not is_inside(path)
    assert is_inside("images/test/a b.png")
