"""Texture samples of pixels, against positions, weights and levels that are worked out by hand."""

from __future__ import annotations

from dataclasses import astuple, replace
from typing import Any, cast

import cv2
import numpy as np
import pytest

from gear.compositor.sampling import SampleScheme, take_samples, unit_from_image
from gear.values.geometry import Array
from gear.world.surfaces.face_texture import FACE_SIZE_PX

FILM = SampleScheme(supersampled=True, extrapolates=False, smooths=False)
MULTISAMPLED = SampleScheme(supersampled=False, extrapolates=True, smooths=False)
FAST = SampleScheme(supersampled=False, extrapolates=False, smooths=True)
SIZE_PX = (20, 10)
"""Width and height in pixels of the face in `UNIT`; its left upper corner is at (30, 40)."""

UNIT = np.array([[1 / 20, 0, -30 / 20], [0, 1 / 10, -40 / 10], [0, 0, 1]])
EVERYWHERE = np.ones((80, 80), bool)
UNUSED = cast(Any, None)
"""The exposure, which only effects of the camera read."""


def taken(scheme: SampleScheme, pixels: list[tuple[float, float]], mask: Array = EVERYWHERE, unit: Array = UNIT) -> Any:
    x, y = (np.array(axis, dtype=np.float64) for axis in zip(*pixels, strict=True))
    return take_samples(scheme, unit, (x, y), np.asarray(mask, bool), UNUSED)


@pytest.mark.parametrize(
    ("renderer", "quality", "expected"),
    [("raster", "film", FILM), ("filament", "film", FILM), ("classic", "film", MULTISAMPLED), ("raster", "fast", FAST),
     ("classic", "fast", FAST)],
)  # fmt: skip
def test_a_scheme_follows_from_renderer_and_quality(renderer: str, quality: Any, expected: SampleScheme) -> None:
    assert astuple(SampleScheme.of(renderer, quality, ())) == astuple(expected)


def test_the_homography_is_that_of_the_faces_corners() -> None:
    """A face of 4 m x 2 m, 10 m ahead, 1 m to the right and 0.5 m down, turned by 30 degrees about the vertical."""
    turn = np.radians(30)
    pose = np.eye(4)
    pose[:3, 0] = np.cos(turn), 0, np.sin(turn)
    pose[:3, 2] = -np.sin(turn), 0, np.cos(turn)
    pose[:3, 3] = 1, 0.5, 10
    matrix = np.array([[100.0, 0, 64], [0, 100.0, 32], [0, 0, 1]])
    truth, surface = _Named(camera_from_surface=pose.reshape(-1).tolist()), _Named(width_m=4.0, height_m=2.0)
    unit = unit_from_image(cast(Any, truth), cast(Any, surface), cast(Any, _Named(intrinsics=_Named(matrix=matrix))))
    for u, v in ((0, 0), (1, 0), (0, 1), (1, 1), (0.25, 0.7)):
        point_m = pose @ [(u - 0.5) * 4, (v - 0.5) * 2, 0, 1]
        seen = matrix @ point_m[:3]
        found = unit @ [seen[0] / seen[2], seen[1] / seen[2], 1]
        assert found[:2] / found[2] == pytest.approx([u, v])
        assert found[2] == pytest.approx(1 / point_m[2])


class _Named:
    def __init__(self, **values: Any) -> None:
        self.__dict__.update(values)


def test_film_has_four_samples_a_quarter_of_a_pixel_from_the_centre() -> None:
    found = taken(FILM, [(40, 45)])
    places = {(round(u * 20, 6), round(v * 10, 6)) for u, v in zip(found.u[0], found.v[0], strict=True)}
    assert places == {(9.75, 4.75), (10.25, 4.75), (9.75, 5.25), (10.25, 5.25)}
    assert found.weight == pytest.approx(np.full((1, 4), 0.25)) and found.coverage == pytest.approx(1)


TILTED = np.array([[0.05, 0.01, -1.5], [0.004, 0.1, -4.0], [0.002, -0.003, 1.1]])
"""A face that leans away from the camera."""


def test_positions_and_levels_of_a_tilted_face_are_divided_by_depth() -> None:
    def on_face(x: float, y: float) -> Array:
        u, v, depth = TILTED @ [x, y, 1]
        return np.array([u / depth, v / depth])

    found = taken(MULTISAMPLED, [(35, 44)], unit=TILTED)
    assert [found.u[0, 0], found.v[0, 0]] == pytest.approx(on_face(35, 44))
    edges = [np.linalg.norm((on_face(x, y) - on_face(35, 44)) * FACE_SIZE_PX) for x, y in ((36, 44), (35, 45))]
    assert found.level == pytest.approx(np.log2([[max(edges)]]), abs=1e-9)
    assert max(edges) == edges[1]
    wide = np.diag([3.0, 0.3, 1.0]) @ TILTED
    u, v = (35, 44)
    ends = [wide @ [u + dx, v + dy, 1] for dx, dy in ((0, 0), (1, 0), (0, 1))]
    places = [(end[:2] / end[2]) * FACE_SIZE_PX for end in ends]
    longest = max(np.linalg.norm(places[1] - places[0]), np.linalg.norm(places[2] - places[0]))
    assert longest == np.linalg.norm(places[1] - places[0])
    assert taken(MULTISAMPLED, [(35, 44)], unit=wide).level == pytest.approx(np.log2([[longest]]), abs=1e-9)


@pytest.mark.parametrize("scheme", [FILM, MULTISAMPLED, FAST])
def test_pixels_do_not_influence_each_other(scheme: SampleScheme) -> None:
    places: list[tuple[float, float]] = [(30, 45), (40, 45), (10, 10), (50, 50)]
    together = taken(scheme, places)
    for row, place in enumerate(places):
        alone = taken(scheme, [place])
        for name in ("u", "v", "level", "weight", "coverage"):
            assert getattr(together, name)[row] == pytest.approx(getattr(alone, name)[0])


def test_a_level_is_the_longer_edge_of_a_footprint_in_texels() -> None:
    """A pixel is 1200 / 20 by 600 / 10 texels; with twice as wide a face its height decides."""
    assert FACE_SIZE_PX == (1200, 600)
    plain = taken(MULTISAMPLED, [(40, 45)])
    assert plain.level == pytest.approx(np.log2([[60]]))
    assert taken(FILM, [(40, 45)]).level == pytest.approx(np.full((1, 4), np.log2(30)))
    for scale, texels in (((0.5, 1), 60), ((1, 0.5), 60), ((2, 1), 120), ((1, 3), 180)):
        unit = np.diag([*scale, 1]) @ UNIT
        assert taken(MULTISAMPLED, [(32, 41)], unit=unit).level == pytest.approx(np.log2([[texels]]))
    assert taken(MULTISAMPLED, [(40, 45)], unit=UNIT * [[1e-12], [1e-12], [1]]).level.min() == pytest.approx(
        np.log2(1e-6)
    )


def test_a_turned_footprint_has_diagonal_edges() -> None:
    turn = np.radians(30)
    rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    edges = [np.hypot(60 * np.cos(turn), 60 * np.sin(turn))]
    assert taken(MULTISAMPLED, [(0, 0)], unit=UNIT @ rotation).level == pytest.approx(np.log2([edges]))


def test_samples_beside_the_face_do_not_count() -> None:
    """Half of the samples of a pixel on the left border, three quarters of those beside a corner."""
    border, corner, outside = (taken(FILM, [place]) for place in ((30, 45), (30, 40), (29, 45)))
    assert border.coverage == pytest.approx(0.5) and corner.coverage == pytest.approx(0.25)
    assert sorted(border.weight[0]) == pytest.approx([0, 0, 0.5, 0.5])
    assert sorted(corner.weight[0]) == pytest.approx([0, 0, 0, 1])
    assert border.u[border.weight > 0] == pytest.approx(0.25 / 20)
    assert outside.coverage == pytest.approx(0) and outside.weight == pytest.approx(np.full((1, 4), 0.25))
    assert outside.u == pytest.approx(0) and np.all((outside.v > 0.4) & (outside.v < 0.6))
    for place in ((50, 45), (40, 40), (40, 50)):
        assert taken(FILM, [place]).coverage == pytest.approx(0.5)
        assert taken(MULTISAMPLED, [place]).coverage == pytest.approx(1), "the border belongs to the face"
    assert taken(FILM, [(52, 45)]).u == pytest.approx(1) and taken(FILM, [(40, 52)]).v == pytest.approx(1)


def test_multi_sampling_reads_the_centre_even_beside_the_face() -> None:
    found = taken(MULTISAMPLED, [(28, 53)])
    assert (found.u[0, 0], found.v[0, 0]) == (pytest.approx(-0.1), pytest.approx(1.3))
    assert found.weight == pytest.approx(1) and found.coverage == pytest.approx(0)


def test_nothing_behind_the_camera_is_sampled() -> None:
    """The depth changes its sign at column 40: u and v of both sides would lie on the face."""
    unit = np.array([[0.02, 0, -0.8], [0, 0, 0.02], [0.04, 0, -1.6]])
    ahead, behind = taken(FILM, [(45, 45)], unit=unit), taken(FILM, [(35, 45)], unit=unit)
    assert ahead.coverage == pytest.approx(1) and behind.coverage == pytest.approx(0)
    assert ahead.u == pytest.approx(0.5)


KERNEL = cv2.getGaussianKernel(3, 0.8)[:, 0]


def test_fast_smooths_edges_with_the_neighbours_that_show_the_surface() -> None:
    mask = np.zeros((80, 80), bool)
    mask[40:50, 30:50] = True
    inner, edge = taken(replace(FAST), [(40, 45)], mask), taken(FAST, [(30, 45)], mask)
    assert inner.weight[0] == pytest.approx([0, 0, 0, 0, 1, 0, 0, 0, 0])
    full = np.outer(KERNEL, KERNEL)
    expected = np.where([[False, True, True]] * 3, full, 0)
    assert edge.weight[0] == pytest.approx((expected / expected.sum()).reshape(-1))
    assert edge.coverage == pytest.approx(expected.sum())
    assert edge.u[0].reshape(3, 3)[0] == pytest.approx([0, 0, 1 / 20])
    assert edge.v[0].reshape(3, 3)[:, 1] == pytest.approx([0.4, 0.5, 0.6])
    assert taken(FAST, [(49, 45)], mask).u[0].reshape(3, 3)[0] == pytest.approx([18 / 20, 19 / 20, 1])
    top = taken(FAST, [(40, 40)], mask)
    expected = np.where([[False], [True], [True]], full, 0)
    assert top.weight[0] == pytest.approx((expected / expected.sum()).reshape(-1))
    for place in ((49, 45), (40, 49)):
        assert np.count_nonzero(taken(FAST, [place], mask).weight) == 6
    for place in ((31, 45), (48, 45), (40, 41), (40, 48)):
        assert np.count_nonzero(taken(FAST, [place], mask).weight) == 1, "a pixel that has all four neighbours"


@pytest.mark.parametrize(("column", "row"), [(39, 44), (41, 44), (39, 46), (41, 46)])
def test_a_hole_beyond_a_corner_makes_no_edge(column: int, row: int) -> None:
    mask = np.ones((80, 80), bool)
    mask[row, column] = False
    assert np.count_nonzero(taken(FAST, [(40, 45)], mask).weight) == 1


def test_fast_fills_a_hole_from_around_it() -> None:
    mask = np.ones((80, 80), bool)
    mask[45, 40] = False
    full = np.outer(KERNEL, KERNEL)
    full[1, 1] = 0
    assert taken(FAST, [(40, 45)], mask).weight[0] == pytest.approx((full / full.sum()).reshape(-1))


def test_fast_reads_the_border_where_the_face_lies_between_all_samples() -> None:
    """The id says that the surface shows, and no sample is on it: weights of the visible neighbours, scaled to 1."""
    mask = np.zeros((80, 80), bool)
    mask[4:7, 5] = True
    found = taken(FAST, [(5, 5)], mask)
    expected = np.zeros((3, 3))
    expected[:, 1] = KERNEL / KERNEL.sum()
    assert found.weight[0] == pytest.approx(expected.reshape(-1)) and found.coverage == pytest.approx(0)


def test_the_border_of_the_picture_is_no_edge() -> None:
    corner = taken(FAST, [(0, 0)], unit=np.diag([0.05, 0.1, 1.0]))
    assert corner.weight[0] == pytest.approx([0, 0, 0, 0, 1, 0, 0, 0, 0])


def test_a_pixel_without_neighbours_on_the_surface_reads_only_itself() -> None:
    found = taken(FAST, [(40, 45)], np.zeros((80, 80), bool))
    assert found.weight[0] == pytest.approx([0, 0, 0, 0, 1, 0, 0, 0, 0]) and found.u[0, 4] == pytest.approx(0.5)
    assert found.coverage == pytest.approx(1)


class _Shift:
    """An effect of the camera that moves the picture by whole pixels and records the order of effects."""

    MOVES_PIXELS = True

    def __init__(self, dx: float, scale: float) -> None:
        self.dx, self.scale = dx, scale

    def trace(self, samples: Any, exposure: object) -> Any:
        found = samples.inverse_depth(np.array([40.0]), np.array([45.0]))
        assert found == pytest.approx([0.002 * 40 - 0.003 * 45 + 1.1])
        return replace(samples, x=(samples.x + self.dx) * self.scale)


def test_effects_are_traced_from_the_last_to_the_first() -> None:
    scheme = replace(FAST, effects=(cast(Any, _Shift(0.0, 2.0)), cast(Any, _Shift(3.0, 1.0))))
    found = taken(scheme, [(17, 45)], unit=TILTED)
    u, _, depth = TILTED @ [(17 + 3) * 2, 45, 1]
    assert found.u == pytest.approx(u / depth)
    assert found.weight.shape == (1, 1), "edges that an effect moves are not smoothed"
