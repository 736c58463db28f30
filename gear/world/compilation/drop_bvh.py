"""Saves models without the bounding volume hierarchies (BVH) of their meshes.

The BVHs take half of the memory of a town's render model, and only rays use them.
"""

from __future__ import annotations

import contextlib
import ctypes
from collections.abc import Iterator

import mujoco
import numpy as np
import numpy.typing as npt

_TREES = ("bvh_aabb", "bvh_child", "bvh_depth", "bvh_nodeid")
_NBVH, _NBVHSTATIC, _NBUFFER = 7, 8, 97
"""Indices of three of the sizes at the start of MuJoCo's struct `mjModel`. These indices are checked at each use."""

_ALIGNMENT_BYTES = 64
"""Alignment of the arrays of a model."""


@contextlib.contextmanager
def without_mesh_bvh(model: mujoco.MjModel) -> Iterator[None]:
    """Context in which a model has only the BVHs of its bodies. A model that is saved in this context has no BVHs
    of meshes in its file.

    In the loaded model all meshes share one empty box as BVH, so rays miss them. A model with flexes is not changed. A
    model is also not changed if its memory layout differs from that of the MuJoCo release for which this module was
    written.

    Args:
        model: the model; it is changed inside the context and restored at its end.
    """
    sizes, count = _sizes(model), int(np.max(model.body_bvhadr + model.body_bvhnum, initial=0))
    if sizes is None or count >= model.nbvh or model.nflex or not model.nmesh:
        yield
        return
    trees = [getattr(model, name) for name in _TREES]
    kept = sizes.copy(), model.mesh_bvhadr.copy(), model.mesh_bvhnum.copy(), [tree[count].copy() for tree in trees]
    for tree in trees:
        tree[count] = -1 if tree.dtype == np.int32 else 0
    model.mesh_bvhadr[:], model.mesh_bvhnum[:] = count, 1
    sizes[_NBUFFER] -= sum(_padded(tree.nbytes) - _padded(tree[: count + 1].nbytes) for tree in trees)
    sizes[[_NBVH, _NBVHSTATIC]] = count + 1
    try:
        yield
    finally:
        sizes[:], model.mesh_bvhadr[:], model.mesh_bvhnum[:] = kept[:3]
        for tree, row in zip(trees, kept[3], strict=True):
            tree[count] = row


def _sizes(model: mujoco.MjModel) -> npt.NDArray[np.int64] | None:
    """(98,) int64 writable view of a model's sizes in memory; None if the memory layout is not the expected one."""
    address = getattr(model, "_address", None)
    if address is None:
        return None
    sizes = np.ctypeslib.as_array((ctypes.c_int64 * (_NBUFFER + 1)).from_address(address))
    known = {_NBVH: model.nbvh, _NBVHSTATIC: model.nbvhstatic, _NBUFFER: model.nbuffer}
    return sizes if all(sizes[place] == value for place, value in known.items()) else None


def _padded(size_bytes: int) -> int:
    return -(-size_bytes // _ALIGNMENT_BYTES) * _ALIGNMENT_BYTES
