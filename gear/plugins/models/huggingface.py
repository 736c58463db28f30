"""Networks of Hugging Face's `transformers` from a local folder: segmentation, depth, 2D detection."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Recipe
from gear.contracts.specs import ModelSpec
from gear.nn.huggingface_options import DepthFolderOptions, DetectorFolderOptions, FolderOptions

if TYPE_CHECKING:
    from gear.nn.huggingface import FolderDepth, FolderDetector, FolderSegmenter

NORMALISATION = "as the folder's image processor says, ImageNet's without one"
RECIPE = Recipe(learning_rate=6e-5, weight_decay=1e-2, batch=8, epochs=20, gradient_norm=1.0)


def build_semseg(options: FolderOptions) -> FolderSegmenter:
    """SegFormer and its like."""
    from gear.nn.huggingface import FolderSegmenter
    from gear.nn.huggingface_folder import open_folder

    return FolderSegmenter(open_folder(options, "AutoModelForSemanticSegmentation"), options)


def build_depth(options: DepthFolderOptions) -> FolderDepth:
    """GLPN, Depth Anything and their like."""
    from gear.nn.huggingface import FolderDepth
    from gear.nn.huggingface_folder import open_folder

    return FolderDepth(open_folder(options, "AutoModelForDepthEstimation"), options)


def build_detect2d(options: DetectorFolderOptions) -> FolderDetector:
    """DETR, RT-DETR and their like."""
    from gear.nn.huggingface import FolderDetector
    from gear.nn.huggingface_folder import open_folder

    return FolderDetector(open_folder(options, "AutoModelForObjectDetection"), options)


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
    tasks=("semseg",),
    **COMMON,
)

depth: ModelSpec[DepthFolderOptions] = ModelSpec(
    name="huggingface_depth",
    summary="Any depth network of transformers from a local folder: GLPN, Depth Anything, DPT, ZoeDepth.",
    config=DepthFolderOptions,
    build=build_depth,
    tasks=("depth",),
    **COMMON,
)

detect2d: ModelSpec[DetectorFolderOptions] = ModelSpec(
    name="huggingface_detect2d",
    summary="Any object detector of transformers from a local folder: DETR, RT-DETR, YOLOS.",
    config=DetectorFolderOptions,
    build=build_detect2d,
    tasks=("detect2d",),
    **COMMON,
)


@hookimpl
def gear_models() -> list[ModelSpec[Any]]:
    """One for each task."""
    return [semseg, depth, detect2d]
