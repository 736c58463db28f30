"""Stereo R-CNN (Li, Chen, Shen, CVPR 2019) as a gear network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from gear.formats.kitti_object import KittiLabel
from gear.networks.network import Network, as_batch
from gear.networks.runtime import autocast
from gear.networks.stereo.alignment import Pair
from gear.networks.stereo.centre_losses import LabelledPair
from gear.networks.stereo.options import LEFT, RIGHT, StereoRcnnOptions
from gear.networks.stereo.rcnn_decode import decode_cars, place_car
from gear.networks.stereo.rcnn_graph import LOSSES, StereoRcnn, StereoRcnnShape, anchors
from gear.networks.stereo.rcnn_losses import car_targets, region_losses, rpn_losses, sample_pairs
from gear.networks.stereo.rcnn_proposals import propose
from gear.networks.weights import build_graph
from gear.values.frames import UInt8Image
from gear.values.rng import derive_rng

NAME = "stereo_rcnn"
MEAN_BGR = (102.9801, 115.9465, 122.7717)
PROPOSED_IN_TRAINING = 2000


class StereoRcnnNetwork(Network):
    """Stereo R-CNN as a gear network. Outputs are in pixels of the network's input, with A anchors and R box pairs
    for each picture.

    `rpn_logits` (B, A, 2) and `rpn_codes` (B, A, 6) belong to the anchors. `rois_left` and `rois_right` (B, R, 4) are
    the proposals, padded with zeros, without gradients. The other outputs are those of `StereoRcnn.regions` for each
    pair. `predict` solves for 3D boxes, without gradients.

    Args:
        options: options that the user gave.
        shape: size of the network; None for the authors' sizes.
    """

    graph: StereoRcnn
    options: StereoRcnnOptions

    def __init__(self, options: StereoRcnnOptions, shape: StereoRcnnShape | None = None) -> None:
        shape = shape or StereoRcnnShape()
        super().__init__(build_graph(lambda: StereoRcnn(shape), options, NAME), options, views=(LEFT, RIGHT))

    def forward(
        self, views: Mapping[str, Tensor], targets: Sequence[LabelledPair] | None = None
    ) -> Mapping[str, Tensor]:
        """Computes the outputs for a batch, or the six losses if `targets` are given.

        Each loss L is weighted by its learned logarithm s of a variance: L exp(-s) + s. Anchors and box pairs for the
        losses are sampled with `options.seed`, so each call samples the same ones. In training mode torch's own
        generator samples them anew for every picture.

        Args:
            views: (B, 3, H, W) pictures `left` and `right`, float in 0..1.
            targets: the B samples with their ground truth; None for outputs instead of losses.

        Returns:
            The outputs that the class describes, or scalar losses, by name.
        """
        if targets is None:
            return super().forward(views)
        pictures = {name: views[name].to(self.device) for name in self._views}
        draws = self._draws(len(targets))
        with autocast(self.device, self.options.precision):
            each = [self._losses_of(*self._pyramids(pictures, i), targets[i], draws[i]) for i in range(len(targets))]
        means = {name: torch.stack([losses[name].float() for losses in each]).mean() for name in LOSSES}
        variances = self.graph.loss_log_variances
        return {name: means[name] * (-variances[i]).exp() + variances[i] for i, name in enumerate(LOSSES)}

    def run(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the outputs that the class describes, by name.

        The network processes one pair of pictures at a time, as in training; therefore no output depends on other
        pairs of the batch.

        Args:
            pictures: (B, 3, H, W) pictures `left` and `right`, float in 0..1, on the network's device.
        """
        each = [self._outputs_of(*self._pyramids(pictures, i)) for i in range(len(pictures[LEFT]))]
        return {name: torch.stack([outputs[name] for outputs in each]) for name in each[0]}

    def losses(self, outputs: Mapping[str, Tensor], targets: Sequence[LabelledPair]) -> Mapping[str, Tensor]:
        """Always raises an error: the second stage is trained on pairs that are sampled with the targets, so
        losses cannot follow from outputs.

        Args:
            outputs, targets: not used.

        Raises:
            TypeError: always; call `forward` with targets instead.
        """
        raise TypeError("Stereo R-CNN has its losses from pictures: call forward(views, targets)")

    def predict_many(self, samples: Sequence[Mapping[str, UInt8Image]]) -> list[tuple[KittiLabel, ...]]:
        """Returns the detected cars of each sample as KITTI labels; depth is refined by photometric alignment if
        `refine_depth` is set.

        Args:
            samples: (H, W, 3) uint8 pictures `left` and `right`, one mapping per sample.
        """
        found = []
        for sample in samples:
            views = {name: view.to(self.device) for name, view in as_batch([sample], self._views).items()}
            with torch.inference_mode():
                outputs = self(views)
                pair = self._compared(views) if self.options.refine_depth else None
                found += self._placed(outputs, sample[LEFT].shape[:2], pair)
        return found

    def predictions(self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...]) -> Sequence[tuple[KittiLabel, ...]]:
        """The detected cars, computed from 2D boxes and corners alone. `predict` also has the pictures and refines
        depth by photometric alignment.

        Args:
            outputs: result of `run_for_predictions` for a batch of B pictures, by name.
            size_px: height and width of the pictures.
        """
        return self._placed(outputs, size_px, None)

    def taps(self) -> Mapping[str, nn.Module]:
        """The stages of the residual network, by name. Each stage runs on the left picture first, then on the
        right picture.
        """
        return {f"layer{number}": getattr(self.graph, f"RCNN_layer{number}") for number in (1, 2, 3, 4)}

    def _placed(
        self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...], pair: Pair | None
    ) -> list[tuple[KittiLabel, ...]]:
        calibration, scale = self.options.calibration(size_px), self._scale(size_px)
        found = []
        for i in range(len(outputs["rois_left"])):
            said = {name: tensor[i].float().cpu() for name, tensor in outputs.items()}
            cars = decode_cars(said, scale, self._input_size(size_px), self.options.score_threshold)
            labels = [place_car(car, calibration, pair, self.options.aligned_bias_px) for car in cars]
            found.append(tuple(label for label in labels if label is not None))
        return found

    def _compared(self, views: Mapping[str, Tensor]) -> Pair:
        size_px = tuple(views[LEFT].shape[-2:])
        return Pair.of(self._input(views[LEFT]), self._input(views[RIGHT]), self._scale(size_px))

    def _scale(self, size_px: tuple[int, ...]) -> float:
        """Factor from pictures of (height, width) to the network's input."""
        return self.options.short_side_px / min(size_px)

    def _input_size(self, size_px: tuple[int, ...]) -> tuple[int, int]:
        scale = self._scale(size_px)
        return round(size_px[0] * scale), round(size_px[1] * scale)

    def _input(self, picture: Tensor) -> Tensor:
        """Converts (B, 3, H, W) RGB in 0..1 to the network's input: enlarged, BGR in 0..255 minus the mean."""
        size = self._input_size(tuple(picture.shape[-2:]))
        large = functional.interpolate(picture, size=size, mode="bilinear", align_corners=False)
        return large.flip(1) * 255 - large.new_tensor(MEAN_BGR)[:, None, None]

    def _pyramids(
        self, pictures: Mapping[str, Tensor], number: int
    ) -> tuple[list[Tensor], list[Tensor], tuple[int, int]]:
        """P2 .. P6 of both pictures of one sample, and the size of the network's input."""
        left, right = (self._input(pictures[name][number : number + 1]).contiguous() for name in (LEFT, RIGHT))
        return self.graph.pyramid(left), self.graph.pyramid(right), (left.shape[-2], left.shape[-1])

    def _outputs_of(self, left: list[Tensor], right: list[Tensor], size: tuple[int, int]) -> dict[str, Tensor]:
        logits, chances, codes = self.graph.RCNN_rpn(left, right)
        pairs = self._proposed(chances, codes, anchors(left), size, self.options.proposals)
        missing = self.options.proposals - len(pairs[0])
        full = [functional.pad(boxes, (0, 0, 0, missing)) for boxes in pairs]
        said = self.graph.regions(left[:4], right[:4], (full[0], full[1]), size[0])
        return {"rpn_logits": logits[0], "rpn_codes": codes[0], "rois_left": full[0], "rois_right": full[1], **said}

    def _proposed(
        self, chances: Tensor, codes: Tensor, places: Tensor, size: tuple[int, int], most: int
    ) -> tuple[Tensor, Tensor]:
        pre_nms_top_n = self.options.pre_nms_top_n * (2 if self.training else 1)
        return propose(chances[0].float(), codes[0].float(), places, size, pre_nms_top_n=pre_nms_top_n, max_pairs=most)

    def _draws(self, count: int) -> list[torch.Generator]:
        """A random generator for each picture of a batch."""
        # `gear train` seeds torch's generator at every step, so that a resumed training draws the same.
        if self.training:
            step = int(torch.randint(2**62, ()))
            seeds = [derive_rng(step, NAME, "samples", number) for number in range(count)]
        else:
            seeds = [derive_rng(self.options.seed, NAME, "samples") for _ in range(count)]
        return [torch.Generator().manual_seed(int(rng.integers(2**62))) for rng in seeds]

    def _losses_of(
        self,
        left: list[Tensor],
        right: list[Tensor],
        size: tuple[int, int],
        sample: LabelledPair,
        draws: torch.Generator,
    ) -> dict[str, Tensor]:
        intrinsics = sample.calibration.intrinsics
        cars = car_targets(sample, self._scale((intrinsics.height_px, intrinsics.width_px))).to(self.device)
        places = anchors(left)
        logits, chances, codes = self.graph.RCNN_rpn(left, right)
        first = rpn_losses(logits[0].float(), codes[0].float(), places, cars, size, draws)
        most = PROPOSED_IN_TRAINING if self.training else self.options.proposals
        pairs = sample_pairs(*self._proposed(chances, codes, places, size, most), cars, draws)
        said = self.graph.regions(left[:4], right[:4], (pairs.left, pairs.right), size[0])
        return {**first, **region_losses({name: tensor.float() for name, tensor in said.items()}, pairs, cars)}
