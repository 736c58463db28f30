"""The parts of a training, each alone."""

from __future__ import annotations

import argparse
import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import nn

from gear.cli.commands.train import budget
from gear.config.nodes import Mapping, Place
from gear.config.reader import read_node
from gear.contracts.models import Recipe
from gear.readers import Samples, all_of, open_all
from gear.values.errors import ConfigError, GearError
from gear.verbs.train.config import TrainConfig, read_config
from gear.verbs.train.data import keep_some, spread
from gear.verbs.train.feed import Feed, Position
from gear.verbs.train.optimise import Buffers, RunningMean, optimiser_of, rate_share
from gear.verbs.train.validate import rank

CONFIG = read_node(TrainConfig, Mapping({}, Place("test")))


def test_the_rate_rises_and_falls() -> None:
    rates = [rate_share(p / 1000, warmup_fraction=0.1, final=0.01) for p in range(1001)]
    assert rates[0] == pytest.approx(0.01) and rates[100] == pytest.approx(1) and rates[-1] == pytest.approx(0.01)
    assert np.argmax(rates) == 100 and rates[550] == pytest.approx((1 + 0.01) / 2)
    assert all(np.diff(rates[:101]) > 0) and all(np.diff(rates[100:]) < 0)
    assert rate_share(0.0, warmup_fraction=0.0, final=0.01) == 1


def test_the_running_mean_follows_and_counts_are_the_newest() -> None:
    module = nn.BatchNorm1d(2)
    mean = RunningMean(module, 0.9)
    with torch.no_grad():
        module.weight.fill_(3.0)
        module.num_batches_tracked.fill_(7)
    mean.update(module, 10**6)
    assert mean.state["weight"].tolist() == pytest.approx([1.2, 1.2])
    assert mean.state["num_batches_tracked"].item() == 7
    mean.update(module, 0)
    assert mean.state["weight"].tolist() == pytest.approx([0.1 * 1.2 + 0.9 * 3] * 2)


def test_what_a_broken_step_wrote_is_undone() -> None:
    module = nn.BatchNorm1d(2)
    before = Buffers(module)
    module(torch.tensor([[1.0, float("inf")], [2.0, 3.0]]))
    assert not torch.isfinite(module.running_mean).all()
    before.put_back()
    assert module.running_mean.tolist() == [0, 0] and module.running_var.tolist() == [1, 1]
    assert module.num_batches_tracked.item() == 0


def test_biases_do_not_decay_and_frozen_weights_are_left_out() -> None:
    module = nn.Sequential(nn.Linear(2, 3), nn.Linear(3, 1))
    module[1].weight.requires_grad_(False)
    decaying, still = optimiser_of(module, CONFIG).param_groups
    assert [tuple(p.shape) for p in decaying["params"]] == [(3, 2)] and decaying["weight_decay"] > 0
    assert [tuple(p.shape) for p in still["params"]] == [(3,), (1,)] and still["weight_decay"] == 0


@dataclass(frozen=True)
class Goal:
    metric: str = "d1"
    lower_is_better: bool = False


def test_checkpoints_are_ranked_by_the_tasks_metric_and_then_by_the_loss() -> None:
    def ranked(goal: Any, **metrics: float) -> tuple[float, float]:
        return rank(metrics, goal)

    more, less = Goal(), Goal(lower_is_better=True)
    assert ranked(more, d1=0.9, loss=9) > ranked(more, d1=0.8, loss=1)
    assert ranked(less, d1=0.8, loss=9) > ranked(less, d1=0.9, loss=1)
    assert ranked(more, d1=0.5, loss=1) > ranked(more, d1=0.5, loss=2)
    assert ranked(more, d1=math.nan, loss=1) < ranked(more, d1=0.0, loss=9)
    assert ranked(Goal(metric=""), loss=1) > ranked(Goal(metric=""), loss=2)
    assert ranked(more, d1=math.nan, loss=math.nan) < ranked(more, d1=math.nan, loss=9)


def test_settings_go_before_flags_and_flags_before_the_recipe() -> None:
    recipe = Recipe(batch=3, epochs=7, crop_px=(64, 96))
    config = read_config(recipe, {"epochs": 8, "batch": None}, ["epochs=9", "augmentation.flip=0"])
    assert (config.batch, config.epochs, config.crop_px) == (3, 9, (64, 96))
    assert config.augmentation.flip == 0
    assert read_config(recipe, {}, ["crop_px=null"]).crop_px is None
    with pytest.raises(ConfigError, match=r"^--lr: .*expected float, got 'nan'"):
        read_config(Recipe(), {"learning_rate": math.nan})
    for setting in (
        "batch=0",
        "ema=1",
        "scales=[2, 1]",
        "scales=[1e-9, 1]",
        "scales=[1, 1e9]",
        "crop_px=[64, 99999]",
        "learning_rate=0",
        "warmup_fraction=1",
        "precision=int8",
    ):
        with pytest.raises(ConfigError, match=setting.split("=")[0]):
            read_config(recipe, {}, [setting])


def test_a_setting_below_the_word_of_another_setting_keeps_the_word() -> None:
    adversarial = read_config(Recipe(), {}, ["adversarial=scene_specific", "adversarial.share=0.25"]).adversarial
    assert (adversarial.attack, adversarial.share) == ("scene_specific", 0.25)


@dataclass(frozen=True)
class Numbered:
    images: dict[str, Any]
    number: int


class Numbers:
    def __init__(self, count: int) -> None:
        self.count, self.reads = count, [0] * count

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, index: int) -> Numbered:
        self.reads[index] += 1
        return Numbered(images={"left": np.full((32, 32, 3), index, np.uint8)}, number=index)


def plain(**changes: Any) -> TrainConfig:
    texts = [f"{key}={value}" for key, value in changes.items()]
    return read_config(Recipe(batch=3), {}, ["augmentation.colour=0", *texts])


def take(feed: Feed, position: Position, count: int) -> list[tuple[int, ...]]:
    batches = feed.from_position(position)
    found = [next(batches) for _ in range(count)]
    batches.close()  # type: ignore[attr-defined]
    for batch in found:
        assert [sample.number for sample in batch.samples] == list(batch.indices)
        assert torch.equal(batch.views["left"][:, 0, 0, 0], torch.tensor(batch.indices) / 255)
    return [batch.indices for batch in found]


@pytest.mark.parametrize("workers", [1, 4])
def test_batches_depend_on_the_position_alone(workers: int) -> None:
    feed = Feed(Numbers(11), plain(workers=workers), ("left",))
    assert feed.batches == 3
    whole = take(feed, Position(), 9)
    assert whole == take(Feed(Numbers(11), plain(), ("left",)), Position(), 9)
    assert take(feed, Position(1, 2), 4) == whole[5:9]
    first = [index for batch in whole[:3] for index in batch]
    assert len(set(first)) == 9 and first != [index for batch in whole[3:6] for index in batch]


def test_pictures_become_numbers_where_they_are_wanted() -> None:
    (batch,) = [next(Feed(Numbers(3), plain(), ("left",), device="meta").from_position(Position()))]
    assert batch.views["left"].device.type == "meta" and batch.views["left"].dtype == torch.float32
    assert batch.views["left"].shape == (3, 3, 32, 32)


class Growing(Numbers):
    """Pictures of several sizes."""

    def __getitem__(self, index: int) -> Numbered:
        return Numbered(images={"left": np.zeros((32, 32 + index, 3), np.uint8)}, number=index)


def test_pictures_that_fit_no_batch_are_an_error_with_advice() -> None:
    with pytest.raises(GearError, match=r"'left' of a batch must have one size, got .*; say --set crop_px=\[HEIGHT"):
        next(Feed(Growing(3), plain(), ("left",)).from_position(Position()))


def test_folders_of_roots_and_single_splits(street: Callable[..., Path], tmp_path: Path) -> None:
    for name, split in (("one", "train"), ("two", "finetuning")):
        (tmp_path / name).symlink_to(street("semseg", split))
    assert [d.root.name for d in open_all([tmp_path], "semseg", names=("train",))] == ["one", "two"]
    (found,) = open_all([f"{street('semseg')}:train"], "semseg", names=("val",))
    assert found.plan.info.split == "train"
    samples = all_of(open_all([tmp_path], "semseg", names=("train",)))
    assert len(samples) == 12 and samples[7].record.index == 1
    assert [fact["samples"] for fact in samples[:8].facts()] == [6, 2]  # type: ignore[call-overload,index]
    assert [place[1] for place in spread(samples, 4).places] == [0, 3, 0, 3]


def test_the_same_samples_are_not_taken_twice(street: Callable[..., Path], tmp_path: Path) -> None:
    (tmp_path / "again").symlink_to(street("semseg"))
    with pytest.raises(GearError, match=r"hold the same samples; give them once"):
        open_all([street("semseg"), tmp_path / "again"], "semseg", names=("train",))


def test_twins_are_kept_together(street: Callable[..., Path]) -> None:
    (dataset,) = open_all([street("semseg")], "semseg", names=("train",))
    plan = dataclasses.replace(dataset.plan, patch={"label": "random", "sha256": "0" * 64})
    twin = dataclasses.replace(dataset, plan=plan)
    assert plan.twin_key == dataset.plan.twin_key and plan.content_key != dataset.plan.content_key
    for seed in range(5):
        train, val = keep_some(all_of((dataset, twin)), 0.4, seed=seed)
        shown = [{place[1] for place in side.places} for side in (train, val)]
        assert not shown[0] & shown[1] and len(train) == 8 and len(val) == 4


def test_the_same_streets_in_another_weather_are_kept_together(street: Callable[..., Path]) -> None:
    """The seed and the scene decide what stands where, so labels would be known from training."""
    (dataset,) = open_all([street("semseg")], "semseg", names=("train",))
    plan = dataclasses.replace(dataset.plan, content={**dataset.plan.content, "weather": "another"})
    sunset = dataclasses.replace(dataset, plan=plan)
    assert plan.twin_key != dataset.plan.twin_key
    for seed in range(5):
        train, val = keep_some(all_of((dataset, sunset)), 0.4, seed=seed)
        shown = [{place[1] for place in side.places} for side in (train, val)]
        assert not shown[0] & shown[1] and len(train) == 8 and len(val) == 4
    info = dataclasses.replace(plan.info, seed=plan.info.seed + 1)
    other = dataclasses.replace(dataset, plan=dataclasses.replace(plan, info=info))
    assert len(keep_some(all_of((dataset, other)), 0.25, seed=0)[1]) == 3


def test_sequences_are_kept_together(street: Callable[..., Path]) -> None:
    (dataset,) = open_all([street("semseg")], "semseg", names=("train",))
    dataset.plan.content["frames"] = 2
    train, val = keep_some(Samples((dataset,), tuple((0, i) for i in range(6))), 0.4, seed=1)
    dataset.plan.content["frames"] = 1
    assert len(train) == 4 and len(val) == 2
    assert val.places[0][1] % 2 == 0 and val.places[1][1] == val.places[0][1] + 1


@pytest.mark.parametrize(("text", "seconds"), [("90s", 90), ("10m", 600), ("1.5h", 5400), ("2", 120)])
def test_times(text: str, seconds: float) -> None:
    assert budget(text) == seconds
    for wrong in ("", "0m", "ten", "-1m"):
        with pytest.raises(argparse.ArgumentTypeError):
            budget(wrong)
