"""Weights into the package: what their file and card say, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import torch

from authoring.weights.renew import renew
from authoring.weights.ship import ship
from gear.measuring.appearance_hash import Appearance, current_appearance
from gear.measuring.guarded_model import weights_digest
from gear.networks.options import SegmentationOptions
from gear.networks.shipped import inspect
from gear.networks.weights import read, write
from gear.plugins.models.ddrnet23_slim import build
from gear.values.errors import GearError
from gear.values.serial import to_json
from gear.verbs.weights.average import average_weights

MODEL = "ddrnet23_slim"


def estimate(value: float | None) -> dict[str, float | None]:
    return {"value": value, "low": value and value - 0.1, "high": value and value + 0.1}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as `gear train` leaves it, of a network that has learnt nothing."""
    root = tmp_path_factory.mktemp("base") / "runs" / "semseg"
    root.mkdir(parents=True)
    texts = {
        "model": MODEL, "task": "semseg", "gear": "0.1.0", "seed": "3", "look_hash": "ab12",
        "options": '{"input_scale": 0.5}',
    }  # fmt: skip
    network = build(SegmentationOptions(weights="none", device="cpu"))
    write(root / "model.safetensors", network.module().state_dict(), texts | {"metrics": '{"miou": 0.9}'}, halves=True)
    base = root.parents[1]
    history = {
        "command": f"gear train --task semseg --model {MODEL} --data {base}/data --out DIR",
        "training": [
            {"scene": "town10/truck", "weather": "ClearNoon", "split": "train", "seed": 1, "patch": "-", "samples": 7}
        ],
        "finished_steps": 12, "elapsed_s": 240.0, "best_step": 11,
    }  # fmt: skip
    (root / "train.json").write_text(json.dumps(history))
    return root


@pytest.fixture
def evaluation(run: Path, tmp_path: Path) -> Path:
    metrics = {"reference": {"miou": estimate(0.625), "iou_train": estimate(None)}}
    row: dict[str, Any] = {"samples": 3, "metrics": metrics, "dataset": {"root": "held-out/suburb-billboard05"}}
    loaded = build(SegmentationOptions(weights=str(run / "model.safetensors"), device="cpu"))
    results = {
        "model": {"name": MODEL, "weights_sha256": weights_digest(loaded)},
        "rows": [row, row],
        "together": [{"patch": "none", "samples": 6, "metrics": metrics}],
    }
    (tmp_path / "results.json").write_text(json.dumps(results))
    return tmp_path


def test_the_file_has_the_same_numbers_and_says_what_was_measured(run: Path, evaluation: Path, tmp_path: Path) -> None:
    path = ship([run], evaluation, run.parents[1], tmp_path / "models", samples=7, settings=["crowd=5"])
    assert path.name == f"{MODEL}.safetensors"
    facts = inspect(path).facts()
    assert facts["metrics"] == {"miou": 0.625} and facts["intervals"] == {"miou": [0.525, 0.725]}
    assert facts["options"] == {"input_scale": 0.5} and facts["look_hash"] == "ab12"
    collect, train = facts["command"].split(" && ")
    assert collect == "python -m authoring.weights training --task semseg --out . --samples 7 --set crowd=5"
    assert train == f"gear train --task semseg --model {MODEL} --data data --out runs/semseg"
    before, after = read(run / "model.safetensors")[0], read(path)[0]
    assert before.keys() == after.keys() and all(bool((before[key] == after[key]).all()) for key in before)


def test_a_mean_is_shipped_in_place_of_the_run_s_own(run: Path, tmp_path: Path, evaluation: Path) -> None:
    mean = run.parents[1] / "mean.safetensors"
    other = build(SegmentationOptions(weights="none", device="cpu", seed=1)).module().state_dict()
    write(tmp_path / "before.safetensors", other, {"model": MODEL})
    average_weights(tmp_path / "before.safetensors", run / "model.safetensors", mean, share=0.25)
    results = json.loads((evaluation / "results.json").read_text())
    with pytest.raises(GearError, match="not an evaluation of"):
        ship([run], evaluation, run.parents[1], tmp_path / "models", averaged=mean)
    loaded = build(SegmentationOptions(weights=str(mean), device="cpu"))
    results["model"]["weights_sha256"] = weights_digest(loaded)
    (evaluation / "results.json").write_text(json.dumps(results))
    path = ship([run], evaluation, run.parents[1], tmp_path / "models", averaged=mean)
    last = inspect(path).metadata["command"].split(" && ")[-1]
    assert last.startswith("gear weights average ") and last.endswith(
        "/model.safetensors mean.safetensors --share 0.25"
    )
    assert "the mean that the last command makes" in path.with_suffix(".md").read_text()
    key = "conv1.0.weight"
    wanted = 0.75 * other[key] + 0.25 * read(run / "model.safetensors")[0][key]
    assert torch.allclose(read(path)[0][key], wanted, atol=1e-3)


def test_the_card_says_how_they_came_and_how_good_they_are(run: Path, evaluation: Path, tmp_path: Path) -> None:
    card = ship([run, run], evaluation, run.parents[1], tmp_path / "models").with_suffix(".md").read_text()
    assert "| miou | 0.625 | 0.525 | 0.725 |" in card and "Nothing to measure for: iou_train." in card
    assert "On 6 pictures" in card and "| suburb-billboard05 | 3 | 0.625 |" in card
    assert "Made with gear 0.1.0, seed 3; the look that it knows is `ab12`." in card
    assert card.count("--data data --out runs/semseg") == 2 and str(run.parents[1]) not in card
    assert "| town10/truck | ClearNoon | train | 1 | - | 7 |" in card and "after step 11" in card


def test_other_weights_and_other_reports_are_refused(run: Path, evaluation: Path, tmp_path: Path) -> None:
    path = evaluation / "results.json"
    results = json.loads(path.read_text())
    path.write_text(json.dumps(results | {"model": {"name": MODEL, "weights_sha256": "0"}}))
    with pytest.raises(GearError, match="not an evaluation of"):
        ship([run], evaluation, run.parents[1], tmp_path / "models")
    path.write_text(json.dumps(results | {"together": [{"samples": 6, "metrics": {}}]}))
    with pytest.raises(GearError, match="no report 'reference'"):
        ship([run], evaluation, run.parents[1], tmp_path / "models")
    assert not (tmp_path / "models").exists()


def test_what_is_measured_again_keeps_its_numbers_and_its_history(run: Path, evaluation: Path, tmp_path: Path) -> None:
    models = tmp_path / "models"
    path = ship([run], evaluation, run.parents[1], models, note="First.")
    state, texts = read(path)
    trained = Appearance(assets={"nowhere": "1"}, renderers=("filament",), light="before", mujoco="4.0")
    write(path, state, texts | {"look": json.dumps(to_json(trained))}, halves=True)
    results = json.loads((evaluation / "results.json").read_text())
    results["together"][0]["metrics"]["reference"]["miou"] = estimate(0.7)
    (evaluation / "results.json").write_text(json.dumps(results))
    first = path.with_suffix(".md").read_text()
    assert renew(MODEL, evaluation, "Then the light changed.", models) == path
    facts, again = inspect(path).facts(), read(path)[0]
    assert facts["metrics"] == {"miou": 0.7} and facts["look"] == to_json(trained), "it was trained on no other"
    assert facts["look_hash"] == "ab12" and facts["command"] == texts["command"]
    assert facts["measured_look_hash"] == current_appearance(trained).hash != trained.hash
    assert all(bool((state[key] == again[key]).all()) for key in state)
    card = path.with_suffix(".md").read_text()
    assert "| miou | 0.700 | 0.600 | 0.800 |" in card
    assert "knows is `ab12`.\nMeasured on pictures of the look `" in card and f"`{facts['measured_look_hash']}`" in card
    assert "First.\n\nThen the light changed.\n\n## Training data\n" in card
    assert (
        card[card.index("## Made by") :].replace("Then the light changed.\n\n", "")
        == first[first.index("## Made by") :]
    )


def test_what_says_no_look_cannot_be_renewed(run: Path, evaluation: Path, tmp_path: Path) -> None:
    models = tmp_path / "models"
    ship([run], evaluation, run.parents[1], models)
    with pytest.raises(GearError, match="does not say what look"):
        renew(MODEL, evaluation, "Note.", models)
