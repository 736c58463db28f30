"""The output of `gear weights`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save_file

from gear.cli.main import main


def test_metadata_of_a_file_cannot_control_the_terminal(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "net.safetensors"
    save_file({"a": np.zeros(1, np.float32)}, path, {"model": "x\x1b[31m\nsha256: 0"})
    assert main(["weights", "show", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[2:] == [r"  model: x\x1b[31m\nsha256: 0"]
