"""Polygons held against pycocotools' own filling: the same pixels, and nothing twice."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
import shapely
from pycocotools import mask as coco_mask

from gear.formats.mask_polygons import mask_polygons

Mask = npt.NDArray[np.bool_]

pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")


def filled(polygons: list[list[int]], height: int, width: int) -> npt.NDArray[np.int64]:
    """(height, width) how many polygons fill each pixel."""
    lengths = coco_mask.frPyObjects(polygons, height, width)
    return np.asarray(coco_mask.decode(lengths).sum(axis=2, dtype=np.int64))


def mask_of(*rows: str) -> Mask:
    return np.array([[letter == "#" for letter in row] for row in rows])


@pytest.mark.parametrize(
    ("mask", "polygons"),
    [
        (mask_of("#"), 1),
        (mask_of("####"), 1),
        (mask_of("#.", ".#"), 2),
        (mask_of(".#", "#."), 2),
        (mask_of("###", "#.#", "###"), 2),
        (mask_of("####", "#..#", "##.#", "####"), 2),
        (mask_of("#####", "#.#.#", "#####"), 3),
        (mask_of("###", "#.#", "##."), 1),
        (mask_of("#####", "#...#", "#.#.#", "#...#", "#####"), 3),
        (mask_of("..", ".."), 0),
    ],
)
def test_pieces_and_holes(mask: Mask, polygons: int) -> None:
    found = mask_polygons(mask)
    assert len(found) == polygons
    if found:
        assert np.array_equal(filled(found, *mask.shape), mask)


@pytest.mark.parametrize("density", [0.2, 0.5, 0.8, 0.95])
def test_any_mask_comes_back_to_the_pixel(density: float) -> None:
    rng = np.random.default_rng(int(density * 100))
    for _ in range(60):
        height, width = (int(side) for side in rng.integers(1, 24, 2))
        mask = rng.random((height, width)) < density
        found = mask_polygons(mask, left_px=3, top_px=2)
        if not found:
            assert not mask.any()
            continue
        placed = np.zeros((height + 5, width + 4), dtype=np.int64)
        placed[2 : 2 + height, 3 : 3 + width] = mask
        assert np.array_equal(filled(found, *placed.shape), placed)


def test_polygons_have_the_area_of_their_pixels_and_no_needless_corner() -> None:
    rng = np.random.default_rng(2)
    mask = rng.random((20, 30)) < 0.7
    found = mask_polygons(mask)
    shapes = [shapely.Polygon(np.reshape(polygon, (-1, 2))) for polygon in found]
    assert sum(shape.area for shape in shapes) == mask.sum()
    for polygon in found:
        corners = np.reshape(polygon, (-1, 2))
        steps = np.roll(corners, -1, axis=0) - corners
        assert ((steps == 0).sum(axis=1) == 1).all()
        assert (np.roll(steps, -1, axis=0)[:, 0] * steps[:, 0] == 0).all()
