"""The base class of compositors, which replace the pixels of a patch surface in stored pictures by a patch."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gear.compositor.cache import Cache
from gear.compositor.sparse import SparseMatrix, stacked_product
from gear.dataset.layout import sidecar_path
from gear.dataset.reading import Dataset
from gear.values.errors import DatasetError
from gear.values.frames import UInt8Image
from gear.values.ground_truth import SurfaceTruth

Sizes = tuple[tuple[int, int], ...]
"""Height and width of each patch, pixels."""

CACHE_BYTES = 4 << 30
"""Default memory limit for prepared samples. One sample takes about 2 MB at 512 x 256 and 20 MB at 2048 x 1024."""


@dataclass(frozen=True, slots=True, eq=False)
class Prepared:
    """One view of one sample, prepared for patches of certain sizes, so that `BaseCompositor.compose` can be
    repeated fast with other patches of these sizes.

    Attributes:
        picture: (3, H, W) uint8, the stored picture.
        where: (N,) int64 row-major indices (row * W + column) of the pixels that a patch may change.
        inner: data for these pixels, of a type that each compositor chooses.
        inner_bytes: memory of `inner` in bytes.
    """

    picture: Tensor
    where: Tensor
    inner: Any
    inner_bytes: int

    @property
    def nbytes(self) -> int:
        """The memory of this object in bytes."""
        return self.picture.nbytes + self.where.nbytes + self.inner_bytes


class BaseCompositor:
    """The base class of compositors; implements `gear.contracts.attacks.Compositor`.

    Subclasses choose the pixels to replace and compute their values.

    Args:
        dataset: the split whose samples are composed; its pictures are the background.
        device: torch device to compute on.
        rounding: whether patches and pictures are rounded to multiples of 1/255, as in files. Gradients pass the
            rounding unchanged.
        cache_bytes: memory limit for prepared samples.
        cache: a cache that several compositors share; None for a new one of `cache_bytes`.
    """

    def __init__(
        self,
        dataset: Dataset[Any],
        *,
        device: str | torch.device = "cpu",
        rounding: bool = False,
        cache_bytes: int = CACHE_BYTES,
        cache: Cache[Prepared] | None = None,
    ) -> None:
        self.dataset = dataset
        self.device = torch.device(device)
        self.rounding = rounding
        self._cache: Cache[Prepared] = Cache(cache_bytes) if cache is None else cache

    @property
    def surfaces(self) -> int:
        """The number of patches that `compose` expects: the number of patch surfaces in the scene."""
        return len(self.dataset.sidecar(0).record.surfaces)

    def compose(self, patches: Sequence[Tensor], samples: Sequence[int], view: str) -> Tensor:
        """Composes the patches onto their surfaces in the pictures of some samples.

        The result is differentiable with respect to the patches. Pixels that no patch can change are equal to the
        dataset's pixels, bit for bit.

        Prepared data of the samples is kept in the cache, so a second call with patches of the same sizes is faster.

        Args:
            patches: one tensor for each surface, sRGB in 0..1: (3, h, w) for all samples, or (B, 3, h, w) with a patch
                for each sample.
            samples: B indices in the dataset.
            view: name of the camera.

        Returns:
            (B, 3, H, W) float32 in 0..1.

        Raises:
            ValueError: the number or the shape of the patches is wrong.
            DatasetError: the dataset lacks files that the compositor needs.
        """
        shown = [self._checked(patch, len(samples)) for patch in patches]
        sizes: Sizes = tuple((int(patch.shape[-2]), int(patch.shape[-1])) for patch in shown)
        views = [self._cache.get((self, i, view, sizes), partial(self._load, i, view, sizes)) for i in samples]
        columns = self._columns(shown)
        pictures = torch.stack([v.picture for v in views]).to(torch.float32).div_(255)
        pixels = pictures[0, 0].numel()
        where = torch.cat([v.where + number * 3 * pixels for number, v in enumerate(views)])
        channels = torch.arange(3, device=self.device) * pixels
        composed = self._composed([v.inner for v in views], columns)
        if self.rounding:
            composed = rounded(composed)
        pasted: Tensor = _Paste.apply(composed, where[:, None] + channels, pictures)  # type: ignore[no-untyped-call]
        return pasted

    def _truth(self, sample: Any, name: str, view: str) -> SurfaceTruth:
        """The stored ground truth of a surface in a view.

        Raises:
            DatasetError: the sample has no ground truth of this surface in this view.
        """
        for truth in sample.surfaces:
            if truth.name == name and truth.camera == view:
                return truth  # type: ignore[no-any-return]
        info, index = self.dataset.plan.info, sample.record.index
        problem = f"does not say where {name} is in view {view!r}; delete it and run the same collection again"
        raise DatasetError(self.dataset.root / sidecar_path(info.split, index), problem)

    @abstractmethod
    def _load(self, index: int, view: str, sizes: Sizes) -> Prepared:
        """Prepares one view of one sample for patches of these sizes."""

    @abstractmethod
    def _columns(self, patches: Sequence[Tensor]) -> list[Tensor]:
        """The texels of each patch at all mip levels as a list of colours, (columns, 3) or (B, columns, 3) each."""

    @abstractmethod
    def _composed(self, inner: Sequence[Any], columns: Sequence[Tensor]) -> Tensor:
        """(N, 3) values in 0..1 of the composed pixels of all views, concatenated.

        Args:
            inner: `Prepared.inner` of each view.
            columns: result of `_columns`, one for each surface.
        """

    def _checked(self, patch: Tensor, batch: int) -> Tensor:
        is_one = patch.ndim == 3
        if patch.ndim not in (3, 4) or patch.shape[-3] != 3 or (not is_one and patch.shape[0] != batch):
            raise ValueError(f"a patch must be (3, h, w), or ({batch}, 3, h, w) here, got {tuple(patch.shape)}")
        moved = patch.to(self.device, torch.float32)
        return rounded(moved) if self.rounding else moved

    def _prepare(self, picture: UInt8Image, where: Any, inner: Any, inner_bytes: int) -> Prepared:
        stored = torch.from_numpy(np.ascontiguousarray(picture.transpose(2, 0, 1))).to(self.device)
        return Prepared(stored, torch.from_numpy(where).to(self.device), inner, inner_bytes)

    def _demand(self, patches: Sizes, surfaces: int) -> None:
        if len(patches) != surfaces:
            raise ValueError(f"there are {surfaces} surfaces, got {len(patches)} patches")


class _Paste(torch.autograd.Function):
    """Writes values into pictures in place. The backward pass reads the gradient at the same pixels."""

    @staticmethod
    def forward(ctx: Any, values: Tensor, where: Tensor, pictures: Tensor) -> Tensor:
        ctx.save_for_backward(where)
        ctx.mark_dirty(pictures)
        pictures.view(-1).index_copy_(0, where.view(-1), values.reshape(-1))
        return pictures

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None, None]:
        (where,) = ctx.saved_tensors
        return gradients[0].reshape(-1).index_select(0, where.view(-1)).view(where.shape), None, None


def products(matrices: Sequence[SparseMatrix], columns: Tensor) -> Tensor:
    """Multiplies the sparse sampling matrix of each view with a patch's texels (pixels of the patch at all mip
    levels), which gives the patch's colour at the composed pixels.

    Args:
        matrices: for each view, a sparse matrix (N_i, T), which samples T texels for N_i pixels.
        columns: the texels, (T, 3) for all views, or (B, T, 3) with one entry for each view.

    Returns:
        (sum of N_i, 3), the pixels of all views one after the other.
    """
    if columns.ndim == 2:
        return stacked_product(matrices, columns)
    return torch.cat([stacked_product([matrix], mine) for matrix, mine in zip(matrices, columns, strict=True)])


def rounded(values: Tensor) -> Tensor:
    """Rounds values in 0..1 to multiples of 1/255; gradients pass unchanged (straight-through estimator).

    Args:
        values: tensor of any shape.
    """
    stepped = torch.floor(values.detach() * 255 + 0.5) / 255
    return values + (stepped - values.detach())


def picture_of(sample: Any, view: str, dataset: Dataset[Any]) -> UInt8Image:
    """Returns the stored picture of one view of a sample, (H, W, 3) uint8.

    Args:
        sample: a sample of any task, with `images` by camera name.
        view: name of the camera.
        dataset: the split of the sample, for the error's message.

    Raises:
        DatasetError: the dataset has no such view.
    """
    if view not in sample.images:
        raise DatasetError(dataset.root, f"has no view {view!r}; there are: {', '.join(sample.images)}")
    picture: UInt8Image = sample.images[view]
    return picture
