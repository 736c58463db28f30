"""Impossible values of a sidecar are refused with their place."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from gear.contracts.tasks import Sidecar
from gear.dataset.checks.sidecar_validation import LARGEST, check_numbers, check_sidecar
from gear.plugins.tasks.common import surfaces_of
from gear.testing.synthetic import synthetic_frame
from gear.testing.tiny_town import SMALL_RIG
from gear.values.errors import FieldError


@pytest.fixture(scope="module")
def sidecar() -> Sidecar:
    frame, record = synthetic_frame(SMALL_RIG)
    return Sidecar(record=record, surfaces=surfaces_of(frame, record), facts={}, files={}, auxiliary={})


def test_a_real_sidecar_passes(sidecar: Sidecar) -> None:
    assert sidecar.surfaces
    check_sidecar(sidecar)


def changed(sidecar: Sidecar, part: str, place: int, **values: Any) -> Sidecar:
    items = list(getattr(sidecar.record, part))
    items[place] = replace(items[place], **values)
    return replace(sidecar, record=replace(sidecar.record, **{part: tuple(items)}))


def test_records_are_checked(sidecar: Sidecar) -> None:
    record = sidecar.record
    cases = [
        (replace(sidecar, record=replace(record, index=-1)), "record.index: must be at least 0"),
        (replace(sidecar, record=replace(record, cameras=())), "record.cameras: there is none"),
        (replace(sidecar, record=replace(record, cameras=record.cameras * 2)), "record.cameras: one is named twice"),
        (replace(sidecar, record=replace(record, actors=())), "record.actors: there is no ego car"),
        (changed(sidecar, "cameras", 0, width_px=0), "record.cameras.0.: pictures are 1 to"),
        (changed(sidecar, "cameras", 0, height_px=9000), "record.cameras.0.: pictures are 1 to"),
        (changed(sidecar, "surfaces", 0, width_m=0.0), "record.surfaces.0.: must have a size"),
        (changed(sidecar, "surfaces", 0, actor_id=12345), "record.surfaces.0..actor_id: there is no actor"),
    ]
    for broken, message in cases:
        with pytest.raises(FieldError, match=message):
            check_sidecar(broken)


def test_surfaces_are_checked(sidecar: Sidecar) -> None:
    first = sidecar.surfaces[0]
    cases: list[tuple[dict[str, Any], str]] = [
        ({"camera": "other"}, "surfaces.0..camera: is none of the record's"),
        ({"name": "other"}, "surfaces.0..name: is none of the record's"),
        ({"visible_px": -1}, "surfaces.0.: cannot show"),
        ({"visible_fraction": 1.5}, "surfaces.0.: cannot show"),
        ({"distance_m": -1.0}, "surfaces.0.: cannot be"),
        ({"incidence_deg": 181.0}, "surfaces.0.: cannot be"),
        ({"corners_px": ((0.0, 0.0),) * 2}, "surfaces.0..corners_px: expected 4 items, got 2"),
        ({"mask_rle": "1"}, "surfaces.0..mask_rle: fills"),
    ]
    for values, message in cases:
        with pytest.raises(FieldError, match=message):
            check_sidecar(replace(sidecar, surfaces=(replace(first, **values), *sidecar.surfaces[1:])))


def test_numbers_are_bounded_except_seeds() -> None:
    check_numbers({"seed": 2 * LARGEST, "poses": [1.0, {"x": -LARGEST}]}, "record")
    with pytest.raises(FieldError, match=r"record.poses\[1\].x: is larger than 1e\+12"):
        check_numbers({"seed": 1, "poses": [1.0, {"x": -2 * LARGEST}]}, "record")
