"""The inputs of an attack."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gear.values.errors import DatasetError
from gear.verbs.attack.job import _task_of, _usable


def split(*auxiliary: str) -> Any:
    return SimpleNamespace(root="d", plan=SimpleNamespace(auxiliary=auxiliary))


def spec(*, needs_probes: bool) -> Any:
    return SimpleNamespace(needs_probes=needs_probes)


def test_a_missing_probe_matters_only_to_attacks_that_need_it() -> None:
    with_probes, without = split("probes"), split()
    assert _usable("transport", spec(needs_probes=True), [with_probes]) == "transport"
    assert _usable("transport", spec(needs_probes=False), [with_probes, without]) == "homography"
    assert _usable("homography", spec(needs_probes=True), [without]) == "homography"
    with pytest.raises(DatasetError, match="d: has no probes; collect it with --probes"):
        _usable("transport", spec(needs_probes=True), [with_probes, without])


def test_a_folder_without_datasets_is_named(tmp_path: Any) -> None:
    with pytest.raises(DatasetError, match="there is no dataset of gear's here"):
        _task_of([tmp_path])
