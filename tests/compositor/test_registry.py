"""Compositors by name, with their options."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import torch

from gear.compositor.base import CACHE_BYTES
from gear.compositor.cache import Cache
from gear.compositor.homography import HomographyCompositor
from gear.compositor.registry import COMPOSITORS, open_compositor
from gear.compositor.transport import TransportCompositor
from gear.dataset.probe_files import KIND
from gear.values.errors import DatasetError, UnknownNameError


def split(*, probes: bool) -> Any:
    """A stand-in for a dataset, which says whether it has probes."""
    plan = SimpleNamespace(info=SimpleNamespace(split="train"), auxiliary=(KIND,) if probes else ())
    return SimpleNamespace(root=Path("data"), plan=plan)


@pytest.mark.parametrize(("name", "kind"), [("transport", TransportCompositor), ("homography", HomographyCompositor)])
def test_options_reach_the_compositor(name: str, kind: type) -> None:
    data, shared = split(probes=True), Cache[Any](1)
    made = open_compositor(name, data, device="meta", rounding=True, cache=shared)
    assert type(made) is kind and name in COMPOSITORS
    assert made.dataset is data and made.device == torch.device("meta") and made.rounding and made._cache is shared
    usual, small = open_compositor(name, data), open_compositor(name, data, cache_bytes=7)
    assert usual.device == torch.device("cpu") and not usual.rounding
    assert (usual._cache._max_bytes, small._cache._max_bytes) == (CACHE_BYTES, 7)


def test_only_transport_needs_probes() -> None:
    assert isinstance(open_compositor("homography", split(probes=False)), HomographyCompositor)
    with pytest.raises(DatasetError, match="has no probes"):
        open_compositor("transport", split(probes=False))


def test_an_unknown_name_is_an_error_with_the_most_similar_one() -> None:
    with pytest.raises(UnknownNameError, match="no compositor named 'transprot'; did you mean transport"):
        open_compositor("transprot", split(probes=True))
