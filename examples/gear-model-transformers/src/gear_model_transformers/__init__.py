"""Any segmentation, depth or detection network of Hugging Face's transformers, from a local folder."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model
from gear.contracts.specs import ModelSpec
from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class FolderConfig:
    """Options of every network from a folder.

    Attributes:
        folder: what `save_pretrained` wrote, or a downloaded repository: config.json, safetensors and
            preprocessor_config.json. Nothing is downloaded, and no pickle is opened.
        device: `auto` takes a GPU where there is one.
    """

    folder: str = ""
    device: Literal["auto", "cpu", "cuda"] = "auto"


@dataclass(frozen=True, slots=True, kw_only=True)
class LabelledConfig(FolderConfig):
    """Options of a network with classes.

    Attributes:
        classes: the task's names of the network's classes, by the network's names: `{tarmac: road}`. Classes with equal
            names and usual synonyms need no entry; classes without a match are left out.
    """

    classes: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorConfig(LabelledConfig):
    """Options of a detector.

    Attributes:
        score_threshold: smallest score, 0..1, of a detection that is reported.
    """

    score_threshold: float = 0.05

    def __post_init__(self) -> None:
        if not 0 <= self.score_threshold <= 1:
            raise FieldError("score_threshold", f"must be 0 to 1, got {self.score_threshold:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthConfig(FolderConfig):
    """Options of a depth network.

    Attributes:
        inverse_scale: for networks of relative depth, whose output is an inverse depth without unit: depth in metres is
            1 / (inverse_scale * output + inverse_shift). 0 for networks whose output is in metres.
        inverse_shift: see `inverse_scale`, in 1/m.
    """

    inverse_scale: float = 0.0
    inverse_shift: float = 0.0

    def __post_init__(self) -> None:
        if self.inverse_scale < 0:
            raise FieldError("inverse_scale", f"must not be negative, got {self.inverse_scale:g}")


def build_semseg(config: LabelledConfig) -> Model:
    """A semantic segmentation network. torch and transformers are imported here, so that listing plugins stays
    quick.
    """
    from gear_model_transformers.segmentation import Segmenter

    return Segmenter(config)


def build_depth(config: DepthConfig) -> Model:
    """A depth network from a folder."""
    from gear_model_transformers.depth import DepthNetwork

    return DepthNetwork(config)


def build_detect2d(config: DetectorConfig) -> Model:
    """A detector from a folder."""
    from gear_model_transformers.detection import Detector

    return Detector(config)


COMMON: dict[str, Any] = {
    "views": ("left",),
    "normalisation": "as the folder's image processor does it",
    "needs": ("transformers", "torchvision"),
}

semseg: ModelSpec[LabelledConfig] = ModelSpec(
    name="transformers_semseg",
    summary="A segmentation network of transformers from a local folder: SegFormer, UPerNet, MaskFormer, Mask2Former.",
    config=LabelledConfig,
    build=build_semseg,
    tasks=("semseg",),
    **COMMON,
)

depth: ModelSpec[DepthConfig] = ModelSpec(
    name="transformers_depth",
    summary="A depth network of transformers from a local folder: GLPN, DPT, Depth Anything, ZoeDepth, Depth Pro.",
    config=DepthConfig,
    build=build_depth,
    tasks=("depth",),
    **COMMON,
)

detect2d: ModelSpec[DetectorConfig] = ModelSpec(
    name="transformers_detect2d",
    summary="An object detector of transformers from a local folder: DETR, Deformable DETR, RT-DETR, YOLOS.",
    config=DetectorConfig,
    build=build_detect2d,
    tasks=("detect2d",),
    **COMMON,
)


@hookimpl
def gear_models() -> list[ModelSpec[Any]]:
    """Called by gear, which finds this module through the entry point in pyproject.toml."""
    return [semseg, depth, detect2d]
