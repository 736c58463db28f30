"""Verdicts of checks: written and read again."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.leaderboard.verdict import Verdict, finding, read_verdict
from gear.values.errors import DatasetError
from tests.leaderboard.conftest import sha


def test_a_verdict_is_read_as_it_was_written(tmp_path: Path) -> None:
    found = finding("differs", "a\nline\x00" + "x" * 400)
    assert found.text.startswith("a line?") and len(found.text) == 300
    verdict = Verdict(
        record_sha256=sha("x"), state="differs", seed=3, repeated=4, fresh=0, environment={}, findings=(found,)
    )
    path = tmp_path / "one.json"
    path.write_bytes(verdict.encoded())
    assert read_verdict(path) == verdict
    path.write_bytes(verdict.encoded().replace(b'"differs"', b'"perfect"'))
    with pytest.raises(DatasetError, match="expected one of"):
        read_verdict(path)
