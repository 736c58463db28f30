"""Legends: a name beside its colour, and a bar whose colours and ticks stand where they are said to."""

from __future__ import annotations

import numpy as np

from gear.contracts.legends import ColourBar, ColourNames
from gear.reporting.legend import FRAME, LINE_PX, MARGIN_PX, PAPER, SWATCH_PX, draw_legend


def columns_of(picture: np.ndarray, rgb: tuple[int, int, int]) -> np.ndarray:
    return np.flatnonzero((picture == rgb).all(axis=-1).any(axis=0))


def test_names_stand_beside_their_colours_and_go_on_in_the_next_line() -> None:
    legend = ColourNames(entries=(("road", (255, 0, 0)), ("a car that is parked", (0, 255, 0)), ("sky", (0, 0, 255))))
    wide, narrow = draw_legend(legend, 640), draw_legend(legend, 160)
    assert wide.shape[1] == 640 and narrow.shape[1] == 160 and narrow.shape[0] > wide.shape[0]
    red, green, blue = (columns_of(wide, rgb) for rgb in ((255, 0, 0), (0, 255, 0), (0, 0, 255)))
    assert red.max() < green.min() and green.max() < blue.min()
    between = wide[:, red.max() + 1 : green.min()]
    assert (between > 150).all(axis=-1).any(), "the word stands between the two"


def test_a_bar_runs_from_its_first_colour_to_its_last() -> None:
    bar = ColourBar(
        quantity="depth (m)", colours=((255, 0, 0), (0, 0, 255)), ticks=((0.0, "2"), (0.5, "5"), (1.0, "80"))
    )
    strip = draw_legend(bar, 640)
    first, last = columns_of(strip, (255, 0, 0)), columns_of(strip, (0, 0, 255))
    assert first.size and last.size and first.max() < last.min()
    row = strip[(strip == (255, 0, 0)).all(axis=-1).argmax(axis=0).max()]
    middle = row[(first.min() + last.max()) // 2].astype(int)
    assert abs(middle[0] - 128) < 3 and middle[1] == 0 and abs(middle[2] - 128) < 3


def test_no_names_are_an_empty_strip() -> None:
    assert (draw_legend(ColourNames(entries=()), 100) == PAPER).all()


def test_a_swatch_as_dark_as_the_strip_has_a_frame() -> None:
    strip = draw_legend(ColourNames(entries=(("static", (0, 0, 0)),)), 200)
    swatch = strip[LINE_PX // 2 - 5 : LINE_PX // 2 + 5, MARGIN_PX : MARGIN_PX + SWATCH_PX]
    assert swatch[5, 5].tolist() == [0, 0, 0]
    assert (swatch[5, [0, -1]] == FRAME).all()
