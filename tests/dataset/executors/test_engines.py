"""Engines are found by the name of their module."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.dataset import executors
from gear.dataset.executors.engines import engine_names, open_engine, open_executor
from gear.dataset.executors.in_process import InThisProcess
from gear.dataset.executors.processes import Processes
from gear.values.errors import GearError, UnknownNameError

ENGINE = """
from gear.dataset.executors.in_process import InThisProcess

def executor(*, workers, backend, address, needs):
    made = InThisProcess()
    made.asked = (workers, backend, needs.silence_s)
    return made
"""


def test_the_engine_of_one_machine_is_there() -> None:
    assert open_engine("processes", workers=3, backend="raster") == Processes(workers=3, backend="raster")
    with pytest.raises(UnknownNameError, match=r"'procesess'.*processes"):
        open_engine("procesess", workers=1, backend="raster")


def test_a_new_engine_is_one_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "cluster_of_mine.py").write_text(ENGINE)
    monkeypatch.setattr(executors, "__path__", [*executors.__path__, str(tmp_path)])
    assert engine_names() == ["cluster_of_mine", "processes", "ray", "slurm"]
    opened = open_engine("cluster_of_mine", workers=8, backend="film")
    assert isinstance(opened, InThisProcess) and vars(opened)["asked"] == (8, "film", 600.0)


def test_the_processes_of_one_machine_take_no_address() -> None:
    with pytest.raises(GearError, match="--address is for engines of several machines"):
        open_engine("processes", workers=1, backend="raster", address="auto")


def test_only_a_single_worker_of_the_default_engine_is_this_process() -> None:
    assert isinstance(open_executor("processes", workers=1, backend="classic"), InThisProcess)
    assert isinstance(open_executor("processes", workers=2, backend="classic"), Processes)
    with pytest.raises(GearError):  # the default engine takes no address, and an address is not passed over
        open_executor("processes", workers=1, backend="classic", address="here")
    with pytest.raises(UnknownNameError):
        open_executor("nothing", workers=1, backend="classic")
