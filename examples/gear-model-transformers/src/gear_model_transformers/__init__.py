"""Hugging Face's universal segmentation networks (MaskFormer, Mask2Former) from a local folder."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import ModelSpec
from gear.nn.huggingface_options import FolderOptions

if TYPE_CHECKING:
    from gear_model_transformers.networks import UniversalSegmenter


def build(options: FolderOptions) -> UniversalSegmenter:
    """Imports torch and transformers only when somebody asks for the model."""
    from gear.nn.huggingface import open_folder

    from gear_model_transformers.networks import UniversalSegmenter

    return UniversalSegmenter(open_folder(options, "AutoModelForUniversalSegmentation"), options)


universal = ModelSpec(
    name="transformers_universal",
    summary="A universal segmentation network of transformers from a local folder: MaskFormer, Mask2Former.",
    config=FolderOptions,
    build=build,
    tasks=("semseg",),
    views=("left",),
    needs=("transformers",),
)


@hookimpl
def gear_models() -> list[ModelSpec[FolderOptions]]:
    """Found by gear through the entry point in pyproject.toml."""
    return [universal]
