"""Networks of Hugging Face's `transformers` from a local folder: segmentation, depth, 2D detection."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Recipe
from gear.contracts.specs import ModelSpec
from gear.networks.huggingface.options import DepthFolderOptions, DetectorFolderOptions, FolderOptions

if TYPE_CHECKING:
    from gear.networks.huggingface.network import FolderDepth, FolderDetector, FolderSegmenter

SEGMENTER = "AutoModelForSemanticSegmentation"
DEPTH = "AutoModelForDepthEstimation"
DETECTOR = "AutoModelForObjectDetection"
"""Names of the classes in transformers that load segmentation, depth and detection networks."""

NORMALISATION = "as the folder's image processor says, ImageNet's without one"
RECIPE = Recipe(learning_rate=6e-5, weight_decay=1e-2, batch=8, epochs=20, gradient_norm=1.0)


def build_semseg(options: FolderOptions) -> FolderSegmenter:
    """Builds a semantic segmentation network, such as SegFormer, from a local Hugging Face folder.

    Args:
        options: options of the network, such as the folder and the device.
    """
    from gear.networks.huggingface.folder import open_folder
    from gear.networks.huggingface.network import FolderSegmenter

    return FolderSegmenter(open_folder(options, SEGMENTER), options)


def build_depth(options: DepthFolderOptions) -> FolderDepth:
    """Builds a depth network, such as GLPN or Depth Anything, from a local Hugging Face folder.

    Args:
        options: options of the network, such as the folder and the device.
    """
    from gear.networks.huggingface.folder import open_folder
    from gear.networks.huggingface.network import FolderDepth

    return FolderDepth(open_folder(options, DEPTH), options)


def build_detect2d(options: DetectorFolderOptions) -> FolderDetector:
    """Builds a 2D detector, such as DETR or RT-DETR, from a local Hugging Face folder.

    Args:
        options: options of the network, such as the folder and the device.
    """
    from gear.networks.huggingface.folder import open_folder
    from gear.networks.huggingface.network import FolderDetector

    return FolderDetector(open_folder(options, DETECTOR), options)


def _start(auto: str) -> Mapping[str, Callable[[Any], None]]:
    """The starting point `folder` of `gear train --init folder`, which loads the weights in the folder."""

    def begin(model: Any) -> None:
        from gear.networks.huggingface.folder import start_from

        start_from(model, auto)

    return {"folder": begin}


COMMON: dict[str, Any] = {
    "views": ("left",),
    "recipe": RECIPE,
    "normalisation": NORMALISATION,
    "needs": ("transformers",),
}

semseg: ModelSpec[FolderOptions] = ModelSpec(
    name="huggingface_semseg",
    summary="Any semantic segmentation network of transformers from a local folder: SegFormer, UPerNet, BEiT.",
    config=FolderOptions,
    build=build_semseg,
    starts=_start(SEGMENTER),
    tasks=("semseg",),
    **COMMON,
)

depth: ModelSpec[DepthFolderOptions] = ModelSpec(
    name="huggingface_depth",
    summary="Any depth network of transformers from a local folder: GLPN, Depth Anything, DPT, ZoeDepth.",
    config=DepthFolderOptions,
    build=build_depth,
    starts=_start(DEPTH),
    tasks=("depth",),
    **COMMON,
)

detect2d: ModelSpec[DetectorFolderOptions] = ModelSpec(
    name="huggingface_detect2d",
    summary="Any object detector of transformers from a local folder: DETR, RT-DETR, YOLOS.",
    config=DetectorFolderOptions,
    build=build_detect2d,
    starts=_start(DETECTOR),
    tasks=("detect2d",),
    **COMMON,
)


@hookimpl
def gear_models() -> list[ModelSpec[Any]]:
    """Hook of the plugin system: returns the three model plugins that this module defines, one for each task."""
    return [semseg, depth, detect2d]
