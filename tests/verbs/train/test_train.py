"""`gear train` with tiny networks: it learns, says where weights come from, and goes on where it was stopped."""

from __future__ import annotations

import itertools
import json
import os
import shlex
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save as to_bytes

import gear
from gear.cli.commands.train import budget
from gear.cli.main import main
from gear.config.reader import read_node
from gear.networks.weights import load_into, read, write
from gear.plugins.build import find
from gear.testing.tiny_networks import TinyConfig, TinySegmenter, tiny_segmenter
from gear.values.errors import DatasetError, GearError, PluginError, UnknownNameError
from gear.verbs.train import loop
from gear.verbs.train.checkpoint import TrainingState
from gear.verbs.train.config import read_config
from gear.verbs.train.run import TrainReport, train, trainable
from gear.verbs.train.starting import with_scale

Street = Callable[..., Path]


def quick(street: Street, out: Path, **changes: Any) -> TrainReport:
    arguments: dict[str, Any] = {"epochs": 3, "batch": 2, "workers": 1, "out": out}
    return train("semseg", "tiny_segmenter", street("semseg"), **(arguments | changes))


def test_it_learns_and_leaves_everything_behind(street: Street, tmp_path: Path, install: Any) -> None:
    report = quick(street, tmp_path / "out", epochs=8, lr=0.02)
    history = json.loads((tmp_path / "out" / "train.json").read_text())
    losses = [entry["loss"] for entry in history["validations"]]
    assert len(losses) == 8 and losses[-1] < 0.8 * losses[0]
    assert report.steps == 16 and report.metrics["miou"] == max(e["miou"] for e in history["validations"])
    assert (tmp_path / "out" / "curves.png").stat().st_size > 5000
    card = (tmp_path / "out" / "card.md").read_text()
    assert report.weights.name in card and "gear train --task semseg --model tiny_segmenter" in card
    network = TinySegmenter(TinyConfig(seed=9))
    metadata = load_into(network, report.weights)
    assert metadata["model"] == "tiny_segmenter" and metadata["seed"] == "0"
    assert json.loads(metadata["metrics"])["miou"] == report.metrics["miou"]
    assert json.loads(metadata["data"])["training"][0]["samples"] == 5
    sample = gear.open_dataset(street("semseg"))[0]
    seen = np.mean(network.predict(sample.images) == sample.label_ids)
    fresh = np.mean(TinySegmenter(TinyConfig()).predict(sample.images) == sample.label_ids)
    assert seen > fresh


def test_matrices_are_halved_and_statistics_are_not(street: Street, tmp_path: Path, install: Any) -> None:
    report = quick(street, tmp_path / "out", epochs=1)
    with safe_open(str(report.weights), framework="pt") as opened:
        kinds = {key: opened.get_tensor(key).dtype for key in opened.keys()}  # noqa: SIM118
    assert kinds["stem.weight"] == torch.float16
    assert kinds["norm.running_var"] == kinds["stem.bias"] == torch.float32


class StopError(Exception):
    """A power cut."""


@pytest.mark.parametrize("stop_at", [1, 3, 5])
def test_stopped_and_taken_up_again_is_as_if_never_stopped(
    street: Street, tmp_path: Path, install: Any, monkeypatch: pytest.MonkeyPatch, stop_at: int
) -> None:
    monkeypatch.setattr(loop, "CHECKPOINT_EVERY_S", 0.0)
    settings = ["augmentation.colours.noise=1", "gradient_norm=1", "crop_px=[32, 64]", "scales=[0.8, 1.2]"]
    whole = quick(street, tmp_path / "whole", settings=settings)

    def stop(progress: TrainingState, share: float, metrics: Any) -> None:
        if progress.step == stop_at:
            raise StopError

    with pytest.raises(StopError):
        quick(street, tmp_path / "parts", settings=settings, on_step=stop)
    parts = quick(street, tmp_path / "parts", settings=settings, workers=2)
    assert parts.weights.read_bytes() == whole.weights.read_bytes()
    assert parts.metrics == whole.metrics and parts.steps == whole.steps
    one, two = (json.loads((report.root / "train.json").read_text()) for report in (whole, parts))
    assert one["steps"] == two["steps"]


@pytest.mark.slow
def test_a_killed_process_is_taken_up_again(street: Street, tmp_path: Path, install: Any) -> None:
    code = (
        "import os, signal, sys\n"
        "from gear.plugins import build\n"
        "from gear.plugins.catalogue import Catalogue, Owner, PluginEntry\n"
        "from gear.plugins.manager import catalogue\n"
        "from gear.testing.tiny_networks import tiny_segmenter\n"
        "from gear.verbs.train import loop\n"
        "from gear.verbs.train.run import train\n"
        "owner = Owner(plugin='tiny', package='tiny', version='0')\n"
        "found = (*catalogue().found, PluginEntry(kind='model', spec=tiny_segmenter, owner=owner))\n"
        "build.catalogue = lambda: Catalogue(found)\n"
        "loop.CHECKPOINT_EVERY_S = 0.0\n"
        "stop = int(sys.argv[3])\n"
        "def watch(progress, share, metrics):\n"
        "    if progress.step == stop: os.kill(os.getpid(), signal.SIGKILL)\n"
        "train('semseg', 'tiny_segmenter', sys.argv[1], out=sys.argv[2], epochs=3, batch=2, on_step=watch)\n"
    )

    def run(out: str, stop: int) -> int:
        words = [sys.executable, "-c", code, str(street("semseg")), str(tmp_path / out), str(stop)]
        return subprocess.run(words, check=False, env={**os.environ, "OMP_NUM_THREADS": "1"}).returncode

    assert run("whole", 0) == 0
    assert run("parts", 3) == -signal.SIGKILL
    assert run("parts", 0) == 0
    weights = [(tmp_path / out / "model.safetensors").read_bytes() for out in ("whole", "parts")]
    assert weights[0] == weights[1]


def test_what_is_half_written_lies_where_the_next_run_tidies_up(
    street: Street, tmp_path: Path, install: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    results = ["card.md", "checkpoint.safetensors", "curves.png", "model.safetensors", "samples.jpg", "train.json"]
    street("semseg")
    beside: set[str] = set()
    sync = os.fsync

    def look(descriptor: int) -> None:
        beside.update(path.name for path in (tmp_path / "out").iterdir())
        sync(descriptor)

    monkeypatch.setattr(os, "fsync", look)
    quick(street, tmp_path / "out", epochs=1)
    assert beside <= {*results, "gear"} and sorted(path.name for path in (tmp_path / "out").iterdir()) == results


def test_finished_work_is_not_done_again(street: Street, tmp_path: Path, install: Any) -> None:
    first = quick(street, tmp_path / "out")
    steps: list[int] = []
    again = quick(street, tmp_path / "out", on_step=lambda progress, *_: steps.append(progress.step))
    assert not steps and again == first
    with pytest.raises(DatasetError, match=r"other settings \(config.batch differ\)"):
        quick(street, tmp_path / "out", batch=3)


def test_damaged_work_is_said_in_a_line(street: Street, tmp_path: Path, install: Any) -> None:
    first = quick(street, tmp_path / "out")
    checkpoint = tmp_path / "out" / "checkpoint.safetensors"
    whole = checkpoint.read_bytes()
    for damaged in (whole[: len(whole) // 2], b"", b"\x02\0\0\0\0\0\0\0{}"):
        checkpoint.write_bytes(damaged)
        with pytest.raises(DatasetError, match=r"is damaged .*; delete it to train from the start"):
            quick(street, tmp_path / "out")
    checkpoint.unlink()
    assert quick(street, tmp_path / "out").metrics == first.metrics


def test_a_damaged_checkpoint_is_one_line(street: Street, tmp_path: Path, install: Any) -> None:
    quick(street, tmp_path / "out")
    checkpoint = tmp_path / "out" / "checkpoint.safetensors"
    with safe_open(str(checkpoint), framework="pt") as opened:
        texts: dict[str, str] = dict(opened.metadata())
        tensors = {key: opened.get_tensor(key).clone() for key in opened.keys()}  # noqa: SIM118
    progress: dict[str, Any] = json.loads(texts["progress"])
    broken: list[Any] = [None, [], {}, *(progress | {name: "x"} for name in progress)]
    broken += [progress | change for change in ({"best_step": 99}, {"validations": [{}]})]
    broken += [progress | {"position": {"epoch": 1, "batch": None}}, progress | {"steps": [{"step": None}]}]
    cases = [(tensors, texts | {"progress": json.dumps(one)}) for one in broken]
    cases.append((tensors, texts | {"progress": "[" * 100_000}))
    for key in (
        "module.stem.weight",
        "mean.stem.weight",
        *[key for key in tensors if key.startswith("optimiser.")][:2],
    ):
        cases.append(({**tensors, key: torch.zeros(3, 7)}, texts))
        cases.append(({name: tensor for name, tensor in tensors.items() if name != key}, texts))
    cases += [({**tensors, f"optimiser.{key}": torch.zeros(2)}, texts) for key in ("x.y", "99.exp_avg")]
    for changed, said in cases:
        checkpoint.write_bytes(to_bytes(changed, said))
        with pytest.raises(DatasetError, match=r"is damaged .*; delete it to train from the start") as caught:
            quick(street, tmp_path / "out")
        assert "\n" not in str(caught.value)


def test_the_seed_decides(street: Street, tmp_path: Path, install: Any) -> None:
    one, two = quick(street, tmp_path / "a", seed=1), quick(street, tmp_path / "b", seed=2)
    assert one.weights.read_bytes() != two.weights.read_bytes()


def test_global_random_state_is_left_alone(street: Street, tmp_path: Path, install: Any) -> None:
    before = torch.random.get_rng_state()
    quick(street, tmp_path / "out", epochs=1)
    assert torch.equal(before, torch.random.get_rng_state())


def test_depth_in_half_precision_with_validation_data_of_its_own(street: Street, tmp_path: Path, install: Any) -> None:
    report = train(
        "depth", "tiny_depth", street("depth"), val=street("depth", "val", 2), out=tmp_path / "out", epochs=2,
        precision="bfloat16", settings=["optimiser=sgd", "augmentation.cut_depth=0.5"],
    )  # fmt: skip
    history = json.loads((tmp_path / "out" / "train.json").read_text())
    assert history["validation"][0]["split"] == "val" and history["validation"][0]["samples"] == 2
    assert report.metric == "eigen_d1" and report.steps == 6


def test_a_time_budget_ends_it(street: Street, tmp_path: Path, install: Any) -> None:
    report = quick(street, tmp_path / "out", epochs=None, time_budget_s=0.5)
    assert report.elapsed_s >= 0.5


def test_with_a_time_budget_the_rate_follows_the_clock(
    street: Street, tmp_path: Path, install: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = itertools.count()
    monkeypatch.setattr(loop, "time", SimpleNamespace(perf_counter=lambda: next(clock) / 100))
    monkeypatch.setattr(loop, "NOTE_EVERY", 1)
    quick(street, tmp_path / "out", epochs=None, time_budget_s=0.5)
    history = json.loads((tmp_path / "out" / "train.json").read_text())
    rates = [point["rate"] for point in history["steps"]]
    highest = rates.index(max(rates))
    falling = rates[highest:]
    assert len(rates) > 20 and highest < 5 and falling == sorted(falling, reverse=True)
    assert falling[-1] < 0.05 * falling[0]


def test_the_noted_command_has_the_whole_time_budget(street: Street, tmp_path: Path, install: Any) -> None:
    for number, seconds in enumerate((1e-5, 0.0123456789)):
        quick(street, tmp_path / f"{number}", epochs=None, time_budget_s=seconds)
        words = shlex.split(json.loads((tmp_path / f"{number}" / "train.json").read_text())["command"])
        assert budget(words[words.index("--time-budget") + 1]) == seconds
    quick(street, tmp_path / "none", epochs=1, time_budget_s=0)
    assert "--time-budget" not in (tmp_path / "none" / "train.json").read_text()


def test_patience_ends_it(street: Street, tmp_path: Path, install: Any) -> None:
    report = quick(street, tmp_path / "out", epochs=50, lr=1e-12, settings=["patience=2", "ema=0"])
    assert report.steps < 50 * 2


def test_test_splits_are_not_learnt_from(street: Street, tmp_path: Path, install: Any) -> None:
    root = street("semseg", "test", 2)
    with pytest.raises(GearError, match="split 'test' is what networks are tested on"):
        train("semseg", "tiny_segmenter", root, out=tmp_path / "out")
    report = train("semseg", "tiny_segmenter", root, out=tmp_path / "out", epochs=1, batch=1, allow_test_data=True)
    command = json.loads((tmp_path / "out" / "train.json").read_text())["command"]
    assert "--batch 1 --allow-test-data --out DIR" in command
    assert report.steps == 1


def test_what_cannot_be_trained_is_said_in_a_line(street: Street, tmp_path: Path, install: Any) -> None:
    out = tmp_path / "out"
    with pytest.raises(GearError, match="'tiny_depth' does depth, not semseg"):
        train("semseg", "tiny_depth", street("semseg"), out=out)
    with pytest.raises(DatasetError, match="holds a semseg dataset, not depth"):
        train("depth", "tiny_depth", street("semseg"), out=out)
    with pytest.raises(DatasetError, match="no such folder"):
        train("semseg", "tiny_segmenter", tmp_path / "nowhere", out=out)
    with pytest.raises(DatasetError, match="holds no dataset"):
        train("semseg", "tiny_segmenter", tmp_path, out=out)
    for val in ((), street("semseg")):
        with pytest.raises(GearError, match="there are no data to train on"):
            train("semseg", "tiny_segmenter", [], val=val, out=out)
    with pytest.raises(UnknownNameError, match="no start named 'imagenet'"):
        quick(street, out, init="imagenet")
    with pytest.raises(GearError, match="no such file"):
        quick(street, out, init="nothing.safetensors")
    with pytest.raises(GearError, match=r"^--val .* shows the same streets as --data"):
        quick(street, out, val=street("semseg"))
    with pytest.raises(DatasetError, match="is a dataset; train into a folder of its own"):
        quick(street, street("semseg"))
    with pytest.raises(GearError, match="too few to keep some"):
        train("semseg", "tiny_segmenter", street("semseg", "train", 1), out=out)
    install(replace(tiny_segmenter, recipe=None))
    with pytest.raises(GearError, match="gives no recipe"):
        quick(street, out)
    assert not out.exists()


def test_training_starts_with_the_given_weights(street: Street, tmp_path: Path, install: Any) -> None:
    first = quick(street, tmp_path / "first", epochs=4, lr=0.02)
    second = quick(street, tmp_path / "second", epochs=1, lr=1e-9, init=first.weights, settings=["ema=0"])
    assert second.metrics["miou"] == pytest.approx(first.metrics["miou"], abs=0.05)

    def zeros(model: Any) -> None:
        for parameter in model.parameters():
            parameter.data.zero_()

    install(replace(tiny_segmenter, starts={"nothing": zeros}))
    report = quick(street, tmp_path / "third", epochs=1, lr=1e-9, init="nothing")
    with safe_open(str(report.weights), framework="pt") as opened:
        assert float(opened.get_tensor("stem.weight").abs().max()) < 1e-6


def test_it_begins_with_the_trunk_of_another_network(street: Street, tmp_path: Path, install: Any) -> None:
    """What has the same keys and shapes is taken, the rest stays random, and stderr says how much that is."""
    first = quick(street, tmp_path / "first", epochs=4, lr=0.02)
    state, _ = read(first.weights)
    other = tmp_path / "other.safetensors"
    write(other, {**state, "head.weight": torch.zeros(1, 2, 3, 3), "more": torch.zeros(3)}, {})
    said: list[str] = []
    begun = quick(
        street, tmp_path / "begun", epochs=1, lr=1e-9, settings=["ema=0"], init=f"trunk:{other}", on_warning=said.append
    )
    after, _ = read(begun.weights)
    assert torch.allclose(after["stem.weight"], state["stem.weight"], atol=1e-3)
    assert after["head.weight"].shape == state["head.weight"].shape
    assert not torch.allclose(after["head.weight"], state["head.weight"], atol=1e-3)
    assert any("of the network's numbers are those of other.safetensors" in line for line in said)
    write(other, {"stem.weight": torch.zeros(1)}, {})
    with pytest.raises(GearError, match="has 0% of this network's numbers"):
        quick(street, tmp_path / "none", init=f"trunk:{other}")
    with pytest.raises(UnknownNameError, match="no reference weights named 'ddrnet23_slm'; did you mean ddrnet23_slim"):
        quick(street, tmp_path / "none", init="trunk:ddrnet23_slm")
    with pytest.raises(GearError, match="there is no such weights file"):
        quick(street, tmp_path / "none", init="trunk:gone.safetensors")
    assert not (tmp_path / "none").exists()


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaledConfig(TinyConfig):
    """Runs at a share of its pictures' size."""

    input_scale: float | None = None


def test_weights_say_at_which_share_of_the_tasks_own_pictures_they_work(
    street: Street, tmp_path: Path, install: Any
) -> None:
    seen: list[float | None] = []

    def build(config: ScaledConfig) -> TinySegmenter:
        seen.append(config.input_scale)
        return TinySegmenter(config)

    install(replace(tiny_segmenter, config=ScaledConfig, build=build))

    def options(out: str, **changes: Any) -> dict[str, Any]:
        report = quick(street, tmp_path / out, epochs=1, **changes)
        with safe_open(str(report.weights), framework="pt") as opened:
            found: dict[str, Any] = json.loads(opened.metadata()["options"])
        return found

    assert options("a") == {"input_scale": 128 / 2048} and set(seen) == {1.0}
    assert "0.0625 times as wide" in (card := (tmp_path / "a" / "card.md").read_text()) and "input_scale=1`" in card
    assert options("b", settings=["options.input_scale=0.5", "options.width=4"]) == {
        "input_scale": 0.5 * 128 / 2048,
        "width": 4,
    }


def test_a_training_goes_on_at_the_share_that_its_first_weights_were_trained_for(tmp_path: Path, install: Any) -> None:
    install(replace(tiny_segmenter, config=ScaledConfig, build=TinySegmenter))
    found, first = find("model", "tiny_segmenter"), tmp_path / "first.safetensors"
    write(first, {"stem.weight": torch.zeros(1)}, {"options": json.dumps({"input_scale": 0.75})})

    def scale(init: str, share: float = 1.0, *settings: str) -> Any:
        config = read_config(trainable(found, "semseg"), {"init": init}, settings)
        return read_node(ScaledConfig, with_scale(found, config, share).options).input_scale

    assert scale(str(first)) == 0.75
    assert scale(str(first), 0.5) == 1, "small pictures are seen as they are"
    assert scale(str(first), 1.0, "options.input_scale=0.5") == 0.5
    write(first, {"stem.weight": torch.zeros(1)}, {})
    assert scale(str(first)) is scale("") is scale(f"trunk:{first}") is None


@pytest.mark.parametrize("before", ["", "trunk:"])
def test_what_was_begun_goes_on_when_the_file_that_it_began_with_is_gone(
    street: Street, tmp_path: Path, install: Any, monkeypatch: pytest.MonkeyPatch, before: str
) -> None:
    """The checkpoint has all that the next step depends on, and the share that the file spoke of."""
    monkeypatch.setattr(loop, "CHECKPOINT_EVERY_S", 0.0)
    install(replace(tiny_segmenter, config=ScaledConfig, build=TinySegmenter))
    monkeypatch.setattr("gear.verbs.train.run.picture_share", lambda *_: 1.0)
    state = {key: value.clone() for key, value in TinySegmenter(ScaledConfig(seed=3)).module().state_dict().items()}
    first = tmp_path / "first.safetensors"
    write(first, state, {"options": json.dumps({"input_scale": 0.75})})
    whole = quick(street, tmp_path / "whole", init=f"{before}{first}")

    def stop(progress: TrainingState, share: float, metrics: Any) -> None:
        raise StopError

    with pytest.raises(StopError):
        quick(street, tmp_path / "parts", init=f"{before}{first}", on_step=stop)
    first.unlink()
    parts = quick(street, tmp_path / "parts", init=f"{before}{first}")
    assert parts.weights.read_bytes() == whole.weights.read_bytes()
    with pytest.raises(GearError, match="there is no such"):
        quick(street, tmp_path / "fresh", init=f"{before}{first}")
    with pytest.raises(GearError, match="there is no such"):
        quick(street, tmp_path / "parts", init=f"{before}{tmp_path / 'other.safetensors'}")


@dataclass(frozen=True, kw_only=True)
class CameraConfig(TinyConfig):
    """Knows its pictures' camera."""

    hfov_deg: float = 90.0


def test_a_network_for_another_camera_is_refused(street: Street, tmp_path: Path, install: Any) -> None:
    install(replace(tiny_segmenter, config=CameraConfig))
    with pytest.raises(GearError, match=r"collected with hfov_deg 90, .* 60; say --model-set hfov_deg=90"):
        quick(street, tmp_path / "out", settings=["options.hfov_deg=60"])
    assert not (tmp_path / "out").exists()


def test_what_the_training_sets_is_no_option(street: Street, tmp_path: Path, install: Any) -> None:
    with pytest.raises(GearError, match=r"options.seed is set by the training; say it with --seed"):
        quick(street, tmp_path / "out", settings=["options.seed=3"])
    assert not (tmp_path / "out").exists()


def test_the_command(street: Street, tmp_path: Path, install: Any, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["train", "--task", "semseg", "--model", "tiny_segmenter", "--data", str(street("semseg"))]
    assert main([*words, "--out", str(tmp_path / "out"), "--epochs", "1", "--set", "options.width=4"]) == 0
    captured = capsys.readouterr()
    assert "model.safetensors: miou" in captured.out and "miou" in captured.err
    assert main([*words, "--out", str(tmp_path / "x"), "--set", "augmentation.flop=1"]) == 2
    assert "unknown key (did you mean 'flip'?)" in capsys.readouterr().err


class Faulty(TinySegmenter):
    """Gives what it likes where it is given targets, and as a prediction."""

    def __init__(self, config: TinyConfig, change: Callable[[Any], Any], answer: Any = None) -> None:
        super().__init__(config)
        self.change, self.said = change, answer

    def forward(self, views: Any, targets: Any = None) -> Any:
        outputs = super().forward(views, targets)
        return outputs if targets is None else self.change(outputs)

    def predict(self, views: Any) -> Any:
        return super().predict(views) if self.said is None else self.said


@pytest.mark.parametrize(
    ("change", "answer", "message"),
    [
        (lambda losses: {}, None, "failed at forward: TypeError: must give losses by name .*, got none"),
        (lambda losses: None, None, "failed at forward: TypeError: must give losses by name .*, got NoneType"),
        (lambda losses: {"loss": losses["loss"].detach()}, None, "do not depend on anything that can be trained"),
        (lambda losses: losses["los"], None, "failed at forward: KeyError"),
        (lambda losses: losses, "road", "failed at prediction: AttributeError"),
    ],
)
def test_a_third_partys_network_that_breaks_its_promise_is_named(
    street: Street, tmp_path: Path, install: Any, change: Any, answer: Any, message: str
) -> None:
    install(replace(tiny_segmenter, build=lambda config: Faulty(config, change, answer)))
    with pytest.raises(PluginError, match=f"tiny_segmenter .*{message}"):
        quick(street, tmp_path / "out", epochs=1)
