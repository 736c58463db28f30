"""What was begun from other samples and stopped is told from what was begun otherwise: a bench makes it again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gear.values.errors import OutdatedError, ReplaceableError
from gear.verbs.attack.folder import BEGUN, begin, tidy
from gear.verbs.attack.monitor import CHECKPOINT, Recorder
from gear.verbs.attack.run import attack
from tests.verbs.attack.conftest import SMALL
from tests.verbs.conftest import Install, Small

PLAN = {"data": [{"samples": 24}], "steps": 5}


def begun(root: Path) -> None:
    assert begin(root, PLAN, force=False) is None
    Recorder(root=root, key="k", steps=5).save(1, {"done": np.int64(1)})


def test_only_other_samples_make_it_outdated(tmp_path: Path) -> None:
    begun(tmp_path)
    assert begin(tmp_path, PLAN, force=False) is None
    more = PLAN | {"data": [{"samples": 48}]}
    with pytest.raises(OutdatedError, match=r"unfinished attack from other samples \(data\[0\]\.samples: 24 there, 48"):
        begin(tmp_path, more, force=False)
    with pytest.raises(OutdatedError, match="calibration: null there"):
        begin(tmp_path, PLAN | {"calibration": "c"}, force=False)
    for otherwise in (PLAN | {"steps": 6}, more | {"steps": 6}):
        assert begin(tmp_path, otherwise, force=False) is None, "the checkpoint itself refuses it"
    assert begin(tmp_path, more, force=True) is None and not (tmp_path / CHECKPOINT).exists()
    Recorder(root=tmp_path, key="k", steps=5).save(1, {"done": np.int64(1)})
    assert begin(tmp_path, more, force=False) is None, "the plan is that of the new checkpoint"
    tidy(tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("text", [None, "", "[]", "[" * 100_000])
def test_without_a_plan_the_checkpoint_decides(tmp_path: Path, text: str | None) -> None:
    begun(tmp_path)
    if text is None:
        (tmp_path / BEGUN).unlink()
    else:
        (tmp_path / BEGUN).write_text(text)
    assert begin(tmp_path, PLAN | {"data": []}, force=False) is None
    with pytest.raises(ReplaceableError, match="other settings"):
        Recorder(root=tmp_path, key="other", steps=5).resume()


def test_a_stopped_attack_on_other_data(
    small: Small, install: Install, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gear.verbs.attack.monitor.SECONDS_BETWEEN", 0.0)

    def stopped(done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        attack(small(), model="tiny_segmenter", out=tmp_path, steps=3, settings=SMALL, on_progress=stopped)
    other = small(seed=5)
    with pytest.raises(OutdatedError, match="unfinished attack from other samples"):
        attack(other, model="tiny_segmenter", out=tmp_path, steps=3, settings=SMALL)
    assert attack(other, model="tiny_segmenter", out=tmp_path, steps=3, settings=SMALL, force=True).made
    assert not (tmp_path / BEGUN).exists() and not (tmp_path / CHECKPOINT).exists()
