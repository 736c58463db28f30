"""Two attacks that are started at once in one folder are kept apart."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.values.errors import DatasetError
from gear.verbs.attack.run import attack
from tests.verbs.attack.conftest import SMALL
from tests.verbs.conftest import Install, Small


@pytest.mark.parametrize("force", [False, True])
def test_the_second_is_refused_and_the_first_goes_on(
    small: Small, install: Install, tmp_path: Path, force: bool
) -> None:
    tried: list[int] = []

    def begin_another(done: int, steps: int) -> None:
        tried.append(done)
        with pytest.raises(DatasetError, match="another gear run is using this folder; wait for its end"):
            attack(small(), model="tiny_segmenter", out=tmp_path / "p", steps=3, settings=SMALL, force=force)

    first = attack(
        small(), model="tiny_segmenter", out=tmp_path / "p", steps=2, settings=SMALL, on_progress=begin_another
    )
    assert first.made and len(tried) == 3
    again = attack(small(), model="tiny_segmenter", out=tmp_path / "p", steps=2, settings=SMALL)
    assert not again.made and again.facts["steps_done"] == 2
