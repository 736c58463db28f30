"""A driver whose loop can be attacked in a known way: the more magenta its picture, the farther it takes obstacles."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gear.contracts.controllers import Observation
from gear.contracts.specs import ControllerSpec
from gear.plugins.catalogue import Catalogue, Owner, PluginEntry
from gear.plugins.controllers.baseline import BaselineConfig
from gear.plugins.controllers.corridor import Corridor
from gear.plugins.controllers.tracker import Sighting
from gear.plugins.controllers.truth import Truth
from gear.plugins.manager import catalogue
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN

FARTHER_M = 20_000.0
"""Distance that is added to a true gap for a picture that is magenta everywhere, metres."""

TEXT = f"""
drivers:
  magenta_blind: {{controller: magenta_blind, task: depth, options: {{width_px: 96, height_px: 48}}}}
  truth: {{controller: truth}}
towns: {{"{TINY_TOWN}": [board]}}
library: "LIBRARY"
scenarios: {{near_lead: [30]}}
crowd: 0
collect: {{quality: fast, scenes: "{TINY_SCENES}"}}
"""


NEAR = "scenarios: {near_lead: {summary: a car stands in the lane, ttc_s: 2.5, duration_s: 3.0, lead: {}}}"
"""Library of one short scenario."""


class MagentaBlind(Truth):
    """Sees the true gap, plus a distance that grows with the share of magenta pixels; nothing else is magenta."""

    def nearest(self, observation: Observation, corridor: Corridor) -> Sighting | None:
        found = super().nearest(observation, corridor)
        if found is None:
            return None
        picture = np.asarray(next(iter(observation.views.values())), np.float64) / 255
        share = float((np.minimum(picture[..., 0], picture[..., 2]) - picture[..., 1] > 0.3).mean())
        return replace(found, gap_m=found.gap_m + FARTHER_M * share)


@pytest.fixture
def magenta_blind(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The path of a drive config with the driver `magenta_blind`, whose controller is registered as a plugin."""
    spec = ControllerSpec(
        name="magenta_blind",
        summary="believes obstacles farther if the picture is magenta",
        config=BaselineConfig,
        build=MagentaBlind,
        needs_truth=True,
        needs_views=True,
    )
    entry = PluginEntry(kind="controller", spec=spec, owner=Owner(plugin="magenta", package="other", version="1.0"))
    every = Catalogue((*catalogue().found, entry))
    monkeypatch.setattr("gear.plugins.build.catalogue", lambda: every)
    path = tmp_path / "magenta.yml"
    (tmp_path / "near.yml").write_text(NEAR)
    path.write_text(TEXT.replace("LIBRARY", str(tmp_path / "near.yml")))
    return path
