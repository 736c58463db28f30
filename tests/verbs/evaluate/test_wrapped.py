"""`gear evaluate` of a network that a defense wraps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import gear
from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.bit_depth import BitDepth, BitDepthConfig
from gear.testing.tiny_networks import TinyConfig, TinySegmenter
from gear.verbs.evaluate.run import evaluate
from tests.verbs.conftest import Install, Small
from tests.verbs.evaluate.conftest import Views, model_spec


class Passing:
    """Changes what `predict` sees, and hands on everything else of the model inside."""

    def __init__(self, bare: Any) -> None:
        self.bare = bare

    def __getattr__(self, name: str) -> Any:
        return getattr(self.bare, name)

    def predict(self, views: Views) -> Any:
        return self.bare.predict({name: 255 - picture for name, picture in views.items()})


class Around(BitDepth):
    def wrap(self, model: Any) -> Any:
        return Passing(model)


def test_no_batch_passes_a_wrapping_defense_by(tmp_path: Path, small: Small, install: Install) -> None:
    shown = []

    class Watched(TinySegmenter):
        def predict(self, views: Views) -> Any:
            shown.append(views["left"].astype(int))
            return super().predict(views)

        def predict_many(self, samples: Any) -> Any:
            return [self.predict(views) for views in samples]

    around: DefenseSpec[BitDepthConfig] = DefenseSpec(
        name="around", summary="Wraps.", config=BitDepthConfig, build=Around
    )
    install(around, model_spec(lambda _: Watched(TinyConfig()), "semseg"))
    for batch in (1, 2):
        out = tmp_path / str(batch)
        evaluate(small("semseg"), model="odd", defense="around", defense_settings=["bits=7"], out=out, batch=batch)
    pictures = [sample.images["left"].astype(int) for sample in gear.open_dataset(small("semseg"))]
    for seen, picture in zip(shown, pictures * 2, strict=True):
        assert np.abs(seen - (255 - picture)).max() <= 1
