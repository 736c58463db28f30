"""Faces and mip levels as matrices of the patch."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from gear.compositor.cache import Cache
from gear.compositor.pyramid import Halving, axis_matrices, halving_matrix, halving_of, pyramid_of
from gear.compositor.sampling import Samples
from gear.compositor.sparse import SparseMatrix, stacked_product
from gear.compositor.warp import warp_matrix
from gear.values.geometry import Array
from gear.world.surfaces.face_texture import resample_linear

SIZES = [(150, 300), (37, 50), (37, 75), (600, 1200), (700, 1300), (4, 4)]
HALVINGS: tuple[Halving, ...] = ("middles", "areas")


def noise(height: int, width: int) -> Array:
    return np.random.default_rng(height * width).random((height, width, 3))


def levels_of(patch: Array, halving: Halving) -> list[Array]:
    """The slow way: the face, then its levels, one after the other."""
    levels = [resample_linear(patch)]
    while max(levels[-1].shape[:2]) > 1:
        last = levels[-1]
        rows, columns = (halving_matrix(size, halving) for size in last.shape[:2])
        levels.append(np.einsum("ih,hwc,jw->ijc", rows, last, columns, optimize=True))
    return levels


def at(u: float, v: float, level: float) -> Samples:
    one = np.ones((1, 1))
    return Samples(u=u * one, v=v * one, level=level * one, weight=one, coverage=np.ones(1))


@pytest.mark.parametrize("halving", HALVINGS)
@pytest.mark.parametrize("size", [1, 2, 37, 75, 1200])
def test_halving_averages(size: int, halving: Halving) -> None:
    matrix = halving_matrix(size, halving)
    assert matrix.shape == (max(1, size // 2), size)
    assert matrix.sum(axis=1) == pytest.approx(1)
    if size % 2 == 0:
        assert matrix @ np.arange(size) == pytest.approx(np.arange(size // 2) * 2 + 0.5)


def test_areas_count_every_texel_alike_and_middles_leave_some_out() -> None:
    assert halving_matrix(75, "areas").mean(axis=0) == pytest.approx(1 / 75)
    assert halving_matrix(75, "middles").mean(axis=0).std() > 0.2 / 75


def test_mip_levels_are_halved_by_the_rule_of_the_driver_or_of_filament() -> None:
    nvidia, mesa = "4.6.0 NVIDIA 580.159.04", "4.5 (Compatibility Profile) Mesa 22.3.6"
    assert [halving_of(name, nvidia) for name in ("classic", "raster")] == ["areas", "areas"]
    assert [halving_of("classic", mesa), halving_of("filament", nvidia)] == ["middles", "middles"]


def test_levels_end_at_one_texel() -> None:
    assert [m.shape[0] for m in axis_matrices(300, 1200)] == [1200, 600, 300, 150, 75, 37, 18, 9, 4, 2, 1]


@pytest.mark.parametrize("halving", HALVINGS)
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("level", [0.0, 0.6, 1.0, 2.3, 3.5, 4.5, 7.0, 10.0])
def test_a_sample_reads_what_the_face_would_show(size: tuple[int, int], level: float, halving: Halving) -> None:
    """Folded levels, chained levels and those made from the patch are all the same as a face made in full."""
    patch = noise(*size)
    pyramid = pyramid_of(*size, halving)
    columns = pyramid.spread(torch.from_numpy(patch).permute(2, 0, 1).float())
    assert columns.shape == (pyramid.size, 3)
    slow = levels_of(patch, halving)
    for u, v in ((0.31, 0.77), (0.0, 1.0), (0.5, 0.001)):
        wanted = np.zeros(3)
        low = min(int(level), len(slow) - 1)
        for number, share in ((low, 1 - (level - low)), (min(low + 1, len(slow) - 1), level - low)):
            texels = slow[number]
            x, y = u * texels.shape[1] - 0.5, v * texels.shape[0] - 0.5
            for dy in (0, 1):
                for dx in (0, 1):
                    i, j = int(np.floor(y)) + dy, int(np.floor(x)) + dx
                    weight = (1 - abs(y - i)) * (1 - abs(x - j))
                    wanted += share * weight * texels[i % texels.shape[0], j % texels.shape[1]]
        found = warp_matrix(at(u, v, level), pyramid) @ columns.numpy()
        assert found[0] == pytest.approx(wanted, abs=2e-5)


def test_patches_of_a_batch_are_spread_like_single_patches() -> None:
    patches = torch.rand((2, 3, 37, 75), generator=torch.Generator().manual_seed(0))
    pyramid = pyramid_of(37, 75)
    together = pyramid.spread(patches)
    assert together.shape == (2, pyramid.size, 3)
    for patch, texels in zip(patches, together, strict=True):
        assert torch.equal(texels, pyramid.spread(patch))


@pytest.mark.parametrize(("size", "stored"), [((150, 300), 3), ((149, 300), 3), ((150, 299), 3), ((4, 4), 8)])
def test_levels_at_least_as_fine_as_the_patch_are_not_stored(size: tuple[int, int], stored: int) -> None:
    """The levels have (600, 1200), (300, 600), (150, 300), (75, 150), ... texels."""
    shapes = [(max(1, 600 >> level), 1200 >> level) for level in range(11)]
    pyramid = pyramid_of(*size)
    assert [pyramid.shape(level) for level in range(pyramid.levels)] == shapes
    assert pyramid.size == size[0] * size[1] + sum(h * w for h, w in shapes[stored:])
    assert pyramid.starts[:stored] == (0,) * stored
    assert pyramid.starts[stored] == size[0] * size[1]


def test_products_carry_gradients_back() -> None:
    from scipy import sparse

    dense = [sparse.random(5, 7, 0.4, "csr", np.float32, np.random.default_rng(n)) for n in range(2)]
    matrices = [SparseMatrix.of(matrix, torch.device("cpu")) for matrix in dense]
    columns = torch.rand((7, 3), generator=torch.Generator().manual_seed(1), requires_grad=True)
    product = stacked_product(matrices, columns)
    both = np.concatenate([matrix.toarray() for matrix in dense])
    assert product.detach().numpy() == pytest.approx(both @ columns.detach().numpy(), abs=1e-6)
    weights = torch.rand((10, 3), generator=torch.Generator().manual_seed(2))
    (product * weights).sum().backward()
    assert columns.grad is not None
    assert columns.grad.numpy() == pytest.approx(both.T @ weights.numpy(), abs=1e-6)


def test_a_cache_is_bounded_and_forgets_the_oldest() -> None:
    class Thing:
        nbytes = 40

    cache: Cache[Thing] = Cache(100)
    made: list[str] = []

    def make(name: str) -> Thing:
        made.append(name)
        return Thing()

    for name in ("a", "b", "a", "c", "a", "b"):
        cache.get(name, lambda name=name: make(name))  # type: ignore[misc]
    assert made == ["a", "b", "c", "b"]
    assert (len(cache), cache.nbytes) == (2, 80)


def test_a_cache_may_be_filled_to_its_limit() -> None:
    class Half:
        nbytes = 50

    cache: Cache[Half] = Cache(100)
    for name in ("a", "b"):
        cache.get(name, Half)
    assert (len(cache), cache.nbytes) == (2, 100)


def test_a_sparse_matrix_counts_the_memory_of_both_directions() -> None:
    from scipy import sparse

    matrix = SparseMatrix.of(sparse.random(5, 7, 0.4, "csr", np.float32), torch.device("cpu"))
    entries = 14
    indices = (5 + 1) + (7 + 1) + 2 * entries
    assert matrix.nbytes == 4 * indices + 4 * 2 * entries
