"""`gear attack` and `gear gap` tell of a network that sees the pictures at another size than it learnt from."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
import torch

from gear.cli.main import main
from gear.config.overrides import with_overrides
from gear.contracts.specs import ModelSpec
from gear.measuring.plugin_selection import Chosen
from gear.measuring.shown_size import focal_note
from gear.networks.weights import write as write_weights
from gear.plugins.build import NO_OPTIONS, build, find
from gear.testing.tiny_networks import TinyConfig, TinySegmenter, tiny_segmenter
from tests.verbs.conftest import Copy

PATTERN = r"gear: note: .*: pictures are 320 px wide and tiny_segmenter sees them at 80 px; it learnt from 512 px, .*: "


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaledConfig(TinyConfig):
    weights: str = "none"
    input_scale: float | None = None
    hfov_deg: float = 90.0


def test_attack_and_gap_tell_of_it(
    small: Callable[..., Path],
    copy_small: Copy,
    install: Callable[..., None],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    weights = tmp_path / "net.safetensors"
    write_weights(weights, {"bias": torch.zeros(1)}, {"options": json.dumps({"input_scale": 0.25})})
    install(replace(tiny_segmenter, config=ScaledConfig, build=lambda _: TinySegmenter(TinyConfig())))
    copy_small("semseg", tmp_path / "twin", patch="random", split="train")

    attack = ["attack", "--model=tiny_segmenter", f"--data={small()}", "--steps=1", "--set=height_px=12"]
    attack += ["--set=width_px=24", "--set=batch=1"]
    gap = ["gap", str(small()), f"--twin={tmp_path / 'twin'}", "--model=tiny_segmenter", "--samples=1"]
    flag = "--model-set"
    for words in (attack, gap):
        out = f"--out={tmp_path / words[0]}"
        assert main([*words, f"{flag}=weights={weights}", out]) == 0
        (line,) = [one for one in capsys.readouterr().err.splitlines() if "note:" in one]
        assert re.fullmatch(f"{PATTERN}{flag} input_scale=1.6 corrects this", line)
        assert main([*words, f"{flag}=weights={weights}", f"{flag}=input_scale=1", f"{out}-given"]) == 0
        assert "note:" not in capsys.readouterr().err
    # What the user can put right in the models is not an option of the attack.
    assert main([*attack, "--model-set=hfov_deg=60", f"--out={tmp_path / 'lens'}"]) == 2
    assert re.search(r"assumes 60; say --model-set hfov_deg=\d+", capsys.readouterr().err)


@pytest.mark.parametrize(
    "name",
    [
        "ddrnet23_slim",
        "bisenet_x39",
        "ddrnet23_slim_depth",
        "glpn_b0",
        "adabins_lite0",
        "stereo_centre",
        "retinanet_lite0_fpn",
        "fasterrcnn_lite0_fpn",
    ],
)
def test_networks_run_at_the_share_that_their_spec_names(name: str) -> None:
    found = find("model", name)
    network = build(found, with_overrides(NO_OPTIONS, ["weights=none", "device=cpu"]))
    scale = network.sizing.inner_px((1000, 1000))[0] / 1000 if name.endswith("_fpn") else network.input_scale
    assert isinstance(found.spec, ModelSpec) and found.spec.input_scale == scale


def test_a_controller_with_another_focal_length_gives_a_warning(install: Callable[..., None]) -> None:
    install(replace(tiny_segmenter, config=ScaledConfig, build=lambda _: TinySegmenter(TinyConfig())))

    def note(options: list[str], *settings: str) -> str | None:
        model = Chosen(found=find("model", "tiny_segmenter"), options=with_overrides(NO_OPTIONS, list(settings)))
        return focal_note(model, "semseg", with_overrides(NO_OPTIONS, options), "driver a")

    small, weights = ["width_px=1024", "height_px=512"], "weights=trained"
    shown = note(small, weights)
    assert shown is not None and shown.startswith("driver a: its camera has a focal length of 512 px")
    assert "learnt from pictures of 1024 px, so objects look smaller" in shown and "options.focal_px=1024" in shown
    assert note([], weights) is None and note([*small, "focal_px=1024"], weights) is None
    assert note(small, weights, "input_scale=1") is None and note(small) is None
