"""Sampling matrices: which texels a pixel reads, with which weights."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy import sparse

from gear.compositor.pyramid import pyramid_of
from gear.compositor.sampling import Samples
from gear.compositor.warp import warp_matrix

# A patch of 4 x 4 pixels: the texture has 600 rows and 1200 columns, and level 10 is the coarsest, of one texel.
PYRAMID = pyramid_of(4, 4)
COARSEST = 10


def matrix(*levels: float, u: float = 0.3, v: float = 0.6, weight: float = 1.0) -> sparse.csr_matrix:
    """The matrix of one pixel per level, each with one sample."""
    level = np.array(levels)[:, None]
    ones = np.ones_like(level)
    return warp_matrix(
        Samples(u=u * ones, v=v * ones, level=level, weight=weight * ones, coverage=np.ones(len(levels))), PYRAMID
    )


def test_the_coarsest_level_is_one_texel() -> None:
    assert PYRAMID.levels == COARSEST + 1
    found = matrix(COARSEST)
    assert found.shape == (1, PYRAMID.size)
    assert found.indices.tolist() == [PYRAMID.starts[COARSEST]]
    assert found.data == pytest.approx([1])


@pytest.mark.parametrize("level", [10.4, 11.0, 12.5, 40.0])
def test_levels_beyond_the_coarsest_read_the_coarsest(level: float) -> None:
    assert (matrix(level) != matrix(COARSEST)).nnz == 0


@pytest.mark.parametrize("level", [-0.5, -1.0, -7.3])
def test_magnified_patches_read_the_finest_level(level: float) -> None:
    assert (matrix(level) != matrix(0.0)).nnz == 0


@pytest.mark.parametrize("part", [0.25, 0.5, 0.9])
def test_a_level_between_two_mixes_them_linearly(part: float) -> None:
    mixed = matrix(8 + part).toarray()
    assert mixed == pytest.approx((1 - part) * matrix(8.0).toarray() + part * matrix(9.0).toarray(), abs=1e-6)


def test_rows_sum_to_the_weights_and_pixels_are_in_order() -> None:
    found = matrix(0.0, 3.7, 9.2, weight=0.25)
    assert found.dtype == np.float32
    assert np.asarray(found.sum(axis=1)).ravel() == pytest.approx(0.25)
    for row, level in enumerate((0.0, 3.7, 9.2)):
        assert (found[row] != matrix(level, weight=0.25)).nnz == 0


def test_a_texture_repeats_beyond_its_edges() -> None:
    assert matrix(5.0, u=1.3, v=-0.4).toarray() == pytest.approx(matrix(5.0, u=0.3, v=0.6).toarray(), abs=1e-6)


def test_the_middle_of_a_pixel_of_the_patch_reads_this_pixel_only() -> None:
    found = matrix(0.0, u=(2 + 0.5) / 4, v=(1 + 0.5) / 4)
    assert found.indices.tolist() == [1 * 4 + 2]
    assert found.data == pytest.approx([1])


@pytest.mark.parametrize("level", [0, 1, 2, 3, 4])
def test_samples_are_bilinear_in_the_repeating_texture_of_their_level(level: int) -> None:
    """A patch of 75 x 150 pixels: the texture repeats each pixel 8 x 8 times, level 3 is the patch, level 4 is stored.

    The texel (row, column) of a level of h x w texels has its centre at u = (column + 0.5) / w, v = (row + 0.5) / h.
    """
    rng = np.random.default_rng(level)
    patch = rng.random((3, 75, 150))
    texture = patch.repeat(8 >> level, axis=1).repeat(8 >> level, axis=2) if level < 4 else None
    pyramid = pyramid_of(75, 150)
    texels = pyramid.spread(torch.from_numpy(patch)).numpy()
    if texture is None:
        height, width = pyramid.shape(level)
        texture = texels[pyramid.starts[level] :][: height * width].T.reshape(3, height, width)
    height, width = texture.shape[1:]
    u, v = rng.random((2, 200))
    ones = np.ones((200, 1))
    found = warp_matrix(
        Samples(u=u[:, None], v=v[:, None], level=level * ones, weight=ones, coverage=np.ones(200)), pyramid
    )
    x, y = u * width - 0.5, v * height - 0.5
    left, top = np.floor(x), np.floor(y)
    expected = np.zeros((200, 3))
    for row, column in ((top, left), (top, left + 1), (top + 1, left), (top + 1, left + 1)):
        share = (1 - abs(x - column)) * (1 - abs(y - row))
        expected += share[:, None] * texture[:, row.astype(int) % height, column.astype(int) % width].T
    assert found @ texels == pytest.approx(expected, abs=1e-5)
