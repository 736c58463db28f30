"""Reads a network's feature maps during the forward pass of a sample or a batch."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import torch
from torch import Tensor, nn

from gear.contracts.models import Model
from gear.networks.network import as_batch
from gear.values.errors import GearError
from gear.values.frames import UInt8Image
from gear.values.progress import Progress

PAPERS_DEEPEST = "ct1"
"""Layer of BiSeNet that Z-Mask's supplement uses for detection, although `ct0` is deeper."""


class _AllMapsKept(BaseException):
    """Ends a forward pass as soon as all wanted feature maps are kept.

    It is no `Exception`, so that a network that handles its own errors does not catch it.
    """


def feature_maps(model: Model, views: Mapping[str, UInt8Image], names: Iterable[str]) -> dict[str, Tensor]:
    """Feature maps of one sample: (C, h, w) float32 on the CPU by name of the tap (layer), no gradients.

    Args:
        model: model with these taps.
        views: (H, W, 3) uint8 pictures by camera name.
        names: names of the taps.

    Raises:
        GearError: the model has no such tap, or the tap's output is not a feature map.
    """
    with torch.no_grad():
        return {name: maps[0] for name, maps in tapped(model, as_batch([views], tuple(views)), names).items()}


def tapped(model: Model, batch: Mapping[str, Tensor], names: Iterable[str]) -> dict[str, Tensor]:
    """Feature maps of a batch by name of the tap (the layer that is read), with gradients if torch records them.

    The forward pass ends after the last of these layers: the rest of the network is not computed.

    Args:
        model: model with these taps.
        batch: (B, 3, H, W) pictures in 0..1 by camera name.
        names: names of the taps.

    Returns:
        (B, C, h, w) float32 on the CPU by name of the tap. If a tap processes both pictures of stereo pairs in one
        batch, left pictures first, only the maps of the left pictures are returned.

    Raises:
        GearError: the model has no such tap, or the tap's output is not a feature map.
    """
    taps, wanted = model.taps(), tuple(dict.fromkeys(names))
    count = len(next(iter(batch.values())))
    seen: dict[str, Tensor] = {}
    lacking = [name for name in wanted if name not in taps]
    if lacking:
        has = ", ".join(taps) or "none"
        raise GearError(f"the model has no feature maps {', '.join(lacking)}; it has {has}")

    def keep(name: str) -> Callable[[nn.Module, Any, Any], None]:
        def hook(_: nn.Module, __: Any, output: Any) -> None:
            # The output is copied, because a later layer may change it in place. Of several runs, the first counts.
            if isinstance(output, Tensor):
                seen.setdefault(name, output[:count].to("cpu", torch.float32, copy=True))
            if len(seen) == len(wanted):
                raise _AllMapsKept

        return hook

    handles = [taps[name].register_forward_hook(keep(name)) for name in wanted]
    try:
        with contextlib.suppress(_AllMapsKept):
            model.forward(batch)
    finally:
        for handle in handles:
            handle.remove()
    for name in wanted:
        if name not in seen or seen[name].ndim != 4:
            raise GearError(f"the model's tap {name!r} gives no feature map of (B, C, H, W)")
    return {name: seen[name] for name in wanted}


def deepest(model: Model, views: Mapping[str, UInt8Image]) -> str:
    """Returns the name of the tap (readable layer) whose feature map has the fewest cells; `ct1` for BiSeNet.

    If several feature maps have the fewest cells, it is the last of these taps. The model runs once, without gradients,
    except for BiSeNet.

    Args:
        model: model with taps.
        views: (H, W, 3) uint8 pictures of one sample by camera name.

    Raises:
        GearError: the model has no taps.
    """
    names = tuple(model.taps())
    if not names:
        raise GearError("the model has no feature maps to look at")
    if PAPERS_DEEPEST in names:
        return PAPERS_DEEPEST
    maps = feature_maps(model, views, names)
    return min(reversed(names), key=lambda name: maps[name].shape[1] * maps[name].shape[2])


def spread(items: Sequence[Any], max_count: int, on_item: Progress) -> Iterator[Any]:
    """Yields at most `max_count` items of a sequence, evenly spaced, starting with the first.

    Args:
        items: the sequence; an item is read only when it is yielded.
        max_count: largest number of items, at least 1.
        on_item: called after the use of each item with the numbers of used and of all yielded items.
    """
    count = min(max_count, len(items))
    for index in range(count):
        yield items[index * len(items) // count]
        on_item(index + 1, count)
