"""Products of constant sparse matrices with dense ones, differentiable with respect to the dense matrix."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor


@dataclass(frozen=True, slots=True, eq=False)
class SparseMatrix:
    """A constant sparse matrix for differentiable products, with its transpose for gradients; CSR format.

    Attributes:
        forward: (N, M) sparse CSR.
        backward: (M, N) sparse CSR, the transpose.
    """

    forward: Tensor
    backward: Tensor

    @staticmethod
    def of(matrix: Any, device: torch.device) -> SparseMatrix:
        """Converts a SciPy CSR matrix of float32 and puts it, with its transpose, on a torch device.

        Args:
            matrix: (N, M) SciPy CSR matrix; its indices are sorted in place.
            device: torch device of the result.
        """
        return SparseMatrix(_csr(matrix, device), _csr(matrix.T.tocsr(), device))

    @property
    def nbytes(self) -> int:
        """The memory of both matrices in bytes."""
        parts = [m for csr in (self.forward, self.backward) for m in (csr.crow_indices(), csr.col_indices())]
        return sum(p.nbytes for p in parts) + 2 * int(self.forward.values().nbytes)


def stacked_product(matrices: Sequence[SparseMatrix], dense: Tensor) -> Tensor:
    """Products of several sparse matrices with one dense matrix, stacked vertically.

    Args:
        matrices: matrices (N_i, M).
        dense: (M, k) float32; the result is differentiable with respect to it.

    Returns:
        (sum of N_i, k) float32.
    """
    product: Tensor = _Product.apply(dense, matrices)  # type: ignore[no-untyped-call]
    return product


class _Product(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, dense: Tensor, matrices: Sequence[SparseMatrix]) -> Tensor:
        ctx.matrices = matrices
        return torch.cat([torch.sparse.mm(matrix.forward, dense) for matrix in matrices])

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None]:
        sizes = [matrix.forward.shape[0] for matrix in ctx.matrices]
        parts = gradients[0].split(sizes)  # type: ignore[no-untyped-call]
        total = torch.sparse.mm(ctx.matrices[0].backward, parts[0].contiguous())
        for matrix, part in zip(ctx.matrices[1:], parts[1:], strict=True):
            total += torch.sparse.mm(matrix.backward, part.contiguous())
        return total, None


def _csr(matrix: Any, device: torch.device) -> Tensor:
    matrix.sort_indices()
    with warnings.catch_warnings():
        # Hides torch's warning that sparse CSR tensors are in beta.
        warnings.filterwarnings("ignore", "Sparse", UserWarning)
        return torch.sparse_csr_tensor(
            torch.from_numpy(matrix.indptr.astype(np.int32)),
            torch.from_numpy(matrix.indices.astype(np.int32)),
            torch.from_numpy(matrix.data.astype(np.float32)),
            size=matrix.shape,
        ).to(device)
