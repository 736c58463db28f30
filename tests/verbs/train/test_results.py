"""The results of a training."""

from __future__ import annotations

import math
import shlex
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gear.dataset.files import sha256
from gear.values.errors import DatasetError
from gear.verbs.train.results import (
    CARD,
    HISTORY,
    WEIGHTS,
    check_kept,
    command_of,
    is_kept,
    known,
    metrics_of,
    write_weights,
)


def progress(digest: str) -> Any:
    return SimpleNamespace(best_sha256=digest)


def test_the_command_repeats_the_call() -> None:
    flags = {"epochs": 3, "time_budget": None, "allow_test_data": True, "force": False}
    command = command_of("depth", "net", ["a b"], ["v"], flags, ["options.width=8"])
    assert shlex.split(command) == [
        "gear", "train", "--task", "depth", "--model", "net", "--data", "a b", "--val", "v",
        "--epochs", "3", "--allow-test-data", "--set", "options.width=8", "--out", "DIR",
    ]  # fmt: skip
    assert "--val" not in command_of("depth", "net", ["a"], [], {}, [])


def test_metrics_are_finite_and_without_times() -> None:
    validation = {"step": 3, "elapsed_s": 1.0, "took_s": 0.5, "loss": 0.25, "miou": math.nan}
    assert metrics_of(validation).keys() == {"loss", "miou"}
    assert known(metrics_of(validation)) == {"loss": 0.25}


def test_new_weights_remove_the_files_that_describe_old_ones(tmp_path: Path) -> None:
    for name in (CARD, HISTORY):
        (tmp_path / name).write_text("old")
    write_weights(tmp_path, b"weights")
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == [WEIGHTS]
    assert is_kept(tmp_path, progress(sha256(b"weights")))
    assert is_kept(tmp_path, progress(""))
    check_kept(tmp_path, progress(sha256(b"weights")))


def test_missing_or_other_weights_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="is gone; put it back"):
        check_kept(tmp_path, progress(""))
    (tmp_path / WEIGHTS).write_bytes(b"other")
    assert not is_kept(tmp_path, progress(sha256(b"weights")))
    with pytest.raises(DatasetError, match="is not what this training kept"):
        check_kept(tmp_path, progress(sha256(b"weights")))
