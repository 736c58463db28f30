"""The gear network around the centre-based stereo graphs: it prepares pictures, and computes losses and predictions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import torch
from torch import Tensor, nn

from gear.formats.kitti_object import KittiLabel
from gear.networks.input_scale import input_scale_of
from gear.networks.network import Network, Normalise
from gear.networks.stereo.centre import KINDS, STRIDE, CentreGraph, StereoCentreShape, fit_to_network, in_picture_px
from gear.networks.stereo.centre_decode import Peaks, decode
from gear.networks.stereo.centre_losses import Grid, LabelledPair, centre_losses, centre_targets
from gear.networks.stereo.options import INPUT_SCALE, LEFT, RIGHT, StereoCentreOptions
from gear.networks.weights import build_graph


class StereoCentreNetwork(Network):
    """A centre-based stereo network as a gear network.

    Its outputs are maps by name, as `gear.networks.stereo.centre.CentreGraph.forward` returns them, with lengths in
    pixels of the original pictures.
    """

    graph: CentreGraph
    options: StereoCentreOptions
    has_quick_copy = True

    def __init__(
        self,
        options: StereoCentreOptions,
        name: str,
        make: Callable[[StereoCentreShape], CentreGraph],
        normalise: Normalise,
        taps: Mapping[str, str],
    ) -> None:
        """Makes the network with the weights that its options name.

        Args:
            options: options that the user gave.
            name: name of the model plugin, which determines the shipped weights.
            make: function that builds the graph.
            normalise: normalisation of pictures in 0..1.
            taps: names of the graph's layers by name of the feature map.
        """
        graph = build_graph(lambda: make(StereoCentreShape(width=options.width)), options, name)
        super().__init__(graph, options, views=(LEFT, RIGHT))
        self.normalise = normalise.to(self.device)
        self.input_scale = input_scale_of(options, name, INPUT_SCALE)
        self._taps = dict(taps)

    def run(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the output maps (B, ..., h, w) of the graph by name, with lengths in pixels of the original
        pictures.

        Args:
            pictures: (B, 3, H, W) pictures `left` and `right`, float in 0..1, on the network's device.
        """
        # Channels last: a quarter faster on the CPU, in float32 and in bfloat16.
        pair = [self.normalise(pictures[name]).contiguous(memory_format=torch.channels_last) for name in (LEFT, RIGHT)]
        left, ratio = fit_to_network(pair[0], self.input_scale)
        right, _ = fit_to_network(pair[1], self.input_scale)
        return in_picture_px(self.graph(left, right), ratio)

    def losses(self, outputs: Mapping[str, Tensor], targets: Sequence[LabelledPair]) -> Mapping[str, Tensor]:
        """Returns the scalar losses by name: `heat`, `sides`, `centre`, `size`, `heading`, `hidden`, `disparity`,
        `surface` and `disparity_bins` (`gear.networks.stereo.centre_losses.centre_losses` describes them).

        Args:
            outputs: result of `run_for_losses` for a batch of B samples, by name.
            targets: the B samples with their ground truth.
        """
        intrinsics = targets[0].calibration.intrinsics
        ratio = self._ratio((intrinsics.height_px, intrinsics.width_px))
        height, width = outputs["heat"].shape[-2:]
        grid = Grid(height=height, width=width, cell_px=(STRIDE * ratio[0], STRIDE * ratio[1]))
        bins_px = self.graph.log_bins.exp() * ratio[0]
        return centre_losses(outputs, centre_targets(targets, KINDS, grid), bins_px=bins_px, cell_px=grid.cell_px)

    def predictions(self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...]) -> Sequence[tuple[KittiLabel, ...]]:
        """The detections of each picture, as KITTI labels with scores.

        Args:
            outputs: result of `run_for_predictions` for a batch of B pictures, by name.
            size_px: height and width of the pictures.
        """
        ratio = self._ratio(size_px)
        cell_px = (STRIDE * ratio[0], STRIDE * ratio[1])
        peaks = Peaks(score_threshold=self.options.score_threshold)
        return decode(outputs, KINDS, self.options.calibration(size_px), cell_px, peaks)

    def taps(self) -> Mapping[str, nn.Module]:
        """The modules whose outputs are feature maps: `layer1` (both pictures, the left ones first), `volume`, and
        `layer2` to `layer4`.
        """
        return {name: self.graph.get_submodule(layer) for name, layer in self._taps.items()}

    def _ratio(self, size_px: tuple[int, ...]) -> tuple[float, float]:
        """Number of pixels of a picture (height, width) for each pixel of the network's input, in x and in y."""
        height, width = (max(1, round(side * self.input_scale)) for side in size_px)
        return size_px[1] / width, size_px[0] / height
