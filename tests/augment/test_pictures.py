"""Each change of colours on its own: which way it goes, and how far."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gear.augment.pictures import Colours, recolour
from gear.values.errors import FieldError
from gear.values.rng import derive_rng

STILL = {
    "brightness": 0.0, "contrast": 0.0, "saturation": 0.0, "balance": 0.0, "gamma": 0.0, "noise": 0.0, "blur": 0.0,
    "jpeg": 0.0, "erase": 0.0,
}  # fmt: skip
COLOUR = np.array([70, 110, 150])


def changed(picture: np.ndarray, number: int = 0, **options: Any) -> np.ndarray:
    views = recolour({"left": picture.astype(np.uint8)}, Colours(**STILL | options), derive_rng(0, "colour", number))
    return views["left"].astype(float)


def flat(**options: Any) -> np.ndarray:
    """(200, 3) what becomes of one colour."""
    return np.array([changed(np.full((2, 2, 3), COLOUR), number, **options)[0, 0] for number in range(200)])


def assert_spread(factors: np.ndarray, low: float, high: float) -> None:
    """Rounding to levels moves a factor by less than 0.02."""
    assert factors.min() == pytest.approx(low, abs=0.03) and factors.max() == pytest.approx(high, abs=0.03)


def test_brightness_scales_all_channels_alike() -> None:
    factors = flat(brightness=0.3) / COLOUR
    assert np.ptp(factors, axis=1).max() < 0.02
    assert_spread(factors, 0.7, 1.3)


def test_balance_scales_each_channel_on_its_own() -> None:
    factors = flat(balance=0.2) / COLOUR
    assert np.ptp(factors, axis=1).max() > 0.2
    assert_spread(factors, 0.8, 1.2)


def test_contrast_scales_the_distance_from_middle_grey() -> None:
    factors = (flat(contrast=0.3) - 127.5) / (COLOUR - 127.5)
    assert np.ptp(factors[:, [0, 2]], axis=1).max() < 0.05
    assert_spread(factors[:, 0], 0.7, 1.3)


def test_saturation_scales_the_distance_from_grey() -> None:
    grey = COLOUR @ [0.299, 0.587, 0.114]
    factors = ((flat(saturation=0.5) - grey) / (COLOUR - grey))[:, [0, 2]]
    assert np.ptp(factors, axis=1).max() < 0.06
    assert_spread(factors, 0.5, 1.5)


def test_gamma_is_an_exponent_either_way() -> None:
    exponents = np.log(flat(gamma=0.5) / 255) / np.log(COLOUR / 255)
    assert_spread(exponents, 1 / 1.5, 1.5)


def test_values_end_at_black_and_white() -> None:
    ends = np.array([[[0, 255, 255]]]).repeat(2, axis=1)
    for number in range(20):
        black, white, _ = changed(ends, number, brightness=0.9, contrast=0.9)[0, 0]
        assert black <= white, "no value goes round from one end to the other"


def test_noise_is_as_strong_as_it_says() -> None:
    noise = [changed(np.full((40, 40, 3), 128), n, noise=1.0, noise_levels=8.0).std() for n in range(60)]
    assert 0 <= min(noise) < 1 and 6.5 < max(noise) < 8.5


def test_noise_makes_no_picture_darker() -> None:
    means = [changed(np.full((60, 60, 3), 128), n, noise=1.0, noise_levels=8.0).mean() for n in range(30)]
    assert np.mean(means) == pytest.approx(128, abs=0.05)


def test_a_picture_is_blurred_no_further_than_it_says() -> None:
    edge = np.zeros((9, 9, 3))
    edge[:, 5:] = 255
    assert np.array_equal(changed(edge, blur=1.0, blur_px=0.0), edge)
    slight, strong = (changed(edge, blur=1.0, blur_px=px)[0, 4, 0] for px in (0.25, 1.2))
    assert 0 <= slight <= 1 < strong


def test_jpeg_keeps_colours_where_they_are() -> None:
    rows = np.array([[200, 40, 40], [40, 200, 40], [40, 40, 200]]).repeat(16, axis=0)[:, None].repeat(48, axis=1)
    assert np.abs(changed(rows, jpeg=1.0, jpeg_quality=95) - rows)[4::16].max() < 12


def test_what_is_erased_is_a_rectangle_of_at_most_its_share() -> None:
    sizes = []
    for number in range(60):
        rows, columns = np.nonzero((changed(np.full((50, 80, 3), 77), number, erase=1.0) != 77).any(axis=2))
        sizes.append((np.ptp(rows) + 1, np.ptp(columns) + 1))
        assert len(rows) >= 0.95 * sizes[-1][0] * sizes[-1][1]
    height, width = np.max(sizes, axis=0)
    assert 12 <= height <= 15 and 20 <= width <= 24


@pytest.mark.parametrize(
    ("names", "least", "most", "beyond"),
    [
        (("brightness", "contrast", "saturation", "balance"), 0.0, 0.999, 1.0),
        (("noise", "blur", "jpeg", "erase", "erase_share"), 0.0, 1.0, 1.001),
        (("gamma", "noise_levels"), 0.0, 1e6, None),
        (("blur_px",), 0.0, 100.0, 100.1),
        (("jpeg_quality",), 1, 100, 101),
    ],
)
def test_each_option_has_its_range(names: tuple[str, ...], least: float, most: float, beyond: float | None) -> None:
    below = least - 1 if isinstance(least, int) else least - 1e-3
    for name in names:
        for value in (least, most):
            assert getattr(Colours(**{name: value}), name) == value  # type: ignore[arg-type]
        for value in (below, beyond):
            if value is not None:
                with pytest.raises(FieldError, match=name):
                    Colours(**{name: value})  # type: ignore[arg-type]


def test_what_is_erased_is_noise_of_all_levels_somewhere_in_the_picture() -> None:
    """Row and column of the rectangle are drawn each for itself, and so are its height and its width."""
    places, levels = [], []
    for number in range(150):
        picture = changed(np.full((60, 60, 3), 77), number, erase=1.0)
        rows, columns = np.nonzero((picture != 77).any(axis=2))
        # Where the rectangle begins, as a share of the room that its size leaves.
        height, width = np.ptp(rows) + 1, np.ptp(columns) + 1
        places.append((rows.min() / (60 - height), columns.min() / (60 - width), height, width))
        levels.append(picture[rows, columns].reshape(-1))
    drawn = np.corrcoef(np.array(places).T)
    assert np.abs(drawn - np.eye(4)).max() < 0.35
    assert np.min(places, axis=0)[:2].max() < 0.1 and np.max(places, axis=0)[:2].min() > 0.9
    every = np.concatenate(levels)
    assert (every.min(), every.max()) == (0, 255) and every.mean() == pytest.approx(127.5, abs=3)
    assert every.std() == pytest.approx(256 / np.sqrt(12), abs=2)


def test_the_least_that_is_erased_is_a_pixel() -> None:
    for number in range(20):
        picture = changed(np.full((50, 80, 3), 77), number, erase=1.0, erase_share=0.0)
        assert (picture != 77).any(axis=2).sum() == 1
