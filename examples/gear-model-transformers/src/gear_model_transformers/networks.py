"""The adapters: pictures in 0..1 to what the network wants, and its answers to what the task wants."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
import transformers
from gear.formats import cityscapes, coco
from gear.values.errors import GearError
from gear.values.frames import UInt8Image
from torch import Tensor, nn
from torch.nn import functional

if TYPE_CHECKING:
    from gear_model_transformers import FolderConfig

VIEW = "left"
IGNORED = 255
IMAGENET = ((0.485, 0.456, 0.406), (0.229, 0.224, 0.225))


class Network(ABC):
    """One network of a folder behind gear's `Model` protocol."""

    def __init__(self, network: nn.Module, config: FolderConfig) -> None:
        self.network = network.eval()
        self.config = config
        mean, std = normalisation(Path(config.folder))
        self._mean, self._std = torch.tensor(mean).view(1, 3, 1, 1), torch.tensor(std).view(1, 3, 1, 1)

    def predict(self, views: Mapping[str, UInt8Image]) -> Any:
        """The task's prediction for one sample."""
        picture = torch.from_numpy(views[VIEW].copy()).permute(2, 0, 1)[None].float() / 255
        with torch.no_grad():
            return self.answer(self.forward({VIEW: picture}), views[VIEW].shape[0], views[VIEW].shape[1])

    def forward(self, views: Mapping[str, Tensor], targets: Sequence[Any] | None = None) -> Mapping[str, Tensor]:
        """Outputs of a batch of (B, 3, H, W) pictures in 0..1, or losses where the batch's samples are given."""
        pixels = (views[VIEW] - self._mean) / self._std
        return self.outputs(pixels) if targets is None else self.losses(pixels, targets)

    def taps(self) -> Mapping[str, nn.Module]:
        """None: every family names its layers otherwise."""
        return {}

    def labels(self) -> dict[int, str]:
        """Names of the network's own classes."""
        config: Any = self.network.config
        return {int(key): name.casefold() for key, name in config.id2label.items()}

    @abstractmethod
    def outputs(self, pixels: Tensor) -> Mapping[str, Tensor]:
        """Named outputs of a normalised batch."""

    @abstractmethod
    def losses(self, pixels: Tensor, targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """Losses of a normalised batch and its samples."""

    @abstractmethod
    def answer(self, outputs: Mapping[str, Tensor], height_px: int, width_px: int) -> Any:
        """The task's prediction from the outputs of a batch of one."""


class Segmenter(Network):
    """`logits` over the network's own classes, which are matched with Cityscapes' by name."""

    def __init__(self, network: nn.Module, config: FolderConfig) -> None:
        super().__init__(network, config)
        ids = {label.name: label.id for label in cityscapes.LABELS}
        names = self.labels()
        if not set(names.values()) & set(ids):
            raise GearError(f"{config.folder}: none of its classes is one of Cityscapes' ({', '.join(names.values())})")
        self._label_ids = np.array([ids.get(names[i], 0) for i in range(len(names))], np.uint8)
        self._classes = torch.full((len(ids),), IGNORED)
        for index, label_id in enumerate(self._label_ids.tolist()):
            if label_id:
                self._classes[label_id] = index

    def outputs(self, pixels: Tensor) -> Mapping[str, Tensor]:
        """At the picture's size."""
        logits = self.network(pixel_values=pixels).logits
        size = (pixels.shape[2], pixels.shape[3])
        return {"logits": functional.interpolate(logits, size=size, mode="bilinear", align_corners=False)}

    def losses(self, pixels: Tensor, targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """Cross-entropy over the classes that both know."""
        labels = self._classes[torch.from_numpy(np.stack([sample.label_ids for sample in targets])).long()]
        each = functional.cross_entropy(self.outputs(pixels)["logits"], labels, ignore_index=IGNORED, reduction="sum")
        return {"cross_entropy": each / (labels != IGNORED).sum().clamp_min(1)}

    def answer(self, outputs: Mapping[str, Tensor], height_px: int, width_px: int) -> Any:
        """(H, W) uint8 label ids."""
        return self._label_ids[outputs["logits"][0].argmax(0).numpy()]


class Depth(Network):
    """`depth_m` at the picture's size; networks of relative depth are the caller's to scale."""

    def outputs(self, pixels: Tensor) -> Mapping[str, Tensor]:
        """(B, H, W) metres."""
        depth = self.network(pixel_values=pixels).predicted_depth
        size = (pixels.shape[2], pixels.shape[3])
        return {
            "depth_m": functional.interpolate(depth[:, None], size=size, mode="bilinear", align_corners=False)[:, 0]
        }

    def losses(self, pixels: Tensor, targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """Smooth L1 where the truth is known."""
        truth = torch.from_numpy(np.stack([sample.depth_m for sample in targets]))
        known = torch.isfinite(truth)
        error = functional.smooth_l1_loss(self.outputs(pixels)["depth_m"], torch.nan_to_num(truth), reduction="none")
        return {"smooth_l1": (error * known).sum() / known.sum().clamp_min(1)}

    def answer(self, outputs: Mapping[str, Tensor], height_px: int, width_px: int) -> Any:
        """(H, W) float32 metres."""
        return np.maximum(outputs["depth_m"][0].numpy(), np.float32(1e-3))


class Detector(Network):
    """`logits` and `pred_boxes` of a DETR-like network, whose classes are matched with COCO's by name."""

    def __init__(self, network: nn.Module, config: FolderConfig) -> None:
        super().__init__(network, config)
        ids = {str(one["name"]): int(one["id"]) for one in coco.CATEGORIES}
        self._category_ids = {index: ids[name] for index, name in self.labels().items() if name in ids}
        if not self._category_ids:
            raise GearError(f"{config.folder}: none of its classes is one of COCO's")

    def outputs(self, pixels: Tensor) -> Mapping[str, Tensor]:
        """(B, N, classes + 1) logits and (B, N, 4) boxes: centre and size, of the picture's."""
        out = self.network(pixel_values=pixels)
        return {"logits": out.logits, "pred_boxes": out.pred_boxes}

    def losses(self, pixels: Tensor, targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """The network's own set loss."""
        index_of = {category: index for index, category in self._category_ids.items()}
        size = torch.tensor([pixels.shape[3], pixels.shape[2]] * 2, dtype=torch.float32)
        labels = []
        for sample in targets:
            things = [t for t in sample.objects if not t.is_ignored and t.category_id in index_of]
            corners = torch.tensor([t.box_px for t in things], dtype=torch.float32).reshape(-1, 4) / size
            boxes = torch.cat([(corners[:, :2] + corners[:, 2:]) / 2, corners[:, 2:] - corners[:, :2]], dim=1)
            classes = torch.tensor([index_of[t.category_id] for t in things], dtype=torch.long)
            labels.append({"class_labels": classes, "boxes": boxes})
        return {"set_loss": self.network(pixel_values=pixels, labels=labels).loss}

    def answer(self, outputs: Mapping[str, Tensor], height_px: int, width_px: int) -> Any:
        """Every sure enough box of a class that COCO knows."""
        scores, classes = outputs["logits"][0].softmax(-1)[:, :-1].max(-1)
        found = []
        for score, index, box in zip(scores.tolist(), classes.tolist(), outputs["pred_boxes"][0].tolist(), strict=True):
            if index in self._category_ids and score >= self.config.least_score:
                x, y, w, h = box[0] * width_px, box[1] * height_px, box[2] * width_px, box[3] * height_px
                edges = (x - w / 2, y - h / 2, x + w / 2, y + h / 2)
                found.append(coco.Detection(category_id=self._category_ids[index], box_px=edges, score=score))
        return tuple(found)


KINDS: dict[str, tuple[type[Network], str]] = {
    "semseg": (Segmenter, "AutoModelForSemanticSegmentation"),
    "depth": (Depth, "AutoModelForDepthEstimation"),
    "detect2d": (Detector, "AutoModelForObjectDetection"),
}


def open_network(task: str, config: FolderConfig) -> Network:
    """Opens the network of a folder, without the net and without pickles.

    Raises:
        GearError: there is no such network in the folder.
    """
    folder = Path(config.folder)
    if not config.folder or not (folder / "config.json").is_file():
        raise GearError(f"folder {config.folder!r} has no config.json; set folder to what save_pretrained wrote")
    adapter, auto = KINDS[task]
    try:
        network = getattr(transformers, auto).from_pretrained(folder, local_files_only=True, use_safetensors=True)
    except (OSError, ValueError) as error:
        raise GearError(f"{folder}: not a {task} network: {str(error).splitlines()[0]}") from error
    return adapter(network, config)


def normalisation(folder: Path) -> tuple[Sequence[float], Sequence[float]]:
    """Mean and deviation of each channel, from the folder's image processor, ImageNet's without one."""
    path = folder / "preprocessor_config.json"
    facts = json.loads(path.read_text()) if path.is_file() else {}
    if not facts.get("do_normalize", True):
        return (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
    return facts.get("image_mean", IMAGENET[0]), facts.get("image_std", IMAGENET[1])
