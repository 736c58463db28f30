"""Two trainings that are started at once in one folder are kept apart."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gear.values.errors import DatasetError
from gear.verbs.train.run import train


def test_the_second_is_refused_and_the_first_goes_on(street: Callable[..., Path], tmp_path: Path, install: Any) -> None:
    tried: list[int] = []

    def begin_another(progress: Any, share: float, metrics: Any) -> None:
        tried.append(progress.step)
        with pytest.raises(DatasetError, match="another gear run is using this folder; wait for its end"):
            train("semseg", "tiny_segmenter", street("semseg"), out=tmp_path / "out", epochs=1)

    arguments: dict[str, Any] = {"epochs": 2, "batch": 2, "workers": 1}
    lone = train("semseg", "tiny_segmenter", street("semseg"), out=tmp_path / "lone", **arguments)
    first = train(
        "semseg", "tiny_segmenter", street("semseg"), out=tmp_path / "out", on_step=begin_another, **arguments
    )
    assert tried and first.weights.read_bytes() == lone.weights.read_bytes()
    with pytest.raises(DatasetError, match="holds a training with other settings"):
        train("semseg", "tiny_segmenter", street("semseg"), out=tmp_path / "out", epochs=1)
