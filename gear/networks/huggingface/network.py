"""Segmentation, depth and detection networks of Hugging Face's `transformers`, opened from a local folder, as gear
networks.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from gear.formats.cityscapes import LABELS
from gear.formats.coco import CATEGORY_NAMES, Detection
from gear.networks.huggingface.folder import in_one_line
from gear.networks.huggingface.labels import match
from gear.networks.huggingface.options import DepthFolderOptions, DetectorFolderOptions, FolderOptions
from gear.networks.huggingface.processor_file import read_processor
from gear.networks.huggingface.set_loss import IGNORED, set_loss
from gear.networks.network import Network
from gear.networks.runtime import autocast
from gear.networks.segmentation.label_maps import best_class
from gear.networks.segmentation.losses import train_ids
from gear.networks.segmentation.network import CLASSES, LABEL_ID_OF_TRAIN_ID
from gear.values.errors import GearError
from gear.values.frames import FloatImage

VIEW = "left"
LOGITS, DEPTH, BOXES, PICTURE = "logits", "depth_m", "pred_boxes", "picture"

UNKNOWN_LOGIT = -50.0
"""Logit of the task's classes that the network does not have; their probability is practically 0."""

NEAREST_M = 1e-3

METRIC_TYPES = ("glpn", "zoedepth")
"""Values of `model_type` of depth networks that always predict metres. The configs of other networks state this in
`depth_estimation_type`.
"""

logger = logging.getLogger(__name__)


class FolderNetwork(Network):
    """Base class of networks of transformers from a local folder. Pictures pass the folder's image processor
    first.

    Attributes:
        unmatched: class names of the network without a counterpart among the task's classes.

    Args:
        graph: the network of transformers, from `gear.networks.huggingface.folder.open_folder`.
        options: options that the user gave, which name the folder.
    """

    options: FolderOptions
    unmatched: tuple[str, ...] = ()

    def __init__(self, graph: nn.Module, options: FolderOptions) -> None:
        super().__init__(graph, options, views=(VIEW,))
        resizes = options.input_size == "processor"
        self.processor = read_processor(Path(options.folder), resizes=resizes, config=graph.config)

    def preprocess(self, pictures: Mapping[str, Tensor]) -> Tensor:
        """Returns the (B, 3, h, w) input of the graph: the pictures after the image processor.

        Args:
            pictures: (B, 3, H, W) picture `left`, float in 0..1.
        """
        return self.processor.apply(pictures[VIEW])

    def run_graph(self, network_input: Tensor, **labels: Any) -> Any:
        """Runs the graph (the network of transformers) and returns its raw output.

        Args:
            network_input: (B, 3, h, w) pictures after the image processor, as the method `preprocess` returns them.
            **labels: labels, for graphs that compute their own losses.

        Raises:
            GearError: the graph fails, for example because sizes in config.json do not fit each other.
        """
        try:
            return self.graph(pixel_values=network_input, **labels)
        except torch.OutOfMemoryError:
            raise
        except (ArithmeticError, AttributeError, LookupError, RuntimeError, TypeError, ValueError) as error:
            raise GearError(
                f"{self.options.folder}: the network does not run on "
                f"{network_input.shape[3]} x {network_input.shape[2]} pixels; check "
                f"config.json and preprocessor_config.json there: {in_one_line(error)}"
            ) from error

    def restored(self, maps: Tensor, pictures: Mapping[str, Tensor], mode: str) -> Tensor:
        """Converts maps over the graph's input to maps over the pictures: the margins are cut off, the rest is
        resized.

        Args:
            maps: (B, C, h, w) output of the graph.
            pictures: the pictures by camera.
            mode: interpolation mode of torch.

        Returns:
            (B, C, H, W) maps of the pictures' height and width.
        """
        size = (int(pictures[VIEW].shape[2]), int(pictures[VIEW].shape[3]))
        return self.processor.restore(maps, size, mode)

    def matched(self, known: Mapping[str, int], whose: str) -> dict[int, int]:
        """Returns the task's class number for each class number of the network, matched by name.

        Names without a match are stored in `unmatched` and logged.

        Args:
            known: the task's class numbers by name.
            whose: name of the task's set of classes, for messages.

        Raises:
            GearError: no name matches, or the network's classes have no names.
        """
        config: Any = self.graph.config
        native: dict[int, str] = config.id2label
        if not all(isinstance(name, str) and 0 <= index < len(native) for index, name in native.items()):
            raise GearError(
                f"{self.options.folder}/config.json: id2label must be names by number, from 0, got {native!r:.80}"
            )
        found, self.unmatched = match(native, known)
        if not found:
            names = ", ".join(self.unmatched[:10])
            raise GearError(f"{self.options.folder}: none of its classes is one of {whose} ({names})")
        if self.unmatched:
            logger.info("%s: %s has no %s", self.options.folder, whose, ", ".join(self.unmatched))
        return found


class FolderSegmenter(FolderNetwork):
    """A semantic segmentation network from a folder: the output is `logits` (B, 19, H, W) over Cityscapes train
    ids.

    If several classes of the network belong to one class of Cityscapes, their probabilities are added. Classes that the
    network does not have get a logit of -50 and do not count in the loss.

    Args:
        graph: the network of transformers.
        options: options that the user gave, which name the folder.
    """

    def __init__(self, graph: nn.Module, options: FolderOptions) -> None:
        super().__init__(graph, options)
        train_id_of = {label.name: label.train_id for label in LABELS if label.is_evaluated}
        found = self.matched(train_id_of, "Cityscapes")
        self._indices = [[i for i, number in found.items() if number == train_id] for train_id in range(CLASSES)]

    def run(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the output `logits` (B, 19, H, W) at the picture's size; channels are in the order of Cityscapes
        train ids.

        Args:
            pictures: (B, 3, H, W) picture `left`, float in 0..1, on the network's device.
        """
        native = self.native_logits(self.preprocess(pictures)).float()
        nothing = torch.full_like(native[:, 0], UNKNOWN_LOGIT)
        ours = [native[:, indices].logsumexp(1) if indices else nothing for indices in self._indices]
        return {LOGITS: self.restored(torch.stack(ours, dim=1), pictures, "bilinear")}

    def native_logits(self, network_input: Tensor) -> Tensor:
        """The (B, classes, h, w) logits over the network's own classes, before they are converted to Cityscapes'
        classes.

        Args:
            network_input: (B, 3, h, w) input of the graph, as the method `preprocess` returns it.
        """
        logits: Tensor = self.run_graph(network_input).logits
        return logits

    def losses(self, outputs: Mapping[str, Tensor], targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """Returns the loss `cross_entropy`: the mean over the pixels whose true class the network has.

        Args:
            outputs: result of `run_for_losses` for a batch of B samples, by name.
            targets: the B samples with their ground truth.
        """
        ids = train_ids(targets, self.device)
        known = torch.tensor([train_id for train_id, indices in enumerate(self._indices) if indices])
        is_known = torch.isin(ids, known.to(self.device))
        each = functional.cross_entropy(outputs[LOGITS], ids.where(is_known, 0), reduction="none")
        return {"cross_entropy": (each * is_known).sum() / is_known.sum().clamp_min(1)}

    def predictions(self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...]) -> Sequence[Any]:
        """The predicted (H, W) uint8 Cityscapes label ids of each picture.

        Args:
            outputs: result of `run_for_predictions` for a batch of B pictures, by name.
            size_px: height and width of the pictures.
        """
        labels = np.array(LABEL_ID_OF_TRAIN_ID, dtype=np.uint8)
        return [labels[best_class(logits)] for logits in outputs[LOGITS]]


class FolderDepth(FolderNetwork):
    """A monocular depth network from a folder: the output is `depth_m` (B, H, W) in metres.

    Args:
        graph: the network of transformers.
        options: options that the user gave, which name the folder.

    Raises:
        GearError: `inverse_scale` does not fit the network's kind of depth, or its greatest depth is no number of
            metres.
    """

    options: DepthFolderOptions

    def __init__(self, graph: nn.Module, options: DepthFolderOptions) -> None:
        super().__init__(graph, options)
        config: Any = graph.config
        metric = config.model_type in METRIC_TYPES or getattr(config, "depth_estimation_type", "") == "metric"
        most_m = getattr(config, "max_depth", None)
        if metric and most_m is not None and not 0 < most_m < math.inf:
            raise GearError(f"{options.folder}/config.json: max_depth must be a number of metres above 0, got {most_m}")
        if metric == bool(options.inverse_scale):
            raise GearError(
                f"{options.folder}: predicts metres; leave inverse_scale at 0"
                if metric
                else f"{options.folder}: predicts relative depth; set inverse_scale (and inverse_shift) so that "
                "1 / (inverse_scale * prediction + inverse_shift) is in metres"
            )

    def run(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the output `depth_m` (B, H, W) in metres, at the picture's size.

        Args:
            pictures: (B, 3, H, W) picture `left`, float in 0..1, on the network's device.
        """
        raw = self.run_graph(self.preprocess(pictures)).predicted_depth.float()
        raw = self.restored(raw[:, None], pictures, "bicubic")[:, 0]  # transformers uses bicubic interpolation too
        if self.options.inverse_scale:
            inverse = self.options.inverse_scale * raw + self.options.inverse_shift
            raw = 1 / inverse.clamp(min=1e-3)
        return {DEPTH: raw.clamp(min=NEAREST_M)}

    def losses(self, outputs: Mapping[str, Tensor], targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """Returns the loss `log_l1`: the mean absolute difference between the logarithms of predicted and true
        depth, over the pixels with ground truth.

        Args:
            outputs: result of `run_for_losses` for a batch of B samples, by name.
            targets: the B samples with their ground truth.
        """
        truth = torch.from_numpy(np.stack([sample.depth_m for sample in targets])).to(self.device)
        is_known = torch.isfinite(truth)
        error = (outputs[DEPTH].log() - truth.where(is_known, 1.0).log()).abs()
        return {"log_l1": (error * is_known).sum() / is_known.sum().clamp_min(1)}

    def predictions(self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...]) -> Sequence[FloatImage]:
        """The predicted depth of each picture: (H, W) float32 in metres.

        Args:
            outputs: result of `run_for_predictions` for a batch of B pictures, by name.
            size_px: height and width of the pictures.
        """
        return [depth_m.cpu().numpy() for depth_m in outputs[DEPTH]]


class FolderDetector(FolderNetwork):
    """A detector from a folder, such as DETR, RT-DETR or YOLOS, with N object queries.

    Outputs are `logits` (B, N, classes) and `pred_boxes` (B, N, 4): centre x, centre y, width and height as shares of
    the picture's width and height.

    Args:
        graph: the network of transformers; its loss function is replaced by one that leaves out ignored objects.
        options: options that the user gave, which name the folder.
    """

    options: DetectorFolderOptions

    def __init__(self, graph: nn.Module, options: DetectorFolderOptions) -> None:
        super().__init__(graph, options)
        network: Any = graph
        network.loss_function = partial(set_loss, network.loss_function, self.device.type)
        self._categories = self.matched({name: number for number, name in CATEGORY_NAMES.items()}, "COCO")

    def run(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the outputs `logits` (B, N, classes) and `pred_boxes` (B, N, 4), one entry for each of the N
        object queries.

        Args:
            pictures: (B, 3, H, W) picture `left`, float in 0..1, on the network's device.
        """
        raw = self.run_graph(self.preprocess(pictures))
        return {LOGITS: raw.logits, BOXES: raw.pred_boxes}

    def run_for_losses(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the input of `losses`: `network_input`, the graph's input, and `picture`, (B, 2) height and
        width of the pictures.

        Args:
            pictures: (B, 3, H, W) picture `left`, float in 0..1, on the network's device.
        """
        size = torch.tensor(pictures[VIEW].shape[2:], device=self.device)
        return {"network_input": self.preprocess(pictures), PICTURE: size.expand(len(pictures[VIEW]), -1)}

    def losses(self, outputs: Mapping[str, Tensor], targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """Returns `set_loss`, the set loss that transformers defines for this network, computed in float32.

        Only objects of classes that the network has are targets; other objects are ignored. The graph runs here.

        Args:
            outputs: result of `run_for_losses` for a batch of B samples, by name.
            targets: the B samples with their ground truth.
        """
        height, width = outputs[PICTURE][0].tolist()
        labels = [self._labels(sample, torch.tensor([width, height] * 2)) for sample in targets]
        with autocast(self.device, self.options.precision):
            return {"set_loss": self.run_graph(outputs["network_input"], labels=labels).loss}

    def predictions(self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...]) -> Sequence[tuple[Detection, ...]]:
        """Detections of COCO classes whose score is at least `score_threshold`, highest score first.

        Args:
            outputs: result of `run_for_predictions` for a batch of B pictures, by name.
            size_px: height and width of the pictures.
        """
        scale = torch.tensor([size_px[1], size_px[0]] * 2, device=self.device)
        answers = []
        for logits, boxes in zip(outputs[LOGITS], outputs[BOXES], strict=True):
            scores = self._scores(logits)
            edges = torch.cat([boxes[:, :2] - boxes[:, 2:] / 2, boxes[:, :2] + boxes[:, 2:] / 2], dim=1) * scale
            edges = edges.clamp(min=0).minimum(scale)
            surest, places = scores.flatten().topk(len(scores))  # as many detections as queries, of any class
            found = [
                Detection(category_id=self._categories[index], box_px=(box[0], box[1], box[2], box[3]), score=score)
                for score, index, box in zip(
                    surest.tolist(),
                    (places % scores.shape[1]).tolist(),
                    edges[places // scores.shape[1]].tolist(),
                    strict=True,
                )
                if index in self._categories and score >= self.options.score_threshold and score > 0
            ]
            answers.append(tuple(found))
        return answers

    def _scores(self, logits: Tensor) -> Tensor:
        """(N, classes) probabilities. For networks with a softmax, only the most likely class of each query
        keeps its value; the others are 0.
        """
        config: Any = self.graph.config
        if logits.shape[-1] == config.num_labels:
            return logits.sigmoid()
        probabilities = logits.softmax(-1)[:, :-1]
        return probabilities * (probabilities == probabilities.amax(1, keepdim=True))

    def _labels(self, sample: Any, scale: Tensor) -> dict[str, Tensor]:
        index_of = {category: index for index, category in reversed(self._categories.items())}
        wanted = [thing for thing in sample.objects if not thing.is_ignored and thing.category_id in index_of]
        others = [thing for thing in sample.objects if thing.is_ignored or thing.category_id not in index_of]
        classes = torch.tensor([index_of[thing.category_id] for thing in wanted], dtype=torch.int64)
        return {
            "class_labels": classes.to(self.device),
            "boxes": self._boxes(wanted, scale),
            IGNORED: self._boxes(others, scale),
        }

    def _boxes(self, things: Sequence[Any], scale: Tensor) -> Tensor:
        edges = torch.tensor([thing.box_px for thing in things], dtype=torch.float32).reshape(-1, 4) / scale
        return torch.cat([(edges[:, :2] + edges[:, 2:]) / 2, edges[:, 2:] - edges[:, :2]], dim=1).to(self.device)
