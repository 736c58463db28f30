"""Makes torchvision importable next to a build of torch for which it was not compiled.

torchvision's wheels are linked with CUDA. With the CPU build of torch their compiled operators do not load. Then
neither torchvision can be imported nor packages that import it: timm, and most of transformers. `prepare` defines the
operators that detectors need and imports torchvision with them. If the builds fit, `prepare` only imports torchvision.
Call `prepare` before importing torchvision, timm or transformers.
"""

from __future__ import annotations

import functools
import importlib
import importlib.util
import sys
from typing import Any

import torch

from gear.networks import torchvision_ops
from gear.values.errors import GearError

NAME = "torchvision"

SCHEMAS = (
    "nms(Tensor dets, Tensor scores, float iou_threshold) -> Tensor",
    "qnms(Tensor dets, Tensor scores, float iou_threshold) -> Tensor",
    "roi_align(Tensor input, Tensor rois, float spatial_scale, SymInt pooled_height, SymInt pooled_width, "
    "int sampling_ratio, bool aligned) -> Tensor",
)
"""Declarations of torchvision's operators, copied from torchvision. `qnms` (for quantised boxes) is declared
without an implementation.
"""

_libraries: list[torch.library.Library] = []


@functools.cache
def prepare() -> bool:
    """Makes torchvision importable; further calls in a process do nothing.

    If torchvision does not fit the build of torch, deformable convolution and position-sensitive pooling stay
    undefined.

    Returns:
        True if torchvision is installed.

    Raises:
        ImportError, RuntimeError: torchvision cannot be imported for another reason.
    """
    if importlib.util.find_spec(NAME) is None:
        return False
    try:
        importlib.import_module(NAME)
    except RuntimeError as error:
        if f"{NAME}::nms" not in str(error):
            raise
        _define_operators()
        _import_again()
    return True


def need() -> None:
    """Makes torchvision importable, as `prepare` does, for code that cannot run without torchvision.

    Raises:
        GearError: torchvision is not installed.
    """
    if not prepare():
        raise GearError(
            "this network needs torchvision: pip install 'mujoco-gear[models]', with the versions of constraints.txt"
        )


def _define_operators() -> None:
    library: Any = torch.library.Library(NAME, "DEF")  # type: ignore[no-untyped-call]
    for schema in SCHEMAS:
        library.define(schema)
    library.impl("nms", torchvision_ops.nms, "CompositeExplicitAutograd")
    library.impl("roi_align", torchvision_ops.roi_align, "CompositeImplicitAutograd")
    _libraries.append(library)  # operators exist as long as their library object


def _import_again() -> None:
    for name in [name for name in sys.modules if name.split(".")[0] == NAME]:
        del sys.modules[name]
    importlib.import_module(NAME)
    # torchvision calls `_has_ops` before every use of an operator. During the import it had to return False; otherwise
    # torchvision would have registered gradients for operators that do not exist.
    for module in (f"{NAME}.extension", f"{NAME}.ops.roi_align"):
        sys.modules[module].__dict__["_has_ops"] = lambda: True
