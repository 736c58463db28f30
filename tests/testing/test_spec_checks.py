"""Checks of specs for all kinds of plugins."""

from __future__ import annotations

from dataclasses import replace

import pytest

from gear.plugins.build import find
from gear.testing.spec_checks import check_spec


def test_a_sound_spec_passes_with_its_options() -> None:
    check_spec("defense", find("defense", "jpeg").spec, {"quality": 40})


def test_a_broken_spec_says_why() -> None:
    spec = find("defense", "jpeg").spec
    with pytest.raises(AssertionError, match="name"):
        check_spec("defense", replace(spec, name="Not A Name"), {})
    with pytest.raises(AssertionError):
        check_spec("defense", replace(spec, summary="two\nlines"), {})
