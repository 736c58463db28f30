"""The reference frame that shows whether a renderer works."""

from __future__ import annotations

import pytest

from gear.render.probing import probe, renderer_info
from gear.values.errors import UnknownNameError


def test_the_same_renderer_gives_the_same_frame() -> None:
    first, second = probe("classic", quality="fast"), probe("classic", quality="fast")
    assert first.sha256 == second.sha256
    assert len(first.sha256) == 64
    assert first.info == second.info == renderer_info("classic")
    assert first.info.name == "classic"
    assert min(first.start_s, first.frame_s) > 0


def test_an_unknown_renderer_is_one_line() -> None:
    with pytest.raises(UnknownNameError, match="no renderer named 'clasic'; did you mean classic"):
        probe("clasic")
