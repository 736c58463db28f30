"""The example that trains a driving policy, with the smallest budget."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

pytest.importorskip("gymnasium")
EXAMPLE = Path(__file__).parents[2] / "examples/driving_policy.py"


@pytest.mark.slow
def test_it_trains_and_evaluates(capsys: pytest.CaptureFixture[str]) -> None:
    spec = importlib.util.spec_from_file_location("driving_policy", EXAMPLE)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.main(["--generations", "1", "--population", "2", "--tests", "1"]) == 0
    said = capsys.readouterr().out
    assert "generation 0: best" in said and "after training" in said and "of 2 drives lost" in said
