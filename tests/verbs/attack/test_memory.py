"""What compositors work out takes one memory of an attack, however many collections it looks at."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from gear.compositor.base import CACHE_BYTES
from gear.compositor.registry import open_compositor
from gear.verbs.attack.run import attack
from tests.verbs.attack.conftest import SMALL
from tests.verbs.conftest import Install, Small


def test_all_collections_share_it(
    small: Small, install: Install, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    caches: list[Any] = []

    def opened(*given: Any, **more: Any) -> Any:
        caches.append(more["cache"])
        return open_compositor(*given, **more)

    monkeypatch.setattr("gear.verbs.attack.scenes.open_compositor", opened)
    attack(small(), model="tiny_segmenter", out=tmp_path, steps=1, settings=SMALL, val=small(split="val"), every=1)
    assert len(caches) == 2 and len({id(cache) for cache in caches}) == 1
    assert 0 < caches[0].nbytes <= CACHE_BYTES
