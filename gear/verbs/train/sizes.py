"""Chooses the size of pictures and crops in a training, because steps over large pictures are slow on a CPU."""

from __future__ import annotations

import math
from dataclasses import replace

from gear.augment.registry import geometry_of
from gear.config.nodes import Mapping
from gear.contracts.specs import ModelSpec
from gear.networks.input_scale import OPTION
from gear.networks.runtime import device_of
from gear.plugins.catalogue import PluginEntry
from gear.readers import Samples
from gear.values.errors import GearError
from gear.verbs.train.config import CROPS_PX, TrainConfig

PIXELS_A_SECOND = (1 << 18) / 600
"""Pixels per picture and second of the time budget. Ten minutes give 724 x 362 pixels: two cores then finish about 700
steps with batches of eight pictures and a network of DDRNet's size."""

LEAST_PIXELS = 1 << 16

NEARLY_WHOLE = 0.9


def picture_scale(plugin: PluginEntry, config: TrainConfig, samples: Samples) -> float:
    """Returns the factor, at most 1, by which pictures are resized in a training.

    If the config gives a factor, that factor is returned. Otherwise the factor is below 1 only for a training on a CPU
    with a time budget, without crops and without adversarial patches. The network's weights must be able to record the
    factor, and the task's ground truth must not depend on the principal point, as 3D boxes do.

    Args:
        plugin: the network's plugin.
        config: config of the training.
        samples: training samples.

    Raises:
        GearError: smaller pictures are requested together with adversarial patches.
    """
    if config.picture_scale is not None:
        if config.picture_scale < 1 and config.adversarial.attack:
            raise GearError("patches are put into whole pictures; train against them with picture_scale=1")
        return config.picture_scale
    if not config.time_budget_s or config.crop_px is not None or config.adversarial.attack:
        return 1.0
    if device_of(config.device).type != "cpu" or not _says_its_scale(plugin, config):
        return 1.0
    sample = samples[0]
    geometry = geometry_of(sample)
    if geometry is None or geometry.is_centred:  # the difficulty of a 3D box depends on its height in pixels
        return 1.0
    height, width = next(iter(sample.images.values())).shape[:2]
    share = math.sqrt(max(PIXELS_A_SECOND * config.time_budget_s, LEAST_PIXELS) / (height * width))
    return 1.0 if share > NEARLY_WHOLE else round(share, 3)


def without_empty_margins(config: TrainConfig, samples: Samples) -> TrainConfig:
    """Returns the config with crops reduced to the size of the largest scaled picture, because larger crops would only
    contain padding.

    Args:
        config: config of the training.
        samples: the training samples; all cameras of their datasets count.
    """
    if config.crop_px is None:
        return config
    cameras = [camera for dataset in samples.datasets for camera in dataset.sidecar(0).record.cameras]
    most = samples.scale * config.scales[1]
    height_px, width_px = (
        max(CROPS_PX[0], math.ceil(most * max(sizes)))
        for sizes in zip(*((camera.height_px, camera.width_px) for camera in cameras), strict=True)
    )
    return replace(config, crop_px=(min(config.crop_px[0], height_px), min(config.crop_px[1], width_px)))


def _says_its_scale(plugin: PluginEntry, config: TrainConfig) -> bool:
    spec = plugin.spec
    assert isinstance(spec, ModelSpec)
    is_given = isinstance(config.options, Mapping) and OPTION in config.options.entries
    return not is_given and getattr(spec.config(), OPTION, 1.0) is None
