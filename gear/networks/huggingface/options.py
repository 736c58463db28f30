"""Options of networks of Hugging Face. The module does not import torch, so plugin specs load quickly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gear.networks.options import NetworkOptions
from gear.values.errors import FieldError

FOLDER = "folder"


@dataclass(frozen=True, slots=True, kw_only=True)
class FolderOptions(NetworkOptions):
    """Options of a network from a local folder. They include the options of `NetworkOptions`.

    Attributes:
        folder: folder written by `save_pretrained`, with config.json, model.safetensors and, optionally,
            preprocessor_config.json. Nothing is downloaded. Pickles and code in the folder are not run.
        weights: `folder` for the weights in the folder, `none` for random weights drawn with `seed`, or the path of a
            safetensors file that gear has trained.
        input_size: `processor` resizes pictures as the folder's image processor does; `picture` keeps their size, apart
            from what the network requires.
    """

    folder: str = ""
    weights: str = FOLDER
    input_size: Literal["processor", "picture"] = "processor"


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthFolderOptions(FolderOptions):
    """Options of a depth network from a local folder. They include the options of `FolderOptions`.

    Attributes:
        inverse_scale: for networks of relative depth, whose output is an inverse depth without unit: depth in metres is
            1 / (inverse_scale * output + inverse_shift). 0 for networks of metric depth, whose output is in metres.
        inverse_shift: the shift in that formula, 1/m.
    """

    inverse_scale: float = 0.0
    inverse_shift: float = 0.0

    def __post_init__(self) -> None:
        if self.inverse_scale < 0:
            raise FieldError("inverse_scale", f"must not be negative, got {self.inverse_scale:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorFolderOptions(FolderOptions):
    """Options of a detector from a local folder. They include the options of `FolderOptions`.

    Attributes:
        score_threshold: smallest score, 0..1, of a detection that is reported.
    """

    score_threshold: float = 0.05

    def __post_init__(self) -> None:
        if not 0 <= self.score_threshold <= 1:
            raise FieldError("score_threshold", f"must be 0 to 1, got {self.score_threshold:g}")
