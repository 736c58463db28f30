"""Reads and checks preprocessor_config.json, the file of a Hugging Face image processor."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeGuard

from gear.networks.huggingface.families import FAMILIES, IN_PATCHES, NEEDED_PX, Family, family_of
from gear.networks.huggingface.processor import Channels, Processor
from gear.values.errors import GearError
from gear.values.regular_file import read_regular

FILE = "preprocessor_config.json"

RESAMPLING = {0: "nearest-exact", 2: "bilinear", 3: "bicubic"}
"""Interpolation modes of torch by the number that Pillow gives to the same mode."""

MOST_PX = 1 << 15
"""Upper limit of picture sizes in preprocessor_config.json; larger pictures would not fit into memory."""

YOLOS_PATCH_PX = 16

DETR_LONGEST_PX = 1333
"""Longest edge in pixels for DETRs whose file states no `longest_edge`; older files state `max_size`, or no limit."""


def read_processor(folder: Path, *, resizes: bool = True, config: object = None) -> Processor:
    """Reads the image processor of a network's folder.

    If the folder has no preprocessor_config.json, pictures are normalised with ImageNet's mean and deviation and not
    resized.

    Args:
        folder: folder of the network.
        resizes: whether pictures are resized as the file says. Changes of size that the network requires are made in
            any case.
        config: configuration object of transformers, from which the network's patch size is read.

    Raises:
        GearError: the file is not JSON, or contains a step that gear does not implement.
    """
    path, beside = folder / FILE, folder / "config.json"
    model_type = str(read_mapping(beside).get("model_type")) if beside.is_file() else ""
    needed_px = _patch_px(config) if model_type in IN_PATCHES else NEEDED_PX.get(model_type, 1)
    if not path.is_file():
        return Processor(multiple_px=needed_px, rounds_down=model_type == "glpn")
    content = read_mapping(path)
    name = family_of(content, model_type, path)
    facts = _Facts(FAMILIES[name], content, path)
    facts.check_steps()
    return _processor(name, facts, needed_px, resizes=resizes)


def read_mapping(path: Path) -> dict[str, Any]:
    """Reads a JSON file whose outermost value must be a mapping (a JSON object).

    Args:
        path: the JSON file.

    Raises:
        GearError: the file contains no mapping.
    """
    try:
        facts = json.loads(read_regular(path).decode("utf-8"))
    except json.JSONDecodeError as error:
        raise GearError(f"{path}:{error.lineno}: not JSON: {error.msg}; fetch the folder again") from error
    except (OSError, ValueError, RecursionError) as error:
        raise GearError(f"{path}: cannot be read as JSON ({type(error).__name__}); fetch the folder again") from error
    if not isinstance(facts, dict):
        raise GearError(f"{path}: a mapping is wanted, got a {type(facts).__name__}; fetch the folder again")
    return facts


class _Facts:
    """The values in a file with the defaults of its family. Every method raises `GearError` for a value of the
    wrong type.
    """

    def __init__(self, family: Family, content: Mapping[str, Any], path: Path) -> None:
        self.family = family
        self._content = content
        self._all = family.facts(content)
        self._path = path

    def refuse(self, key: str, wanted: str) -> GearError:
        """The error for a value that cannot be used."""
        return GearError(f"{self._path}: {key} must be {wanted}, got {self._all.get(key)!r:.80}")

    def check_steps(self) -> None:
        """Refuses steps that gear does not implement."""
        for key in (key for key in self._all if key.startswith("do_")):
            if self.flag(key) and key not in self.family.steps():
                raise GearError(
                    f"{self._path}: {key} is a step that gear does not do; write an adapter (docs/write-a-model.md)"
                )
        if self.flag("do_pad") and self._all.get("pad_size"):
            raise GearError(f"{self._path}: pad_size is not supported; take it out, and pictures keep their own size")

    def flag(self, key: str) -> bool:
        """Whether a step is switched on; steps that the file does not mention are off."""
        value = self._all.get(key, False)
        if not isinstance(value, bool):
            raise self.refuse(key, "true or false")
        return value

    def number(self, key: str) -> float:
        """The number above 0 that belongs to a key."""
        value = self._all[key]
        if not (_is_number(value) and 0 < value <= MOST_PX):
            raise self.refuse(key, "a number above 0")
        return float(value)

    def pixels(self, key: str) -> int:
        """The whole number of pixels above 0 that belongs to a key."""
        value = self._all.get(key)
        if not _is_pixels(value):
            raise self.refuse(key, f"a whole number of pixels, 1 to {MOST_PX}")
        return int(value)

    def channels(self, key: str, *, is_positive: bool) -> Channels:
        """The three numbers, one for each channel, that belong to a key."""
        value = self._all[key]
        if (
            not isinstance(value, list | tuple)
            or len(value) != 3
            or not all(_is_number(each) and (each > 0 or not is_positive) for each in value)
        ):
            raise self.refuse(key, f"three numbers{' above 0' if is_positive else ''}")
        return float(value[0]), float(value[1]), float(value[2])

    def mode(self) -> str:
        """torch's interpolation mode for the file's `resample`."""
        value = self._all["resample"]
        if type(value) is not int or value not in RESAMPLING:
            raise self.refuse("resample", "nearest (0), bilinear (2) or bicubic (3)")
        return RESAMPLING[value]

    def size(self) -> dict[str, int]:
        """The file's `size`: `height` and `width`, or `shortest_edge` and optionally `longest_edge`."""
        value = self._all["size"]
        if _is_pixels(value):
            if self.family.is_square:
                return {"height": int(value), "width": int(value)}
            edges = {"shortest_edge": int(value)}
            if "longest_edge" in self.family.defaults["size"]:
                edges["longest_edge"] = self.pixels("max_size") if "max_size" in self._all else DETR_LONGEST_PX
            return edges
        content = {key: each for key, each in value.items() if each is not None} if isinstance(value, dict) else {}
        is_known = content.keys() == {"height", "width"} or "shortest_edge" in content.keys() <= _EDGES
        if not is_known or not all(_is_pixels(each) for each in content.values()):
            raise self.refuse("size", f"height and width, or shortest_edge, in whole pixels, 1 to {MOST_PX}")
        return {key: int(each) for key, each in content.items()}


_EDGES = {"shortest_edge", "longest_edge"}


def _processor(name: str, facts: _Facts, needed_px: int, *, resizes: bool) -> Processor:
    does_resize = facts.flag("do_resize")
    if resizes and facts.flag("do_center_crop"):
        # The part outside the crop would have no prediction, but labels cover the whole picture.
        raise facts.refuse("do_center_crop", "false (or set input_size to picture), for gear scores whole pictures")
    size = facts.size() if does_resize and name != "GLPN" else None
    scale = 255 * facts.number("rescale_factor") if facts.flag("do_rescale") else 255.0
    mean, std = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
    if facts.flag("do_normalize") and name != "MobileViT":  # the image processor of MobileViT never normalises
        mean, std = facts.channels("image_mean", is_positive=False), facts.channels("image_std", is_positive=True)
    multiple_px = _multiple_px(name, facts, size) if does_resize else 1
    pads_to_px = facts.pixels("size_divisor") if name == "DPT" and facts.flag("do_pad") else 0
    fits = multiple_px % needed_px == 0 or (pads_to_px and pads_to_px % needed_px == 0)
    if not (does_resize and resizes) and not fits:
        multiple_px = needed_px
    return Processor(
        mean=_divided(mean, scale),
        std=_divided(std, scale),
        size=size if resizes else None,
        mode=facts.mode() if does_resize else "bilinear",
        multiple_px=multiple_px,
        keeps_ratio=name in ("DPT", "ZoeDepth") and facts.flag("keep_aspect_ratio"),
        rounds_down=name in ("GLPN", "Yolos"),
        pads_to_px=pads_to_px,
        has_margin=name == "ZoeDepth" and facts.flag("do_pad"),
        aligns_corners=name == "ZoeDepth",
        is_bgr=facts.flag("do_flip_channel_order"),
    )


def _multiple_px(name: str, facts: _Facts, size: dict[str, int] | None) -> float:
    if name == "GLPN":
        return facts.pixels("size_divisor")
    if name == "Yolos" and size and "longest_edge" in size:
        return YOLOS_PATCH_PX
    return facts.number("ensure_multiple_of") if "ensure_multiple_of" in facts.family.defaults else 1


def _patch_px(config: object) -> int:
    """Side of the network's patches in pixels, of which the input's sides are multiples; 1 if the config states
    none.
    """
    content = [getattr(each, "patch_size", None) for each in (config, getattr(config, "backbone_config", None))]
    return math.lcm(*(int(each) for each in content if _is_pixels(each)))


def _divided(channels: Channels, scale: float) -> Channels:
    return channels[0] / scale, channels[1] / scale, channels[2] / scale


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < math.inf


def _is_pixels(value: object) -> TypeGuard[float]:
    return _is_number(value) and 1 <= value <= MOST_PX and value == int(value)
