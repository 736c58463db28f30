"""Torch datasets and batches of small rendered splits, and of a task that gear does not know."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import gear
from gear.collecting.run import CollectReport
from gear.readers import TorchDataset, batches, collate, order
from gear.testing.tiny_networks import TinyConfig, TinySegmenter
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import DatasetError, UnknownNameError
from gear.verbs.collect.run import collect
from tests.verbs.conftest import size_settings


@pytest.fixture(scope="module")
def roots(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    made: dict[str, Path] = {}

    def root(task: str) -> Path:
        if task not in made:
            made[task] = tmp_path_factory.mktemp(task)
            collect_into(task, made[task])
        return made[task]

    return root


def collect_into(task: str, out: Path) -> CollectReport:
    settings = [f"scenes={TINY_SCENES}", *size_settings(task)]
    return collect(
        task, town=TINY_TOWN, scene="board", split="debug", samples=3, renderer="classic", quality="fast", out=out,
        settings=settings, patch="random",
    )  # fmt: skip


def rolled(sample: Any, index: int, rng: np.random.Generator) -> Any:
    """An augmentation that draws, and is told which sample it changes."""
    assert sample.record.index == index
    shift = int(rng.integers(1, 50))
    return dataclasses.replace(
        sample,
        images={name: np.roll(picture, shift, axis=1) for name, picture in sample.images.items()},
        label_ids=np.roll(sample.label_ids, shift, axis=1),
    )


@pytest.mark.parametrize("task", ["semseg", "detect2d", "stereo3d", "depth"])
def test_every_task_gives_pictures_and_samples(roots: Callable[[str], Path], task: str) -> None:
    dataset = TorchDataset(roots(task))
    opened = gear.open_dataset(roots(task))
    assert len(dataset) == len(opened) == 3
    item = dataset[1]
    assert type(item.sample) is type(opened[1]) and item.sample.record == opened[1].record
    assert set(item.views) == set(opened[1].images)
    for name, tensor in item.views.items():
        assert tensor.dtype == torch.uint8
        assert np.array_equal(tensor.permute(1, 2, 0).numpy(), opened[1].images[name])
    (batch,) = batches(dataset, size=3)
    assert batch.indices == (0, 1, 2) and len(batch.samples) == 3
    for name, pictures in batch.views.items():
        assert pictures.shape == (3, *item.views[name].shape) and pictures.dtype == torch.float32
        assert torch.equal((pictures[1] * 255).round().byte(), item.views[name])
    assert set(TorchDataset(roots(task), views=["left"])[0].views) == {"left"}


def test_a_batch_is_what_a_model_takes(roots: Callable[[str], Path]) -> None:
    model = TinySegmenter(TinyConfig())
    for batch in batches(TorchDataset(roots("semseg")), size=2, seed=1):
        assert torch.isfinite(model.forward(batch.views, batch.samples)["loss"])


def test_the_order_follows_from_seed_and_epoch() -> None:
    assert order(5, seed=None) == [0, 1, 2, 3, 4]
    assert order(50, seed=3, epoch=1) == order(50, seed=3, epoch=1)
    assert sorted(order(50, seed=3)) == list(range(50))
    assert len({tuple(order(50, seed=seed, epoch=epoch)) for seed in (0, 1) for epoch in (0, 1)}) == 4


def test_passes_repeat_can_be_taken_up_and_leave_torch_alone(roots: Callable[[str], Path]) -> None:
    dataset = TorchDataset(roots("semseg"), change=rolled, seed=4)
    state = torch.random.get_rng_state()
    first = list(batches(dataset, size=2, seed=9, epoch=1))
    again = list(batches(dataset, size=2, seed=9, epoch=1))
    other = list(batches(dataset, size=2, seed=9, epoch=2))
    assert torch.equal(state, torch.random.get_rng_state())
    assert [batch.indices for batch in first] == [batch.indices for batch in again]
    for one, two in zip(first, again, strict=True):
        assert torch.equal(one.views["left"], two.views["left"])
    by_index = {i: b.views["left"][k] for b in other for k, i in enumerate(b.indices)}
    assert any(not torch.equal(b.views["left"][k], by_index[i]) for b in first for k, i in enumerate(b.indices)), (
        "every epoch draws anew"
    )
    (rest,) = batches(dataset, size=2, seed=9, epoch=1, start=1)
    assert rest.indices == first[1].indices and torch.equal(rest.views["left"], first[1].views["left"])
    assert [len(b.indices) for b in batches(dataset, size=2, only_full=True)] == [2]
    beside = zip(batches(dataset, size=1, epoch=1), batches(dataset, size=1, epoch=2), strict=True)
    alone = batches(dataset, size=1, epoch=1)
    for (one, _), lone in zip(beside, alone, strict=True):
        assert torch.equal(one.views["left"], lone.views["left"]), "another pass draws for itself"


def test_change_keeps_ground_truth_and_pictures_together(roots: Callable[[str], Path]) -> None:
    changed = TorchDataset(roots("semseg"), change=rolled)[0]
    plain = TorchDataset(roots("semseg"))[0]
    shifts = [
        s for s in range(1, 50) if np.array_equal(np.roll(plain.sample.label_ids, s, 1), changed.sample.label_ids)
    ]
    assert any(torch.equal(torch.roll(plain.views["left"], s, 2), changed.views["left"]) for s in shifts)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:This DataLoader will create")  # on a machine of one core
def test_worker_processes_change_nothing(roots: Callable[[str], Path]) -> None:
    dataset = TorchDataset(roots("semseg"), change=rolled, seed=4)
    here = list(batches(dataset, size=2, seed=9, epoch=3))
    there = list(batches(dataset, size=2, seed=9, epoch=3, workers=2))
    assert [b.indices for b in here] == [b.indices for b in there]
    for one, two in zip(here, there, strict=True):
        assert torch.equal(one.views["left"], two.views["left"])
        assert all(np.array_equal(a.label_ids, b.label_ids) for a, b in zip(one.samples, two.samples, strict=True))


def test_what_cannot_be_read_is_said(tmp_path: Path, roots: Callable[[str], Path]) -> None:
    with pytest.raises(DatasetError, match="no split 'train'"):
        TorchDataset(roots("semseg"), "train")
    with pytest.raises(ValueError, match="at least 1"):
        list(batches(TorchDataset(roots("semseg")), size=0))
    with pytest.raises(ValueError, match="0 or more, got -1"):
        list(batches(TorchDataset(roots("semseg")), size=1, start=-1))
    with pytest.raises(UnknownNameError, match=r"no camera in .* named 'lefd'; did you mean left"):
        TorchDataset(roots("semseg"), views=["lefd"])


def test_torchs_own_loader_takes_it(roots: Callable[[str], Path]) -> None:
    dataset = TorchDataset(roots("semseg"))
    (own,) = batches(dataset, size=3)
    (batch,) = torch.utils.data.DataLoader(dataset, batch_size=3, collate_fn=collate)
    assert batch.indices == own.indices and torch.equal(batch.views["left"], own.views["left"])
    assert [item.index for item in torch.utils.data.DataLoader(dataset, batch_size=None)] == [0, 1, 2]
