"""What became of objects, against a second matching in plain loops, and against the metrics of single pictures."""

from __future__ import annotations

import numpy as np
import pytest

from gear.metrics.object_matching import outcomes
from gear.metrics.single_picture import boxes, single_metrics
from gear.values.picture_objects import PictureDetection, PictureObjects
from tests.metrics.drawn_objects import (
    KINDS,
    NO_PATCH,
    Box,
    area,
    drawn,
    iou,
    picture,
    said,
    share_inside,
    states,
    thing,
)

CAR: Box = (10, 10, 30, 20)


@pytest.mark.parametrize(
    ("detections", "state", "roles"),
    [
        ([], "missed", []),
        ([said("car", CAR, 0.49)], "missed", []),
        ([said("car", CAR, 0.5)], "found", ["found"]),
        ([said("car", (10, 10, 20, 20))], "found", ["found"]),
        ([said("car", (10, 10, 19.9, 20))], "moved", ["moved"]),
        ([said("car", (28, 10, 30, 20))], "moved", ["moved"]),
        ([said("car", (28.1, 10, 30, 20))], "missed", ["background"]),
        ([said("person", CAR)], "misclassified", ["misclassified"]),
        ([said("person", (10, 10, 19.9, 20))], "missed", ["background"]),
        ([said("person", CAR), said("car", CAR, 0.6)], "found", ["duplicate", "found"]),
        ([said("car", CAR), said("car", (11, 10, 30, 20), 0.8)], "found", ["found", "duplicate"]),
        ([said("person", CAR), said("car", (20, 10, 40, 20), 0.8)], "misclassified", ["misclassified", "background"]),
        ([said("car", (45, 10, 59, 20))], "missed", ["ignored"]),
    ],
)
def test_states_and_roles(detections: list[PictureDetection], state: str, roles: list[str]) -> None:
    seen = outcomes(picture([thing(1, "car", CAR)], detections, [(52.0, 0.0, 60.0, 60.0)]), NO_PATCH)
    assert states(seen) == [state] and [one.role for one in seen.detections] == roles
    explaining = [one.label for one in seen.detections if one.role == state]
    assert seen.objects[0].detected_as == (explaining[0] if explaining else None)


def test_what_fits_in_the_picture_alone_is_moved_in_space() -> None:
    """No false alarm, since it is a detection of the object; but not where the object is."""
    for in_place, state in ((True, "found"), (False, "moved")):
        given_ = picture([thing(1, "car", CAR)], [said("car", CAR, 0.2), said("car", CAR)], in_place=[False, in_place])
        seen = outcomes(given_, NO_PATCH)
        assert states(seen) == [state] and [one.is_false_alarm for one in seen.detections] == [False]


def brute_force(shown: PictureObjects) -> tuple[dict[int, str], list[str]]:
    """State of each object and role of each detection, surest first, by plain loops over the rules."""
    sure = sorted((one for one in shown.detections if one.score >= 0.5), key=lambda one: -one.score)
    state = dict.fromkeys(range(len(shown.objects)), "missed")
    role: dict[int, str] = {}
    for name, wants_same, least in (("found", True, 0.5), ("misclassified", False, 0.5), ("moved", True, 0.1)):
        for d, one in enumerate(sure):
            if d in role:
                continue
            best, best_iou = None, 0.0
            for number, what in enumerate(shown.objects):
                overlap = iou(one.box_px, what.box_px)
                if state[number] == "missed" and (what.label == one.label) == wants_same and overlap > best_iou:
                    best, best_iou = number, overlap
            if best is not None and best_iou >= least:
                state[best], role[d] = name, name
    for d, one in enumerate(sure):
        if d in role:
            continue
        inside = [share_inside(one.box_px, region) for region in shown.ignored_px]
        if any(iou(one.box_px, what.box_px) >= 0.5 for what in shown.objects):
            role[d] = "duplicate"
        else:
            role[d] = "ignored" if max(inside, default=0) >= 0.5 else "background"
    return state, [role[d] for d in range(len(sure))]


def test_agrees_with_plain_loops_and_with_the_metrics_of_single_pictures() -> None:
    counted: dict[str, int] = {}
    for seed in range(400):
        shown = drawn(seed)
        seen = outcomes(shown, area())
        state, roles = brute_force(shown)
        assert states(seen) == list(state.values()) and [one.role for one in seen.detections] == roles
        single = single_metrics(
            boxes([(what.box_px, KINDS.index(what.label), 1.0) for what in shown.objects]),
            boxes([(one.box_px, KINDS.index(one.label), one.score) for one in shown.detections]),
            np.array(shown.ignored_px, np.float64).reshape(-1, 4),
        )
        if shown.objects:
            assert states(seen).count("found") / len(shown.objects) == single["found_share"]
        assert sum(one.is_false_alarm for one in seen.detections) == single["false_alarms"]
        for name in (*states(seen), *roles):
            counted[name] = counted.get(name, 0) + 1
    assert counted.keys() == {"found", "misclassified", "moved", "missed", "duplicate", "ignored", "background"}
    assert min(counted.values()) > 10
