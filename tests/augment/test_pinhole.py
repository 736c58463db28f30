"""Pinholes of moved pictures, against points: where a moved picture shows a point is where its pinhole projects it."""

import numpy as np
import pytest

from gear.augment.geometry import Window, cut_box, draw_window, whole_window
from gear.augment.pinhole import cut_index_box, index_frame, mirrored_pinhole, windowed_pinhole
from gear.values.geometry import Intrinsics
from gear.values.rng import derive_rng

CENTRED = Intrinsics(192, 96, 110.0)
OWN = Intrinsics(192, 96, 110.0, 105.0, (90.5, 51.25))
POINTS_M = np.array([[1.0, 0.5, 7.0], [-3.0, -1.2, 9.0], [0.0, 0.0, 4.0], [2.5, 1.0, 30.0]])


def shown(pixels: np.ndarray, window: Window) -> np.ndarray:
    """Index pixels of a picture in index pixels of a window's picture: pixel 0 reaches from edge 0 to edge 1."""
    corner, scale = (window.left_px, window.top_px), (window.scale_x, window.scale_y)
    return np.asarray((pixels + 0.5 - corner) * scale - 0.5)


@pytest.mark.parametrize("pinhole", [CENTRED, OWN])
def test_a_mirrored_pinhole_projects_mirrored_points_to_mirrored_pixels(pinhole: Intrinsics) -> None:
    x, y = pinhole.project(POINTS_M).T
    found = mirrored_pinhole(pinhole).project(POINTS_M * [-1, 1, 1])
    np.testing.assert_allclose(found, np.stack([191 - x, y], axis=-1), atol=1e-9)
    assert mirrored_pinhole(mirrored_pinhole(pinhole)) == pinhole


WINDOWS = [
    Window(left_px=40, top_px=20, width_px=112, height_px=56, out_width_px=224, out_height_px=112),
    Window(left_px=47, top_px=17, width_px=98, height_px=62, out_width_px=96, out_height_px=64),
    Window(left_px=-10, top_px=-7, width_px=212, height_px=110, out_width_px=96, out_height_px=48),
]
"""About the middle of 192 x 96: twice as large, stretched in the one direction and shrunk in the other, and larger
than the picture."""


@pytest.mark.parametrize("pinhole", [CENTRED, OWN])
@pytest.mark.parametrize("window", WINDOWS)
def test_a_windows_pinhole_projects_points_to_where_the_window_shows_them(pinhole: Intrinsics, window: Window) -> None:
    found = windowed_pinhole(pinhole, window)
    assert (found.width_px, found.height_px) == (window.out_width_px, window.out_height_px)
    np.testing.assert_allclose(found.project(POINTS_M), shown(pinhole.project(POINTS_M), window), atol=1e-9)


def test_drawn_windows_and_smaller_cameras_have_their_own_vertical_focal_length() -> None:
    """Sizes are whole pixels, so that a window is stretched by up to a pixel."""
    rng = derive_rng(1, "windows")
    windows = [draw_window((96, 192), (60, 130), scale, rng, is_centred=True) for scale in rng.uniform(0.6, 1.7, 20)]
    windows += [whole_window((96, 192), share) for share in (0.33, 0.71)]
    assert any(abs(window.scale_x / window.scale_y - 1) > 0.002 for window in windows)
    for window in windows:
        expected = shown(CENTRED.project(POINTS_M), window)
        np.testing.assert_allclose(windowed_pinhole(CENTRED, window).project(POINTS_M), expected, atol=1e-9)


def test_a_window_that_is_not_stretched_keeps_one_focal_length() -> None:
    assert windowed_pinhole(CENTRED, WINDOWS[0]) == Intrinsics(224, 112, 220.0)


def test_boxes_of_index_pixels_are_half_a_pixel_off_boxes_of_edges() -> None:
    window = WINDOWS[1]
    corners = shown(np.array([[10.0, 20.0], [60.5, 70.25]]), window)
    assert cut_index_box((10.0, 20.0, 60.5, 70.25), window) == pytest.approx(tuple(corners.reshape(-1)))
    whole = np.array(index_frame(192, 96))
    assert whole.tolist() == [-0.5, -0.5, 191.5, 95.5]
    assert np.array(cut_index_box(tuple(whole), window)) + 0.5 == pytest.approx(cut_box((0, 0, 192, 96), window))
