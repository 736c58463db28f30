"""What all compositors share, with a compositor of three pixels per picture whose values are known."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
from scipy import sparse
from torch import Tensor

from gear.compositor.base import BaseCompositor, Prepared, Sizes, picture_of, products, rounded
from gear.compositor.cache import Cache
from gear.compositor.sparse import SparseMatrix
from gear.values.errors import DatasetError

HEIGHT, WIDTH = 2, 4
PIXELS = {"left": (1, 6, 4), "right": (0, 7, 3)}
"""The composed pixels of each view: row * WIDTH + column."""


def picture(index: int, view: str) -> np.ndarray:
    """(HEIGHT, WIDTH, 3) uint8, other values in each sample, view, pixel and channel."""
    first = 100 * index + (50 if view == "right" else 0)
    return (first + np.arange(HEIGHT * WIDTH * 3)).astype(np.uint8).reshape(HEIGHT, WIDTH, 3)


class FirstTexels(BaseCompositor):
    """Shows the first three texels of the first patch, darker by the index of the sample."""

    loaded = 0

    def _load(self, index: int, view: str, sizes: Sizes) -> Prepared:
        self._demand(sizes, 1)
        self.sizes = sizes
        self.loaded += 1
        return self._prepare(picture(index, view), np.array(PIXELS[view]), 1 / (1 + index), 5)

    def _columns(self, patches: Sequence[Tensor]) -> list[Tensor]:
        return [patch.flatten(-2).transpose(-1, -2) for patch in patches]

    def _composed(self, inner: Sequence[Any], columns: Sequence[Tensor]) -> Tensor:
        (texels,) = columns
        each = texels if texels.ndim == 3 else texels[None].expand(len(inner), -1, -1)
        return torch.cat([one[:3] * factor for one, factor in zip(each, inner, strict=True)])


def compositor(**options: Any) -> FirstTexels:
    records = [SimpleNamespace(surfaces=("a", "b")), SimpleNamespace(surfaces=("a",))]
    data: Any = SimpleNamespace(sidecar=lambda index: SimpleNamespace(record=records[index]))
    return FirstTexels(data, **options)


def patches(count: int | None = None) -> Tensor:
    shape = (3, 2, 2) if count is None else (count, 3, 2, 2)
    return torch.rand(shape, generator=torch.Generator().manual_seed(3))


def expected(patch: Tensor, index: int, view: str) -> Tensor:
    """The composed picture (3, HEIGHT, WIDTH) of one sample, pixel by pixel."""
    result = torch.from_numpy(picture(index, view)).permute(2, 0, 1).float() / 255
    for number, place in enumerate(PIXELS[view]):
        result[:, place // WIDTH, place % WIDTH] = patch[:, number // 2, number % 2] * (1 / (1 + index))
    return result


@pytest.mark.parametrize("view", ["left", "right"])
def test_each_picture_gets_its_values_at_its_pixels_and_keeps_all_others(view: str) -> None:
    samples = [2, 0, 1]
    found = compositor().compose([patches()], samples, view)
    assert found.shape == (3, 3, HEIGHT, WIDTH) and found.dtype == torch.float32
    assert torch.equal(found, torch.stack([expected(patches(), index, view) for index in samples]))


def test_a_batch_of_patches_has_one_patch_per_sample() -> None:
    several = patches(2)
    found = compositor().compose([several], [1, 0], "left")
    assert torch.equal(found, torch.stack([expected(several[0], 1, "left"), expected(several[1], 0, "left")]))


def test_the_gradient_of_a_patch_is_that_of_the_pixels_that_show_it() -> None:
    patch = patches().requires_grad_()
    weights = torch.rand(2, 3, HEIGHT, WIDTH, generator=torch.Generator().manual_seed(4))
    (compositor().compose([patch], [0, 1], "left") * weights).sum().backward()  # type: ignore[no-untyped-call]
    wanted = torch.zeros(3, 2, 2)
    for number, place in enumerate(PIXELS["left"]):
        shown = weights[:, :, place // WIDTH, place % WIDTH]
        wanted[:, number // 2, number % 2] = shown[0] + shown[1] / 2
    assert patch.grad is not None and torch.allclose(patch.grad, wanted, atol=1e-6)


@pytest.mark.parametrize("shape", [(3, 2, 5), (1, 3, 4, 2)])
def test_samples_are_prepared_for_the_height_and_width_of_the_patches(shape: tuple[int, ...]) -> None:
    one = compositor()
    one.compose([torch.zeros(shape)], [0], "left")
    assert one.sizes == (shape[-2:],)


@pytest.mark.parametrize("shape", [(2, 2), (4, 2, 2), (1, 2, 3, 2, 2), (2, 4, 2, 2), (3, 3, 2, 2), (1, 3, 2, 2)])
def test_patches_of_another_shape_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"must be \(3, h, w\), or \(2, 3, h, w\) here, got"):
        compositor().compose([torch.zeros(shape)], [0, 1], "left")


@pytest.mark.parametrize("count", [0, 2])
def test_another_number_of_patches_is_refused(count: int) -> None:
    with pytest.raises(ValueError, match=f"there are 1 surfaces, got {count} patches"):
        compositor().compose([patches()] * count, [0], "left")


def test_the_number_of_surfaces_is_that_of_the_first_sample() -> None:
    assert compositor().surfaces == 2


def test_prepared_samples_are_kept_by_sample_view_and_size() -> None:
    one = compositor()
    for _ in range(2):
        one.compose([patches()], [0, 1], "left")
    assert one.loaded == 2
    one.compose([patches()], [0], "right")
    one.compose([patches().repeat(1, 1, 2)], [0], "left")
    assert one.loaded == 4


def test_compositors_may_share_a_cache_and_never_its_entries() -> None:
    shared: Cache[Prepared] = Cache(1 << 20)
    one, other = compositor(cache=shared, cache_bytes=0), compositor(cache=shared, cache_bytes=0)
    for _ in range(2):
        one.compose([patches()], [0], "left")
        other.compose([patches()], [0], "left")
    assert (one.loaded, other.loaded) == (1, 1)
    nothing = compositor(cache_bytes=0)
    for _ in range(2):
        nothing.compose([patches()], [0], "left")
    assert nothing.loaded == 2


def test_the_memory_of_a_prepared_sample() -> None:
    prepared = compositor()._load(0, "left", ((2, 2),))
    assert prepared.nbytes == 3 * HEIGHT * WIDTH + 3 * 8 + 5
    assert prepared.picture.dtype == torch.uint8 and prepared.picture.is_contiguous()


def test_rounding_is_to_the_nearest_multiple_of_1_of_255_halves_up() -> None:
    steps = torch.tensor([0.0, 0.49, 0.5, 0.51, 127.5, 254.49, 254.5, 255.0])
    assert (rounded(steps / 255) * 255).round(decimals=3).tolist() == [0, 0, 1, 1, 128, 254, 255, 255]
    values = torch.tensor([0.2, 0.7], requires_grad=True)
    (rounded(values) * torch.tensor([2.0, 3.0])).sum().backward()  # type: ignore[no-untyped-call]
    assert values.grad is not None and values.grad.tolist() == [2, 3]


@pytest.mark.parametrize("rounding", [False, True])
def test_patches_and_pictures_are_rounded_only_if_asked(rounding: bool) -> None:
    one = compositor(rounding=rounding)
    found = one.compose([torch.full((3, 2, 2), 2 / 255)], [2], "left")[0, :, 0, 1] * 255
    assert found.tolist() == pytest.approx([1 if rounding else 2 / 3] * 3, abs=1e-4)
    shown = one._checked(torch.full((3, 2, 2), 2.4 / 255, dtype=torch.float64), 1)
    assert shown.dtype == torch.float32 and (shown * 255).flatten().tolist() == pytest.approx(
        [2 if rounding else 2.4] * 12
    )


def test_products_are_those_of_dense_matrices() -> None:
    rng = np.random.default_rng(0)
    dense = [rng.random((rows, 5)).astype(np.float32) * (rng.random((rows, 5)) < 0.5) for rows in (2, 4)]
    matrices = [SparseMatrix.of(sparse.csr_matrix(one), torch.device("cpu")) for one in dense]
    texels = torch.rand(2, 5, 3, generator=torch.Generator().manual_seed(5))
    for columns, each in ((texels, texels), (texels[0], texels[:1].expand(2, -1, -1))):
        wanted = torch.cat([torch.from_numpy(one) @ mine for one, mine in zip(dense, each, strict=True)])
        assert torch.allclose(products(matrices, columns), wanted, atol=1e-6)


def test_the_ground_truth_of_a_surface_is_found_by_its_name_and_view() -> None:
    truths: list[Any] = [SimpleNamespace(name=name, camera=view) for name in ("a", "b") for view in ("left", "right")]
    sample = SimpleNamespace(surfaces=truths, record=SimpleNamespace(index=7))
    one = compositor()
    one.dataset = SimpleNamespace(root=Path("data"), plan=SimpleNamespace(info=SimpleNamespace(split="train")))  # type: ignore[assignment]
    assert one._truth(sample, "b", "left") is truths[2] and one._truth(sample, "a", "right") is truths[1]
    for name, view in (("c", "left"), ("a", "rear")):
        with pytest.raises(DatasetError, match=rf"^data/gear/train/.*000007.*does not say where {name} .*'{view}'"):
            one._truth(sample, name, view)


def test_the_picture_of_a_view() -> None:
    sample, data = SimpleNamespace(images={"left": picture(0, "left")}), SimpleNamespace(root=Path("data"))
    assert picture_of(sample, "left", data) is sample.images["left"]  # type: ignore[arg-type]
    with pytest.raises(DatasetError, match="data: has no view 'right'; there are: left"):
        picture_of(sample, "right", data)  # type: ignore[arg-type]
