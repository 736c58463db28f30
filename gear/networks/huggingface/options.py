"""Options of networks of Hugging Face's. No torch here: specs are cheap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gear.networks.options import NetworkOptions
from gear.values.errors import FieldError

FOLDER = "folder"


@dataclass(frozen=True, slots=True, kw_only=True)
class FolderOptions(NetworkOptions):
    """Options of a network from a local folder.

    Attributes:
        folder: where `save_pretrained` wrote it: config.json, model.safetensors and, where there is one,
            preprocessor_config.json. Nothing is downloaded, and neither a pickle nor code of the folder's own is run.
        weights: `folder` are the folder's own, `none` are random ones from `seed`, anything else is the path of a
            safetensors file that gear has trained.
        input_size: `processor` resizes pictures as the folder's image processor says, `picture` leaves them as they
            are, but for what the network needs.
    """

    folder: str = ""
    weights: str = FOLDER
    input_size: Literal["processor", "picture"] = "processor"


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthFolderOptions(FolderOptions):
    """Options of a depth network from a local folder.

    Attributes:
        inverse_scale: networks of relative depth say how near things are in units of their own; depth in metres is
            1 / (inverse_scale * what they say + inverse_shift). 0 for networks of metric depth, which say metres.
        inverse_shift: see there, in 1/m.
    """

    inverse_scale: float = 0.0
    inverse_shift: float = 0.0

    def __post_init__(self) -> None:
        if self.inverse_scale < 0:
            raise FieldError("inverse_scale", f"must not be negative, got {self.inverse_scale:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorFolderOptions(FolderOptions):
    """Options of a detector from a local folder.

    Attributes:
        least_score: detections that are less sure are dropped.
    """

    least_score: float = 0.05

    def __post_init__(self) -> None:
        if not 0 <= self.least_score <= 1:
            raise FieldError("least_score", f"must be 0 to 1, got {self.least_score:g}")
