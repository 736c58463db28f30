"""Classes of image processors of transformers that gear implements in torch, with the default values of each class."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from gear.networks.network import IMAGENET_MEAN, IMAGENET_STD
from gear.values.errors import GearError

HALF = (0.5, 0.5, 0.5)

STEPS = ("do_resize", "do_rescale", "do_normalize", "do_pad", "do_center_crop")

FOR_LABELS_OR_OTHER_FILES = ("do_reduce_labels", "do_convert_annotations", "do_convert_rgb")
"""Keys of image processors that do not change gear's pictures: the conversion to RGB, and steps for labels."""

EVERYWHERE: Mapping[str, Any] = MappingProxyType(
    {"do_resize": True, "do_rescale": True, "rescale_factor": 1 / 255, "do_normalize": True, "do_pad": False,
     "do_center_crop": False, "image_mean": IMAGENET_MEAN, "image_std": IMAGENET_STD, "resample": 2}
)  # fmt: skip


NEEDED_PX: Mapping[str, int] = MappingProxyType(
    {"glpn": 32, "rt_detr": 32, "rt_detr_v2": 32, "d_fine": 32, "deimv2": 32}
)
"""Number of pixels of which the input's sides must be multiples, by `model_type`; other sizes would make feature
maps of several scales mismatch.
"""

IN_PATCHES = ("beit", "data2vec-vision", "depth_anything", "dpt", "yolos", "zoedepth")
"""Values of `model_type` of the networks that split the picture into whole patches. Such a network ignores the
incomplete patches at the right and the bottom, so its output covers a smaller part of the picture.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Family:
    """One class of image processors of transformers, such as DPTImageProcessor.

    Attributes:
        defaults: default values of the keys of preprocessor_config.json, where they differ from `EVERYWHERE`.
        networks: values of `model_type` of the networks that use this class when their folder names no class.
        is_square: meaning of a `size` of one number: True for height and width, False for the shorter edge.
    """

    defaults: Mapping[str, Any] = field(default_factory=dict)
    networks: tuple[str, ...] = ()
    is_square: bool = True

    def facts(self, config: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the values of a preprocessor_config.json, completed with the defaults of the class; null values
        are left out.

        Args:
            config: content of the file, by key.
        """
        return {**EVERYWHERE, **self.defaults, **{key: value for key, value in config.items() if value is not None}}

    def steps(self) -> frozenset[str]:
        """Names of the keys `do_…` that gear accepts: steps that gear implements, and steps that do not change the
        picture.
        """
        return frozenset((*STEPS, *FOR_LABELS_OR_OTHER_FILES, *(key for key in self.defaults if key.startswith("do_"))))


def _detr(*networks: str) -> Family:
    edges = {"shortest_edge": 800, "longest_edge": 1333}
    return Family(defaults={"size": edges, "do_pad": True}, networks=networks, is_square=False)


FAMILIES: Mapping[str, Family] = MappingProxyType(
    {
        "Segformer": Family(defaults={"size": {"height": 512, "width": 512}}, networks=("segformer", "upernet")),
        "Beit": Family(
            defaults={
                "size": {"height": 224, "width": 224}, "resample": 3, "image_mean": HALF, "image_std": HALF,
            },
            networks=("beit", "data2vec-vision"),
        ),
        "MobileViT": Family(
            defaults={
                "size": {"shortest_edge": 224}, "resample": 3, "do_center_crop": True, "do_normalize": False,
                "do_flip_channel_order": True,
            },
            networks=("mobilevit", "mobilevitv2"),
            is_square=False,
        ),
        "MobileNetV2": Family(
            defaults={
                "size": {"shortest_edge": 256}, "do_center_crop": True, "image_mean": HALF, "image_std": HALF,
            },
            networks=("mobilenet_v2",),
            is_square=False,
        ),
        "GLPN": Family(defaults={"size_divisor": 32, "do_normalize": False}, networks=("glpn",)),
        "DPT": Family(
            defaults={
                "size": {"height": 384, "width": 384}, "resample": 3, "image_mean": HALF, "image_std": HALF,
                "ensure_multiple_of": 1, "keep_aspect_ratio": False,
            },
            networks=("dpt", "depth_anything"),
        ),
        "ZoeDepth": Family(
            defaults={
                "size": {"height": 384, "width": 512}, "image_mean": HALF, "image_std": HALF, "do_pad": True,
                "ensure_multiple_of": 1 / 32, "keep_aspect_ratio": True,
            },
            networks=("zoedepth",),
        ),
        "Detr": _detr("detr", "table-transformer"),
        "ConditionalDetr": _detr("conditional_detr"),
        "DeformableDetr": _detr("deformable_detr", "lw_detr"),
        "Yolos": _detr("yolos"),
        "RTDetr": Family(
            defaults={"size": {"height": 640, "width": 640}, "do_normalize": False},
            networks=("rt_detr", "rt_detr_v2", "d_fine", "deimv2"),
            is_square=False,
        ),
    }
)  # fmt: skip


def family_of(config: Mapping[str, Any], model_type: str, path: Path) -> str:
    """The key in `FAMILIES` of the image processor class that a network's folder uses.

    Args:
        config: content of preprocessor_config.json, by key.
        model_type: type of the folder's network, for files that name no class.
        path: path of the file, for error messages.

    Raises:
        GearError: gear does not implement the class, or neither the file nor the network determines one.
    """
    named = config.get("image_processor_type") or config.get("feature_extractor_type")
    if named is not None:
        name = str(named)
        for ending in ("Fast", "Pil", "ImageProcessor", "FeatureExtractor"):
            name = name.removesuffix(ending)
    else:
        name = next((each for each, family in FAMILIES.items() if model_type in family.networks), "")
    if name not in FAMILIES:
        problem = f"image_processor_type {named!r} is not one that gear repeats" if named else "no image_processor_type"
        known = ", ".join(f"{each}ImageProcessor" for each in FAMILIES)
        raise GearError(f"{path}: {problem}; write one of {known}, or an adapter (docs/how-to/write-a-model.md)")
    return name
