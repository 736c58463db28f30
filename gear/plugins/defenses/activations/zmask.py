"""Z-Mask (Rossolini et al., AAAI 2023): covers regions that over-activate both shallow and deep layers of a network.

It follows the authors' code and supplement. Choices that these leave open are options of the plugin.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor
from torch.nn import functional

from gear.contracts.defenses import DefendedBatch, DefenseResult, FitReport, FitsInPhases
from gear.contracts.models import Model
from gear.plugins.defenses.activations.feature_maps import feature_maps, spread, tapped
from gear.plugins.defenses.activations.mask_block import COVERED_FROM, Example, Fit, MaskBlock, fit_of, learn
from gear.plugins.defenses.activations.over_activation import (
    Cells,
    ChannelStatistics,
    channel_statistics,
    mean_of,
    pooled_sizes,
    refined,
    select_layers,
)
from gear.plugins.defenses.activations.twin_masks import patch_area
from gear.plugins.defenses.activations.z_scores import (
    alarm_level,
    false_alarm_interval,
    normalised_score,
    normalised_score_tensor,
)
from gear.plugins.defenses.activations.zmask_layers import Layers, NetworkInput, Views, layers_of, network_inputs
from gear.plugins.defenses.activations.zmask_options import ZMaskConfig
from gear.values.errors import GearError
from gear.values.frames import UInt8Image
from gear.values.progress import PhaseProgress

LAYER_PICTURES = 12
"""Largest number of patched calibration pictures from which the layers are selected."""

MOSTLY = 0.5
"""Smallest share of a grid cell that the patch must cover for the cell to count as patch."""

FILL = np.array([124, 116, 104], np.uint8)
"""Fill colour of covered regions: ImageNet's mean in bytes. A network that normalises by this mean receives 0, as
published. For networks with another normalisation it is a grey near the middle, which is gear's choice.
"""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ZMaskState:
    """The state of Z-Mask after calibration.

    Attributes:
        layers: names of the layers whose feature maps are read.
        statistics: mean and deviation of the channels on clean pictures, by layer.
        block: the fusion block, which computes masks and raw scores from heat maps.
        level: raw score that at most the share `false_alarms` of clean pictures exceeds.
        report: quality of the calibration on its own pictures.
    """

    layers: Layers
    statistics: Mapping[str, ChannelStatistics]
    block: MaskBlock
    level: float
    report: FitReport

    def fit_report(self) -> FitReport:
        """Returns numbers on the calibration, by name, such as `loss` and `mask_iou` of the fusion block on the
        calibration pictures and the alarm level (`level`); with a problem if the block separates no patches.
        """
        return self.report


class ZMask(FitsInPhases):
    """The defense Z-Mask: covers regions that over-activate shallow and deep layers of the protected network.

    Its statistics and its fusion block are calibrated on pictures of the reference camera.

    Args:
        settings: options of the defense.
    """

    def __init__(self, settings: ZMaskConfig) -> None:
        self._settings = settings
        self._fill = torch.from_numpy(FILL / np.float32(255))[:, None, None]

    def fit_in_phases(
        self,
        clean: Sequence[Views],
        patched: Sequence[Views],
        model: Model | None,
        rng: np.random.Generator,
        on_phase: PhaseProgress,
    ) -> ZMaskState:
        """Calibrates the defense: statistics from clean pictures, and the fusion block from the same scenes with
        patches.

        Args:
            clean: pictures without a patch, (H, W, 3) uint8 by camera name, one mapping per sample.
            patched: pictures of the same scenes with a patch, in the same order.
            model: the network whose feature maps are read.
            rng: random generator of the calibration.
            on_phase: called with the unit of the phase and the numbers of finished and of all steps.

        Raises:
            GearError: there are no pictures, clean and patched pictures show different scenes, or no patch is visible.
        """
        assert model is not None
        if not len(clean) or not len(patched):
            raise GearError(
                "Z-Mask learns from patches, too: give --calibration-patched DIR, the twin of --calibration with "
                "patches (gear collect with the same seed and settings, and --patch random)"
            )
        if len(patched) != len(clean):
            raise GearError(
                f"the calibration data are no twins: {len(clean)} clean samples, and {len(patched)} with patches"
            )
        layers = layers_of(model, self._settings.shallow, self._settings.deep)
        statistics = self._statistics(clean, model, layers, on_phase)
        layers = self._selected_layers(clean, patched, model, layers, statistics, on_phase)
        examples = list(self._examples(clean, patched, model, layers, statistics, on_phase))
        if not examples:
            raise GearError("no patch is seen in the patched calibration data: Z-Mask has nothing to learn from")
        block = learn(examples, self._settings.steps, rng, partial(on_phase, "training step"))
        scores = [
            max(
                block.score(*self._heat_maps(model, net_input, layers, statistics))
                for net_input in network_inputs(sample)
            )
            for sample in spread(clean, self._settings.max_patched_pictures, partial(on_phase, "clean score"))
        ]
        level = alarm_level(scores, self._settings.false_alarms)
        report = _fit_report(fit_of(block, examples), len(examples), len(scores), self._settings.false_alarms, level)
        return ZMaskState(layers=layers, statistics=statistics, block=block, level=level, report=report)

    def apply(self, views: Views, model: Model | None, state: ZMaskState, rng: np.random.Generator) -> DefenseResult:
        """Covers regions of a sample's pictures that over-activate the network.

        Args:
            views: (H, W, 3) uint8 pictures of the sample by camera name.
            model: the network whose feature maps are read.
            state: result of the calibration.
            rng: not used.

        Returns:
            The cleaned pictures, (H, W) masks in 0..1 before the threshold, by camera name, and the largest score of
            the cameras, 0..1, which is 0.5 at the alarm level.
        """
        assert model is not None
        masks = {name: np.zeros(picture.shape[:2], np.float32) for name, picture in views.items()}
        score = 0.0
        for net_input in network_inputs(views):
            shallow, deep = self._heat_maps(model, net_input, state.layers, state.statistics)
            score = max(score, normalised_score(state.block.score(shallow, deep), state.level))
            size = masks[net_input.camera].shape[::-1]
            masks[net_input.camera] = cv2.resize(
                state.block.mask(shallow, deep).numpy(), size, interpolation=cv2.INTER_NEAREST_EXACT
            )
        is_alarm = score > COVERED_FROM or not self._settings.only_on_alarm
        cleaned = {name: _covered(picture, masks[name], is_alarm) for name, picture in views.items()}
        return DefenseResult(views=cleaned, mask=masks, score=score)

    def forward(self, views: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Always fails, because Z-Mask needs the model and the calibrated state; `forward_fitted` takes both.

        Args:
            views: not used.

        Raises:
            ValueError: always.
        """
        raise ValueError("Z-Mask looks into the model: it has `forward_fitted`")

    def forward_fitted(self, views: Mapping[str, Tensor], model: Model, state: ZMaskState) -> Mapping[str, Tensor]:
        """Returns the cleaned pictures of `defend_batch` without its masks and scores.

        Args:
            views: (B, 3, H, W) pictures by camera name, float in 0..1.
            model: the network whose feature maps are read.
            state: result of the calibration.
        """
        return self.defend_batch(views, model, state).views

    def defend_batch(self, views: Mapping[str, Tensor], model: Model, state: ZMaskState) -> DefendedBatch:
        """Cleans pictures as `apply` does, and returns them with masks and scores that have gradients.

        The gradient of the covered pictures is that of the mask before the threshold.

        Args:
            views: (B, 3, H, W) pictures by camera name, float in 0..1.
            model: the network whose feature maps are read.
            state: result of the calibration.

        Returns:
            Cleaned pictures and (B, H, W) masks in 0..1 by camera name, and (B,) scores in 0..1.
        """
        covers = {name: torch.zeros_like(pictures[:, :1]) for name, pictures in views.items()}
        masks = {name: pictures.new_zeros(pictures[:, 0].shape) for name, pictures in views.items()}
        scores: list[Tensor] = []
        for net_input in network_inputs(views):
            maps = tapped(model, net_input.views, state.layers.all())
            size = net_input.views[net_input.camera].shape[2:]
            grid = self._grid(*size)
            soft, raw = [], []
            for number in range(len(net_input.views[net_input.camera])):
                own = {name: features[number] for name, features in maps.items()}
                heats = self._heats(own, grid, state.layers, state.statistics)
                heats = _flipped(heats) if net_input.is_mirrored else heats
                raw.append(state.block.score_tensor(*heats))
                soft.append(state.block.mask(*heats))
            scores.append(normalised_score_tensor(torch.stack(raw), state.level))
            mask = functional.interpolate(torch.stack(soft)[:, None], size=size, mode="nearest-exact")
            masks[net_input.camera] = mask[:, 0].to(masks[net_input.camera])
            covers[net_input.camera] = ((mask > COVERED_FROM).float() + mask - mask.detach()).to(
                covers[net_input.camera]
            )
        score = torch.stack(scores).amax(dim=0)
        is_alarm = (score.detach() > COVERED_FROM) | (not self._settings.only_on_alarm)
        cleaned = {}
        for name, pictures in views.items():
            cover = covers[name] * is_alarm.to(pictures)[:, None, None, None]
            cleaned[name] = pictures * (1 - cover) + self._fill.to(pictures) * cover
        return DefendedBatch(views=cleaned, masks=masks, scores=score)

    def wrap(self, model: Model) -> Model:
        """Returns the model unchanged, because Z-Mask only changes pictures.

        Args:
            model: the network to be defended.
        """
        return model

    def _statistics(
        self, clean: Sequence[Views], model: Model, layers: Layers, on_phase: PhaseProgress
    ) -> dict[str, ChannelStatistics]:
        each: dict[str, list[ChannelStatistics]] = {name: [] for name in layers.all()}
        for sample in spread(clean, self._settings.max_clean_pictures, partial(on_phase, "clean picture")):
            net_input = network_inputs(sample)[0]
            grid = self._grid(*net_input.views[net_input.camera].shape[:2])
            for name, features in feature_maps(model, net_input.views, layers.all()).items():
                each[name].append(channel_statistics(features, grid))
        return {name: mean_of(many) for name, many in each.items()}

    def _examples(
        self,
        clean: Sequence[Views],
        patched: Sequence[Views],
        model: Model,
        layers: Layers,
        statistics: Mapping[str, ChannelStatistics],
        on_phase: PhaseProgress,
    ) -> Iterator[Example]:
        """Yields training examples: the heat maps of each picture in which a patch is visible, with the true mask."""
        on_pair = partial(on_phase, "training pair")
        for number in spread(range(len(patched)), self._settings.max_patched_pictures, on_pair):
            without, net_input = network_inputs(clean[number])[0], network_inputs(patched[number])[0]
            area = patch_area(without.views[net_input.camera], net_input.views[net_input.camera], number)
            if area.any():
                shallow, deep = self._heat_maps(model, net_input, layers, statistics)
                truth = _truth(area, (shallow.shape[0], shallow.shape[1]))
                yield Example(shallow=shallow, deep=deep, truth=truth)

    def _grid(self, height: int, width: int) -> Cells:
        """Rows and columns of the grid for a picture size.

        Cells have the aspect ratio of those of a 150 x 300 grid on a picture of 2048 x 1024.
        """
        return self._settings.rows, max(1, round(self._settings.rows * width / height))

    def _heat_maps(
        self,
        model: Model,
        net_input: NetworkInput[UInt8Image],
        layers: Layers,
        statistics: Mapping[str, ChannelStatistics],
    ) -> tuple[Tensor, Tensor]:
        """The shallow and the deep heat map of one network input, mirrored back if the input is mirrored."""
        grid = self._grid(*net_input.views[net_input.camera].shape[:2])
        heats = self._heats(feature_maps(model, net_input.views, layers.all()), grid, layers, statistics)
        return _flipped(heats) if net_input.is_mirrored else heats

    def _heats(
        self,
        maps: Mapping[str, Tensor],
        grid: Cells,
        layers: Layers,
        statistics: Mapping[str, ChannelStatistics],
    ) -> tuple[Tensor, Tensor]:
        """The shallow and the deep heat map of one camera: for each cell the largest value over the layers."""
        heats = self._layer_heats(maps, grid, layers, statistics)
        first, second = (torch.stack(list(heats[kind].values())).amax(dim=0) for kind in ("shallow", "deep"))
        return first, second

    def _layer_heats(
        self,
        maps: Mapping[str, Tensor],
        grid: Cells,
        layers: Layers,
        statistics: Mapping[str, ChannelStatistics],
    ) -> dict[str, dict[str, Tensor]]:
        """Heat maps of one camera's features by layer, `shallow` and `deep`."""
        shallow, deep = self._settings.shallow_kernels, self._settings.deep_kernels
        heats: dict[str, dict[str, Tensor]] = {"shallow": {}, "deep": {}}
        for name, features in maps.items():
            z = statistics[name].z_scores(features)
            every = sorted({*shallow, *deep})
            pooled = dict(zip(every, pooled_sizes(z, grid, [(rows, 2 * rows) for rows in every]), strict=True))
            if name in layers.shallow:
                heats["shallow"][name] = refined([pooled[rows] for rows in shallow])
            if name in layers.deep:
                heats["deep"][name] = refined([pooled[rows] for rows in deep])
        return heats

    def _selected_layers(
        self,
        clean: Sequence[Views],
        patched: Sequence[Views],
        model: Model,
        layers: Layers,
        statistics: Mapping[str, ChannelStatistics],
        on_phase: PhaseProgress,
    ) -> Layers:
        """Selects the layers whose common heat map separates patches from other cells in the calibration pictures.

        The published layers were chosen by hand for one network's weights. Since each cell takes the largest value over
        the layers, a layer without information hides the others. On town10's billboard03, the block learns nothing of
        `ddrnet23_slim_depth` with `rb1`, `rb2` and `rbb2` (loss 0.140, the best constant's is 0.150; mask IoU 0). With
        `rb2` alone it does (0.121 instead of 0.169 on 14 pictures; IoU 0.22, and 0.34 on billboard02).

        A layer may be both shallow and deep, as in the supplement. Layers that the options name are always used.
        """
        every = Layers(shallow=layers.all(), deep=layers.all())
        heats: dict[str, dict[str, list[Tensor]]] = {"shallow": {}, "deep": {}}
        truths = []
        for number in spread(range(len(patched)), LAYER_PICTURES, partial(on_phase, "layer comparison")):
            without, net_input = network_inputs(clean[number])[0], network_inputs(patched[number])[0]
            grid = self._grid(*net_input.views[net_input.camera].shape[:2])
            truths.append(
                _truth(
                    patch_area(without.views[net_input.camera], net_input.views[net_input.camera], number),
                    grid,
                )
            )
            maps = feature_maps(model, net_input.views, every.all())
            for kind, by_name in self._layer_heats(maps, grid, every, statistics).items():
                for name, heat in by_name.items():
                    heats[kind].setdefault(name, []).append(heat)
        chosen = {kind: select_layers(by_name, truths) for kind, by_name in heats.items()}
        return Layers(
            shallow=self._settings.shallow or chosen["shallow"] or layers.shallow,
            deep=self._settings.deep or chosen["deep"] or layers.deep,
        )


def _truth(area: npt.NDArray[np.bool_], grid: Cells) -> Tensor:
    """The true mask on the grid, (rows, columns): 1 in cells of which the patch covers at least `MOSTLY`, else 0."""
    share = cv2.resize(area.astype(np.float32), grid[::-1], interpolation=cv2.INTER_AREA)
    return torch.from_numpy((share >= MOSTLY).astype(np.float32))


def _fit_report(fit: Fit, examples: int, clean: int, false_alarms: float, level: float) -> FitReport:
    low, high = false_alarm_interval(clean, false_alarms)
    values = {
        "examples": examples,
        "patch_share": fit.share,
        "loss": fit.loss,
        "constant_loss": fit.constant_loss,
        "mask_iou": fit.iou,
        "clean_pictures": clean,
        "level": level,
        "false_alarms_low": low,
        "false_alarms_high": high,
    }
    problem = (
        f"zmask learnt nothing: on its own {examples} calibration patches its mask has IoU {fit.iou:.3f} and loss "
        f"{fit.loss:.3f}, a constant answer has loss {fit.constant_loss:.3f}; its masks mean nothing (other layers: "
        "--defense-set shallow=[TAP] deep=[TAP])"
    )
    return FitReport(values=values, problems=() if fit.has_learnt else (problem,))


def _flipped(heats: tuple[Tensor, Tensor]) -> tuple[Tensor, Tensor]:
    return heats[0].flip(1), heats[1].flip(1)


def _covered(picture: UInt8Image, mask: npt.NDArray[np.float32], is_covered: bool) -> UInt8Image:
    covered = picture.copy()
    if is_covered:
        covered[mask > COVERED_FROM] = FILL
    return covered
