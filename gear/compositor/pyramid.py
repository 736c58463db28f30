"""The mip levels of a patch's texture, as linear functions of the patch's pixels.

The patch is first resized to the texture's size by area averages; then each mip level has half the sides of the
previous one. Both operations treat rows and columns separately: level = rows @ patch @ columns.T. Levels that are finer
than the patch are not computed; reads of their texels are replaced by reads of the patch's pixels.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from gear.values.geometry import Array, frozen
from gear.world.surfaces.face_texture import FACE_SIZE_PX, box_matrix

if TYPE_CHECKING:
    from torch import Tensor

Ints = npt.NDArray[np.int64]


Halving = Literal["middles", "areas"]
"""How a mip level with an odd number of texels along an axis is halved.

`middles` interpolates at the centres of the new, larger texels, as blits on a GPU do. `areas` averages the area that
each new texel covers. With an even number of texels, both rules average pairs.
"""


def halving_of(renderer: str, driver: str) -> Halving:
    """Returns the rule by which a renderer with a graphics driver computes the next mip level of a texture:
    `middles` or `areas` (see `Halving`).

    Filament uses its own rule on every driver. With OpenGL the driver decides: Mesa interpolates at texel centres,
    NVIDIA averages areas. On an H100, composed pictures differ from renders by up to 7 levels of 255 with the wrong
    rule, and by 0.4 with the right one.

    Args:
        renderer: name of the renderer.
        driver: description of the OpenGL driver, as in the dataset's manifest.
    """
    return "areas" if renderer != "filament" and "nvidia" in driver.casefold() else "middles"


@cache
def halving_matrix(size: int, halving: Halving = "middles") -> Array:
    """Returns the (max(1, size // 2), size) matrix that computes the next mip level along one axis; cached and
    read-only.

    Args:
        size: number of texels along the axis.
        halving: rule for an odd number of texels, see `Halving`.
    """
    target = max(1, size // 2)
    if halving == "areas":
        return box_matrix(size, target)
    at = (np.arange(target) + 0.5) * size / target - 0.5
    low = np.clip(np.floor(at).astype(int), 0, size - 1)
    high = np.minimum(low + 1, size - 1)
    matrix = np.zeros((target, size))
    matrix[np.arange(target), low] += 1 - (at - low)
    matrix[np.arange(target), high] += at - low
    return frozen(matrix)


@lru_cache(maxsize=16)
def axis_matrices(patch_px: int, face_px: int, halving: Halving = "middles") -> tuple[Array, ...]:
    """Returns, for each mip level, the matrix that computes its texels along one axis from the patch's pixels;
    cached.

    Args:
        patch_px: number of the patch's pixels along the axis.
        face_px: number of the texture's texels along the axis.
        halving: rule for an odd number of texels, see `Halving`.

    Returns:
        One (texels of the level, patch_px) matrix per level, from the full texture to a single texel; rows sum to 1.
    """
    matrices = [box_matrix(patch_px, face_px)]
    while matrices[-1].shape[0] > 1:
        matrices.append(frozen(halving_matrix(matrices[-1].shape[0], halving) @ matrices[-1]))
    return tuple(matrices)


@dataclass(frozen=True, slots=True, eq=False)
class Reads:
    """Positions and weights by which the texels along one axis of a mip level are weighted sums of k stored texels.

    For a stored level, k is 1. A level that is finer than the patch is not stored; its texels are weighted sums of the
    patch's pixels.

    Attributes:
        index: (texels, k) int64 positions along the axis, in the level or in the patch.
        weight: (texels, k) float64 weights; rows sum to 1.
    """

    index: Ints
    weight: Array


@dataclass(frozen=True, slots=True, eq=False)
class Pyramid:
    """How the texels of all mip levels of a patch's texture are stored in one array, for patches of one size.

    The array begins with the patch's own pixels, row by row. The levels that are coarser than the patch follow, each
    row by row. Finer levels are not stored; their texels are weighted sums of the patch's pixels.

    Attributes:
        height_px, width_px: size of the patch.
        halving: rule by which a level with an odd number of texels is halved.
        rows, columns: for each level, from the finest on, the matrices that compute its rows and columns from the
            patch: level = rows @ patch @ columns.T.
        folded: number of the finest levels that are not stored.
        starts: for each level, the position of its first texel in the array; 0 (the patch) for levels that are not
            stored.
        size: number of texels in the array.
    """

    height_px: int
    width_px: int
    halving: Halving
    rows: tuple[Array, ...]
    columns: tuple[Array, ...]
    folded: int
    starts: tuple[int, ...]
    size: int

    @property
    def levels(self) -> int:
        """The number of mip levels."""
        return len(self.starts)

    def shape(self, level: int) -> tuple[int, int]:
        """Returns (rows, columns) of mip level `level` in texels. Level 0 is the full texture of the surface; the
        last level is the coarsest.
        """
        return self.rows[level].shape[0], self.columns[level].shape[0]

    def reads(self, level: int) -> tuple[Reads, Reads, int]:
        """Says how the texels of a mip level are read from the array that `spread` returns.

        Args:
            level: the mip level; 0 is the finest.

        Returns:
            The reads along the rows and along the columns, and the stride: how many texels each stored row has. The
                texel at (row, column) of the array's part is at `starts[level] + row * stride + column`.
        """
        if level < self.folded:
            return _nonzero(self.rows[level]), _nonzero(self.columns[level]), self.width_px
        height, width = self.shape(level)
        return _identity(height), _identity(width), width

    def spread(self, patch: Tensor) -> Tensor:
        """Computes the texels of all mip levels in one array; differentiable.

        Args:
            patch: (..., 3, h, w) patch of the pyramid's size, as weights in 0..1: sRGB values, or the light of these
                values.

        Returns:
            (..., size, 3) texels: the patch, then the coarser levels, row by row, in the order of `starts`.
        """
        import torch

        levels = [patch]
        for level in range(self.folded, self.levels):
            levels.append(self._next(levels[-1], patch, level))
        return torch.cat([texels.flatten(-2) for texels in levels], dim=-1).transpose(-1, -2).contiguous()

    def _is_patch(self, level: int) -> bool:
        """Whether a level that is not computed has texels equal to the patch's pixels.

        An equal size is not enough: 37 rows that are enlarged to 600 and halved to 37 again are mixed.
        """
        return self.shape(level) == (self.height_px, self.width_px) and all(
            bool((matrix.diagonal() == 1).all()) for matrix in (self.rows[level], self.columns[level])
        )

    def _next(self, last: Tensor, patch: Tensor, level: int) -> Tensor:
        """The texels of a mip level, computed from the previous level, or from the patch for the first computed
        level.
        """
        import torch

        size = tuple(last.shape[-2:])
        is_chained = level > self.folded or (level > 0 and self._is_patch(level - 1))
        if is_chained and size[0] % 2 == 0 and size[1] % 2 == 0:
            return torch.nn.functional.avg_pool2d(last, 2)
        if is_chained:
            matrices = halving_matrix(size[0], self.halving), halving_matrix(size[1], self.halving)
        else:
            last, matrices = patch, (self.rows[level], self.columns[level])
        rows, columns = (torch.tensor(m, dtype=patch.dtype, device=patch.device) for m in matrices)
        return rows @ last @ columns.T


@lru_cache(maxsize=16)
def pyramid_of(height_px: int, width_px: int, halving: Halving = "middles") -> Pyramid:
    """Returns the mip levels for patches of one size; cached.

    Args:
        height_px, width_px: size of the patches.
        halving: rule by which a level with an odd number of texels is halved, see `Halving`.
    """
    rows = list(axis_matrices(height_px, FACE_SIZE_PX[1], halving))
    columns = list(axis_matrices(width_px, FACE_SIZE_PX[0], halving))
    levels = max(len(rows), len(columns))
    for matrices in (rows, columns):
        # The shorter axis keeps one texel while the longer one is halved further.
        matrices.extend(matrices[-1:] * (levels - len(matrices)))
    sizes = [(r.shape[0], c.shape[0]) for r, c in zip(rows, columns, strict=True)]
    folded = sum(r >= height_px and c >= width_px for r, c in sizes)
    starts, size = [], height_px * width_px
    for level, (height, width) in enumerate(sizes):
        starts.append(0 if level < folded else size)
        size += 0 if level < folded else height * width
    return Pyramid(
        height_px=height_px,
        width_px=width_px,
        halving=halving,
        rows=tuple(rows),
        columns=tuple(columns),
        folded=folded,
        starts=tuple(starts),
        size=size,
    )


def _nonzero(matrix: Array) -> Reads:
    """The nonzero entries of each row of a matrix, as reads; shorter rows are padded with weights of zero."""
    most = int((matrix > 0).sum(axis=1).max())
    index = np.argsort(-matrix, axis=1, kind="stable")[:, :most]
    return Reads(index=index, weight=np.take_along_axis(matrix, index, axis=1))


def _identity(size: int) -> Reads:
    return Reads(index=np.arange(size)[:, None], weight=np.ones((size, 1)))
