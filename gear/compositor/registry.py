"""Makes compositors by their names, `transport` or `homography`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gear.compositor.base import CACHE_BYTES, BaseCompositor, Prepared
from gear.dataset.probe_files import demand_probes
from gear.values.errors import UnknownNameError

if TYPE_CHECKING:
    import torch

    from gear.compositor.cache import Cache
    from gear.dataset.reading import Dataset

COMPOSITORS = ("transport", "homography")
"""Names of all compositors; the first one is the default."""


def open_compositor(
    name: str,
    dataset: Dataset[Any],
    *,
    device: str | torch.device = "cpu",
    rounding: bool = False,
    cache_bytes: int = CACHE_BYTES,
    cache: Cache[Prepared] | None = None,
) -> BaseCompositor:
    """Makes a compositor for the samples of one dataset.

    Args:
        name: one of `COMPOSITORS`.
        dataset: the split whose samples are composed; `transport` needs a split that was collected with probes (samples
            rendered with each patch surface black and white).
        device: torch device to compute on.
        rounding: whether patches and pictures are rounded to multiples of 1/255, as in files.
        cache_bytes: memory limit for prepared samples.
        cache: a cache that several compositors share; None for a new one of `cache_bytes`.

    Raises:
        UnknownNameError: there is no compositor with this name.
        DatasetError: the compositor needs probes and the dataset has none.
    """
    more: dict[str, Any] = {"device": device, "rounding": rounding, "cache_bytes": cache_bytes, "cache": cache}
    if name == "transport":
        from gear.compositor.transport import TransportCompositor

        demand_probes(dataset)
        return TransportCompositor(dataset, **more)
    if name == "homography":
        from gear.compositor.homography import HomographyCompositor

        return HomographyCompositor(dataset, **more)
    raise UnknownNameError("compositor", name, COMPOSITORS)
