"""Attacks with gradients on the frames of drives, on a network whose depth grows with the redness of its picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor, nn

import gear
from gear.contracts.specs import ModelSpec
from gear.plugins.catalogue import Catalogue, Owner, PluginEntry
from gear.plugins.manager import catalogue
from gear.testing.tiny_networks import as_batch
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.verbs.attack.drives import rounds
from gear.verbs.attack.drives.rounds import RoundMonitor
from gear.verbs.attack.monitor import Recorder
from tests.verbs.attack.drives.conftest import NEAR

TEXT = f"""
drivers:
  red: {{controller: depth_baseline, model: red_depth, options: {{width_px: 96, height_px: 48}}}}
towns: {{"{TINY_TOWN}": [board]}}
library: "LIBRARY"
scenarios: {{near_lead: [30]}}
crowd: 0
collect: {{quality: fast, scenes: "{TINY_SCENES}"}}
"""

ATTACK: dict[str, Any] = {
    "attack": "scene_specific",
    "steps": 8,
    "redrive": 5,
    "frames": 5,
    "settings": ["height_px=12", "width_px=24", "batch=1", "learning_rate=0.3"],
    "held_out": 0,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class NoOptions:
    """Options of a network without options."""


class RedDepth(nn.Module):
    """Predicts one depth for all pixels: 20 m plus 500 m times the mean of red minus blue."""

    def __init__(self, config: NoOptions) -> None:
        super().__init__()
        self.metres = nn.Parameter(torch.tensor(500.0))

    def forward(self, views: Mapping[str, Tensor], targets: Sequence[Any] | None = None) -> Mapping[str, Tensor]:
        pictures = views["left"]
        redness = (pictures[:, 0] - pictures[:, 2]).mean(dim=(1, 2))
        depth_m = (20.0 + self.metres * redness)[:, None, None].expand(-1, *pictures.shape[2:])
        return {"depth_m": depth_m}

    def predict(self, views: Mapping[str, Any]) -> Any:
        with torch.no_grad():
            return self.forward(as_batch([{"left": views["left"]}]))["depth_m"][0].numpy().astype(np.float32)

    def taps(self) -> Mapping[str, nn.Module]:
        return {}


@pytest.fixture
def red_depth(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The path of a drive config whose driver sees by the network `red_depth`."""
    spec = ModelSpec(
        name="red_depth",
        summary="depth by redness",
        config=NoOptions,
        build=RedDepth,
        tasks=("depth",),
        views=("left",),
    )
    entry = PluginEntry(kind="model", spec=spec, owner=Owner(plugin="red", package="other", version="1.0"))
    every = Catalogue((*catalogue().found, entry))
    monkeypatch.setattr("gear.plugins.build.catalogue", lambda: every)
    (tmp_path / "near.yml").write_text(NEAR)
    path = tmp_path / "red.yml"
    path.write_text(TEXT.replace("LIBRARY", str(tmp_path / "near.yml")))
    return path


@pytest.mark.slow
def test_patches_are_optimised_on_frames_of_drives_in_rounds(
    red_depth: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    report = gear.attack_drive(red_depth, out=tmp_path / "a", **ATTACK)
    rgb = report.patches[0].rgb.reshape(-1, 3).mean(axis=0)
    assert abs(rgb[0] - rgb[2]) > 0.5, "the patch turns red, or turns blue"
    assert report.facts["steps_done"] == 8 and len(report.facts["curves"]["large"]) == 8
    for number in range(2):
        frames = gear.open_dataset(tmp_path / f"a/rounds/frames_{number}", split="train")
        assert len(frames) == 5 and frames.plan.recipe is None and "drives" in frames.plan.content

    made: list[int] = []
    real = rounds.Rounds._round

    def killed(self: Any, number: int, model: Any, scenes: Any) -> Any:
        made.append(number)
        if made == [0, 1]:
            raise KeyboardInterrupt
        return real(self, number, model, scenes)

    monkeypatch.setattr(rounds.Rounds, "_round", killed)
    with pytest.raises(KeyboardInterrupt):
        gear.attack_drive(red_depth, out=tmp_path / "b", **ATTACK)
    again = gear.attack_drive(red_depth, out=tmp_path / "b", **ATTACK)
    assert made == [0, 1, 1], "the first round is not repeated"
    assert again.patches[0].rgb.tobytes() == report.patches[0].rgb.tobytes()

    on_pictures = gear.attack(
        tmp_path / "a/rounds/frames_0", model="red_depth", out=tmp_path / "c", steps=2, settings=ATTACK["settings"]
    )
    assert on_pictures.made, "the frames of a drive are ordinary data of gear attack"


def test_a_round_ends_with_its_last_step(tmp_path: Path) -> None:
    recorder = Recorder(root=tmp_path, key="k", steps=4)
    kept: list[Any] = []
    monitor = RoundMonitor(recorder=recorder, until=2, on_end=kept.append)
    assert monitor.resume() is None
    state = {"done": np.int64(1)}
    assert not monitor.step(1, {"harm": 0.5}, lambda: (), lambda: state) and not kept
    assert monitor.step(2, {"harm": 0.7}, lambda: (), lambda: state) and kept == [()]
    following = Recorder(root=tmp_path, key="k", steps=4)
    assert following.resume() == state and following.done == 2 and list(following.curves["harm"]) == [0.5, 0.7]
