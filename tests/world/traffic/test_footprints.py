"""Footprints overlap where their rectangles share ground on one level."""

from __future__ import annotations

import math

import cv2
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from gear.world.traffic.footprints import LEVEL_M, Footprint

SIDES = st.floats(0.2, 4.0)
FOOTPRINTS = st.builds(
    Footprint, st.floats(-5, 5), st.floats(-5, 5), st.just(0.0), st.floats(-math.pi, math.pi), SIDES, SIDES
)


def corners(footprint: Footprint) -> np.ndarray:
    along = np.array([math.cos(footprint.yaw_rad), math.sin(footprint.yaw_rad)]) * footprint.half_length_m
    across = np.array([-math.sin(footprint.yaw_rad), math.cos(footprint.yaw_rad)]) * footprint.half_width_m
    signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    middle = np.array([footprint.x_m, footprint.y_m])
    return np.array([middle + a * along + b * across for a, b in signs], np.float32)


@given(first=FOOTPRINTS, second=FOOTPRINTS)
def test_overlaps_are_those_of_polygons(first: Footprint, second: Footprint) -> None:
    assert first.overlaps(second) == second.overlaps(first)
    area_m2, _ = cv2.intersectConvexConvex(corners(first), corners(second))
    if area_m2 > 1e-2:
        assert first.overlaps(second)
    if not first.overlaps(second):
        assert area_m2 < 1e-2
    if not first.grown(0.1, 0.1).overlaps(second):
        assert area_m2 == 0


def test_other_levels_do_not_count() -> None:
    first = Footprint(0.0, 0.0, 0.0, 0.0, 2.0, 1.0)
    assert first.overlaps(Footprint(1.0, 0.0, LEVEL_M - 0.1, 0.5, 2.0, 1.0))
    assert not first.overlaps(Footprint(1.0, 0.0, LEVEL_M + 0.1, 0.5, 2.0, 1.0))


@given(footprint=FOOTPRINTS)
def test_the_circle_contains_the_rectangle(footprint: Footprint) -> None:
    distances = np.linalg.norm(corners(footprint) - (footprint.x_m, footprint.y_m), axis=1)
    np.testing.assert_allclose(distances, footprint.radius_m, rtol=1e-4)
