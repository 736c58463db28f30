"""Silhouettes moved by a map of pixels, against loops over its pixels."""

from dataclasses import replace

import numpy as np
import pytest

from gear.camera.effects import Lens, PixelMap
from gear.groundtruth.lens_warp import LensWarp
from gear.testing.synthetic import behind_lens, synthetic_frame
from gear.values.geometry import Array
from gear.values.rig import CameraMount, Rig

HEIGHT, WIDTH = 30, 40


def scaled(share: float, shift_px: tuple[float, float]) -> LensWarp:
    """A map that scales about the picture's middle by `share`, then shifts; its inverse is exact."""
    middle, shift = np.array([WIDTH - 1, HEIGHT - 1]) / 2, np.array(shift_px)

    def forward(points: Array) -> Array:
        return np.asarray((points - middle) * share + middle + shift)

    row, column = np.mgrid[:HEIGHT, :WIDTH]
    x, y = ((place - m - s) / share + m for place, m, s in zip((column, row), middle, shift, strict=True))
    return LensWarp(PixelMap(x=x.astype(np.float32), y=y.astype(np.float32), forward=forward))


WARPS = [scaled(1.0, (3.0, -2.0)), scaled(0.8, (0.3, 0.4)), scaled(1.3, (-2.2, 1.7))]
WINDOWS = [(5, 4, 20, 22), (0, 0, WIDTH, HEIGHT), (28, 20, 40, 30), (17, 9, 20, 12)]


def sources(warp: LensWarp) -> tuple[Array, Array]:
    """The pixel of the pinhole that each pixel of the picture shows."""
    return np.rint(warp.map.x).astype(int), np.rint(warp.map.y).astype(int)


@pytest.mark.parametrize("warp", WARPS)
@pytest.mark.parametrize("window", WINDOWS)
def test_a_window_holds_all_that_shows_it_and_little_more(warp: LensWarp, window: tuple[int, int, int, int]) -> None:
    x0, y0, x1, y1 = window
    column, row = sources(warp)
    shows = (column >= x0) & (column < x1) & (row >= y0) & (row < y1)
    rows, columns = np.nonzero(shows)
    left, top, right, bottom = warp.window(window)
    assert 0 <= left < right <= WIDTH and 0 <= top < bottom <= HEIGHT
    tight = (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
    wider = np.array([tight[0] - left, tight[1] - top, right - tight[2], bottom - tight[3]])
    at_border = np.array([left == 0, top == 0, right == WIDTH, bottom == HEIGHT])
    # At least one pixel wider, unless the picture ends there, and less than three.
    assert ((wider >= 1) | at_border).all() and (wider <= 3).all() and (wider >= 0).all()


def test_empty_windows_stay_as_they_are() -> None:
    for window in ((7, 3, 7, 9), (7, 9, 12, 9), (8, 3, 7, 9)):
        assert WARPS[1].window(window) == window


@pytest.mark.parametrize("warp", WARPS)
def test_each_pixel_of_a_mask_comes_from_the_nearest_one(warp: LensWarp) -> None:
    window, wanted = (6, 5, 31, 24), (2, 3, 37, 29)
    mask = np.random.default_rng(0).random((19, 25)) < 0.5
    whole = np.zeros((HEIGHT, WIDTH), bool)
    whole[5:24, 6:31] = mask
    column, row = sources(warp)
    expected = np.zeros((26, 35), bool)
    for y in range(3, 29):
        for x in range(2, 37):
            inside = 0 <= row[y, x] < HEIGHT and 0 <= column[y, x] < WIDTH
            expected[y - 3, x - 2] = inside and whole[row[y, x], column[y, x]]
    np.testing.assert_array_equal(warp.mask(mask, window, wanted), expected)


def test_points_move_by_the_map() -> None:
    # Ten right and five below the middle, (19.5, 14.5): eight right and four below it, then shifted.
    np.testing.assert_allclose(WARPS[1].points(np.array([[29.5, 19.5]])), [[27.8, 18.9]])


def test_a_pinhole_has_no_bend_and_a_lens_has_its_own() -> None:
    frame, _ = synthetic_frame(Rig(cameras=(CameraMount(name="left", width_px=60, height_px=30),)), [])
    assert LensWarp.of(frame.views["left"].camera) is None
    camera = behind_lens(frame, Lens(k1=-0.2)).views["left"].camera
    warp = LensWarp.of(camera)
    assert warp is not None
    column, _ = sources(warp)
    assert column.shape == (30, 60) and np.abs(column - np.arange(60)).max() > 1
    # There and back again: where the map says that a pixel comes from appears at that pixel.
    there = np.stack([warp.map.x, warp.map.y], axis=-1).astype(float)
    back = warp.points(there)
    np.testing.assert_allclose(back, np.stack(np.meshgrid(np.arange(60), np.arange(30)), axis=-1), atol=0.02)
    assert LensWarp.of(replace(camera, name="other")) is not None
