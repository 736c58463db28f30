from __future__ import annotations

import argparse
import collections
import datetime
import enum
import os
import pickle
import types
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import nn

from gear.networks.checkpoints import read_published
from gear.networks.weights import write
from gear.values.errors import GearError

STATE = {"a.weight": torch.arange(6.0).view(2, 3), "a.bias": torch.ones(2)}


def same(state: dict[str, torch.Tensor]) -> bool:
    return state.keys() == STATE.keys() and all(torch.equal(state[key], STATE[key]) for key in STATE)


@pytest.mark.parametrize("zipped", [True, False], ids=["zip", "old"])
@pytest.mark.parametrize(
    "content",
    [
        STATE,
        {"model": STATE, "optimizer": {"state": {}, "lr": 0.1}, "epoch": 3, "iteration": 7},
        {"state_dict": STATE, "best": np.float64(0.7), "step": np.int64(4), "kind": np.dtype("f4")},
        {"model": {"state_dict": STATE}, "uncert": torch.zeros(6)},
        {f"module.{key}": value for key, value in STATE.items()},
        {"model": {f"module.{key}": value for key, value in STATE.items()}},
        {"ema": dict.fromkeys(STATE, torch.zeros(1)), "model": STATE},
        {"optimizer": {"state": {"a": torch.zeros(1)}}, "checkpoint": {"model": STATE}},
        {"model": STATE, "args": argparse.Namespace(lr=1, out=Path("/runs/a"), classes=["road"])},
        {"model": STATE, "curve": np.linspace(0, 1, 3), "names": types.SimpleNamespace(a=1)},
    ],
    ids=[
        "plain",
        "checkpoint",
        "numpy",
        "nested",
        "parallel",
        "parallel checkpoint",
        "ema",
        "optimiser",
        "arguments",
        "arrays",
    ],
)
def test_official_kinds_of_files_are_read(tmp_path: Path, content: Any, zipped: bool) -> None:
    path = tmp_path / "a.pth"
    torch.save(content, path, _use_new_zipfile_serialization=zipped)
    assert same(read_published(path))


def test_safetensors_are_read_too(tmp_path: Path) -> None:
    write(tmp_path / "a.safetensors", {f"module.{key}": value for key, value in STATE.items()}, {})
    assert same(read_published(tmp_path / "a.safetensors"))


class Settings(dict[str, Any]):
    """A configuration, like those of OmegaConf, EasyDict and yacs."""


class Kind(enum.Enum):
    SMALL = 1


class Run:
    def __init__(self) -> None:
        self.settings, self.kind = Settings(lr=0.1), Kind.SMALL


@pytest.mark.parametrize("zipped", [True, False], ids=["zip", "old"])
def test_objects_of_other_packages_are_left_out(tmp_path: Path, zipped: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Their classes are neither needed nor run."""
    monkeypatch.setattr(Settings, "__setitem__", lambda *_: pytest.fail("run"))
    nested = Settings({"a": Settings({"b": 1}), "kinds": [Kind.SMALL, Run()]})
    plain = {"when": datetime.datetime(2026, 1, 1), "log": collections.defaultdict(list, a=[1]), "x": range(3)}
    path = tmp_path / "a.pth"
    for content in ({"model": STATE, "cfg": nested}, {"model": Settings(STATE)}, {"model": STATE, **plain}):
        torch.save(content, path, _use_new_zipfile_serialization=zipped)
        assert same(read_published(path))


class Evil:
    """Makes a file when it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> Any:
        return Path.touch, (self.mark,)


@pytest.mark.parametrize("zipped", [True, False], ids=["zip", "old"])
def test_a_file_that_wants_to_run_something_is_refused_by_name(tmp_path: Path, zipped: bool) -> None:
    mark, path = tmp_path / "mark", tmp_path / "a.pth"
    for content, name in (
        (nn.Linear(2, 2), "torch.nn.modules.linear.Linear"),
        ({"model": STATE, "x": Evil(mark)}, "pathlib|getattr"),
    ):
        torch.save(content, path, _use_new_zipfile_serialization=zipped)
        with pytest.raises(GearError, match=f"refused, because reading it would run .*({name})") as caught:
            read_published(path)
        assert "\n" not in str(caught.value)
    assert not mark.exists()


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_a_bare_pickle_is_refused_by_what_it_wants(tmp_path: Path, protocol: int) -> None:
    mark, path = tmp_path / "mark", tmp_path / "a.pkl"
    for content, name in (({"model": 1, "x": Evil(mark)}, "pathlib|getattr"), (len, "len"), ([len, len], "len")):
        path.write_bytes(pickle.dumps(content, protocol))
        with pytest.raises(GearError, match=f"refused, because reading it would run .*({name})"):
            read_published(path)
    assert not mark.exists()


def test_a_torchscript_archive_is_refused(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.jit.save(torch.jit.trace(nn.Linear(2, 2), torch.zeros(1, 2)), tmp_path / "a.pt")
    with pytest.raises(GearError, match="TorchScript archive, which holds code") as caught:
        read_published(tmp_path / "a.pt")
    assert "weights_only" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", "not a checkpoint of PyTorch's"),
        (b"hello world" * 10, "not a checkpoint of PyTorch's"),
        (pickle.dumps({1: 2}, 0), "not a checkpoint"),
        (b"PK\x03\x04 but no archive", "not a checkpoint of PyTorch's"),
        (bytes(2048), "not a checkpoint of PyTorch's"),
    ],
    ids=["empty", "text", "pickle", "broken zip", "zeros"],
)
def test_what_is_no_checkpoint_is_said_in_one_line(tmp_path: Path, content: bytes, problem: str) -> None:
    (tmp_path / "a.pth").write_bytes(content)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(GearError, match=problem) as caught:
            read_published(tmp_path / "a.pth")
    assert "\n" not in str(caught.value) and "weights_only" not in str(caught.value)


def test_what_holds_no_network_is_refused(tmp_path: Path) -> None:
    for content, problem in (([1, 2], "but a list"), ({"epoch": 3}, r"but epoch"), ({}, "but nothing")):
        torch.save(content, tmp_path / "a.pth")
        with pytest.raises(GearError, match=problem):
            read_published(tmp_path / "a.pth")
    with pytest.raises(GearError, match="no such weights file"):
        read_published(tmp_path / "b.pth")
    os.mkfifo(tmp_path / "c.pth")
    with pytest.raises(GearError, match="is a FIFO; a file was asked for"):
        read_published(tmp_path / "c.pth")
