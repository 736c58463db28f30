"""Datasets in Rerun, with the real package where it is installed."""

from __future__ import annotations

import builtins
from pathlib import Path
from typing import Any

import pytest

import gear
from gear.values.errors import GearError
from gear.view import rerun_recording


def test_a_dataset_becomes_a_recording(write_dataset: Any, tmp_path: Path) -> None:
    rerun = pytest.importorskip("rerun")
    root = write_dataset("depth", 2)
    recording = gear.to_rerun(root, tmp_path / "a.rrd", samples=1)
    assert isinstance(recording, rerun.RecordingStream)
    recording.disconnect()
    data = (tmp_path / "a.rrd").read_bytes()
    assert data.startswith(b"RR") and len(data) > 20_000  # the picture and two previews
    for path in (b"/world/left/image", b"/preview/depth", b"/world/actors", b"/world/surfaces"):
        assert path in data or path.lstrip(b"/") in data


def test_a_recording_appears_whole_or_not_at_all(
    write_dataset: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("rerun")
    root, out = write_dataset("depth", 2), tmp_path / "new"
    out.mkdir()
    (out / "a.rrd").write_bytes(b"of an earlier run")

    def broken(*_: Any) -> None:
        assert (out / "a.rrd").read_bytes() == b"of an earlier run"
        raise KeyboardInterrupt

    monkeypatch.setattr(rerun_recording, "_log_sample", broken)
    with pytest.raises(KeyboardInterrupt):
        gear.to_rerun(root, out / "a.rrd")
    assert [path.name for path in out.iterdir()] == ["a.rrd"]
    assert (out / "a.rrd").read_bytes() == b"of an earlier run"


def test_without_rerun_it_is_one_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    load = builtins.__import__

    def missing(name: str, *given: Any, **named: Any) -> Any:
        if name == "rerun":
            raise ImportError(name)
        return load(name, *given, **named)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(GearError, match=r"pip install 'mujoco-gear\[rerun\]'"):
        gear.to_rerun(tmp_path, tmp_path / "a.rrd")
