"""What the three adapters have in common: folder, image processor, gear's `Model` protocol, names of classes."""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gear.networks import torchvision_import
from gear.networks.huggingface.labels import match
from gear.networks.runtime import device_of
from gear.values.errors import GearError
from gear.values.frames import UInt8Image
from torch import Tensor, nn

from gear_model_transformers import FolderConfig, LabelledConfig

VIEW = "left"

logger = logging.getLogger(__name__)


class FolderModel(nn.Module, ABC):
    """A network from a folder with gear's `Model` protocol.

    Attributes:
        network: of transformers.
        processor: its image processor.
    """

    def __init__(self, config: FolderConfig, *kinds: str) -> None:
        """Opens the folder with the first of these classes of transformers that knows the network."""
        super().__init__()
        self.device = device_of(config.device)
        self.network, self.processor = open_folder(Path(config.folder), kinds)
        self.to(self.device).eval()

    def predict(self, views: Mapping[str, UInt8Image]) -> Any:
        """The task's prediction for one sample."""
        picture = torch.from_numpy(np.ascontiguousarray(views[VIEW].transpose(2, 0, 1)))[None]
        with torch.inference_mode():
            return self.answer(picture.to(self.device).float() / 255)

    def forward(self, views: Mapping[str, Tensor], targets: Sequence[Any] | None = None) -> Mapping[str, Tensor]:
        """Outputs of a batch of (B, 3, H, W) pictures in 0..1, or losses where the batch's samples are given."""
        pictures = views[VIEW].to(self.device)
        return self.outputs(pictures) if targets is None else self.losses(pictures, targets)

    def taps(self) -> Mapping[str, nn.Module]:
        """No feature maps, since every family names its layers differently."""
        return {}

    def seen(self, pictures: Tensor) -> Mapping[str, Tensor]:
        """Inputs of the network: the pictures resized and normalised, and whatever else its family needs."""
        features: Mapping[str, Tensor] = self.processor(images=pictures * 255, return_tensors="pt")
        return features

    @abstractmethod
    def outputs(self, pictures: Tensor) -> Mapping[str, Tensor]:
        """Outputs of a batch by name."""

    @abstractmethod
    def losses(self, pictures: Tensor, targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """Losses of a batch by name."""

    @abstractmethod
    def answer(self, picture: Tensor) -> Any:
        """The task's prediction for a batch of one."""


def open_folder(folder: Path, kinds: Sequence[str]) -> tuple[nn.Module, Any]:
    """The network and the image processor of a folder, without network access and without pickles.

    Raises:
        GearError: something is missing, or the network is of another kind.
    """
    if not (folder / "config.json").is_file():
        raise GearError(f"folder {str(folder)!r} has no config.json; set folder to what save_pretrained wrote")
    # Before transformers: its image processors import torchvision, which may not fit this torch.
    torchvision_import.need()
    import transformers

    transformers.utils.logging.disable_progress_bar()
    # What a folder brings along as code is never run: it would be anybody's.
    local: dict[str, Any] = {"local_files_only": True, "trust_remote_code": False}
    problem = ""
    for kind in kinds:
        try:
            network, found = getattr(transformers, kind).from_pretrained(
                folder, use_safetensors=True, output_loading_info=True, dtype=torch.float32, **local
            )
            if found["missing_keys"]:  # transformers would make them up: a classifier has no head that says depth
                problem = problem or f"{len(found['missing_keys'])} weights of {type(network).__name__} are not there"
                continue
            processor: Any = transformers.AutoImageProcessor.from_pretrained(folder, **local)
        except (OSError, ValueError, TypeError, KeyError, AttributeError, RuntimeError) as error:
            problem = problem or str(error).partition("\n")[0]
        else:
            return network, processor
    wanted = " or ".join(kind.removeprefix("AutoModelFor") for kind in kinds)
    raise GearError(f"{folder}: no network for {wanted}: {problem}")


def numbers_of_classes(network: nn.Module, known: Mapping[str, int], config: LabelledConfig) -> dict[int, int]:
    """The task's class numbers by those of the network, for classes that both have.

    Args:
        network: one with classes.
        known: the task's numbers by name.
        config: states which further names are equal.

    Raises:
        GearError: nothing matches, or `classes` has a name that the network or the task lacks.
    """
    own: Any = network.config
    names = {int(index): name for index, name in own.id2label.items()}
    for theirs, ours in config.classes.items():
        if theirs not in names.values():
            raise GearError(f"classes: the network has no {theirs!r}; it has {', '.join(names.values())}")
        if ours not in known:
            raise GearError(f"classes: the task has no {ours!r}; it has {', '.join(known)}")
    found, unmatched = match({index: config.classes.get(name, name) for index, name in names.items()}, known)
    if not found:
        raise GearError(f"{config.folder}: set classes; the task has none of {', '.join(names.values())}")
    if unmatched:
        logger.info("%s: left out, because the task has no such class: %s", config.folder, ", ".join(unmatched))
    return found
