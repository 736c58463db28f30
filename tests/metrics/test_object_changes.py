"""What differs between twins, object by object."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from gear.metrics.object_changes import changes, found_in_twin
from gear.metrics.object_matching import outcomes
from gear.values.picture_objects import PictureDetection, PictureOutcomes
from tests.metrics.drawn_objects import area, drawn, iou, picture, said, states, thing

CAR, RIDER = (10.0, 10.0, 30.0, 20.0), (12.0, 30.0, 22.0, 50.0)
OBJECTS = [thing(1, "car", CAR), thing(2, "person", RIDER), thing(2, "bicycle", (8.0, 40.0, 30.0, 55.0))]
FOUND = [said(one.label, one.box_px) for one in OBJECTS]


def seen(*detections: PictureDetection) -> PictureOutcomes:
    return outcomes(picture(OBJECTS, detections), area())


def test_each_kind_of_change() -> None:
    """A car, and a cyclist, of which a person and a bicycle are labelled under one id."""
    twin = seen(*FOUND, said("truck", (40, 2, 58, 12)))
    now = seen(
        said("bus", CAR), said("person", (12, 39, 22, 59)), said("truck", (41, 2, 58, 12)),
        said("car", (30, 25, 40, 35)),
        said("bus", (40, 2, 58, 12), 0.6),
    )  # fmt: skip
    found = {
        (one.change, one.object_id, one.label, one.detected_as, one.patch.is_on_patch) for one in changes(now, twin)
    }
    assert found == {
        ("misclassified", 1, "car", "bus", False), ("moved", 2, "person", "person", False),
        ("hidden", 2, "bicycle", None, False), ("invented", None, "car", "car", True),
        ("invented", None, "bus", "bus", False),
    }  # fmt: skip
    back = [(one.change, one.label) for one in changes(twin, now)]
    assert back == [], "what the twin has found is not lost there, and its truck has a counterpart"


def test_what_the_twin_misses_is_not_hidden() -> None:
    assert changes(seen(), seen()) == ()
    assert [one.change for one in changes(seen(), seen(*FOUND[:2]))] == ["hidden", "hidden"]
    assert changes(seen(*FOUND), seen()) == (), "it is found in place of being missed"


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6))
def test_equal_predictions_change_nothing(seed: int) -> None:
    assert changes(outcomes(drawn(seed), area()), outcomes(drawn(seed), area())) == ()


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6))
def test_changes_are_of_what_the_twin_has_found(seed: int) -> None:
    """Every object that is found in the twin is found or changed, once; every invention is background."""
    now, twin = outcomes(drawn(seed), area()), outcomes(drawn(seed, twin=1), area())
    found = changes(now, twin)
    of_objects = [one for one in found if one.change != "invented"]
    kept = [one for one in found_in_twin(now, twin) if one.state == "found"]
    assert len(of_objects) + len(kept) == states(twin).count("found") == len(found_in_twin(now, twin))
    by_state = {"hidden": "missed", "misclassified": "misclassified", "moved": "moved"}
    state = {one.object_id: one.state for one in now.objects}
    assert all(state[one.object_id] == by_state[one.change] for one in of_objects if one.object_id is not None)
    background = [one for one in now.detections if one.role == "background"]
    expected = [
        one.box_px
        for one in background
        if not any(other.label == one.label and iou(one.box_px, other.box_px) >= 0.5 for other in twin.detections)
    ]
    assert [one.box_px for one in found if one.change == "invented"] == expected
