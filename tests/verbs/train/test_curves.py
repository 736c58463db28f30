"""The metric of a training that is a few steps long."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.plugins.manager import catalogue
from gear.verbs.train.checkpoint import TrainingState
from gear.verbs.train.curves import FILE, write_curves


def drawn(root: Path, progress: TrainingState) -> bytes:
    write_curves(root, catalogue().get("task", "depth").spec, progress, "short")  # type: ignore[arg-type]
    return (root / FILE).read_bytes()


@pytest.mark.parametrize("is_stretch", [True, False])
def test_the_only_loss_of_a_short_training_is_seen(tmp_path: Path, is_stretch: bool) -> None:
    """One stretch of steps, or none that is whole: both were nowhere in the metric."""

    def progress(loss: float) -> TrainingState:
        validations = [{"step": step, "loss": value, "eigen_d1": 0.5} for step, value in ((1, 6.0), (12, 1.0))]
        steps = [{"step": 10, "loss": loss, "rate": 1e-3}] if is_stretch else []
        return TrainingState(step=12, best_step=12, validations=validations, steps=steps,
                        open_losses=[] if is_stretch else [loss])  # fmt: skip

    assert drawn(tmp_path, progress(2.0)) != drawn(tmp_path, progress(4.0))


def test_a_rate_that_nothing_was_noted_of_has_no_axis(tmp_path: Path) -> None:
    validations = [{"step": 3, "loss": 1.0, "eigen_d1": 0.5}]
    short = TrainingState(step=3, best_step=3, validations=validations, open_losses=[1.0])
    noted = TrainingState(step=3, best_step=3, validations=validations, steps=[{"step": 3, "loss": 1.0, "rate": 0.0}])
    assert drawn(tmp_path, short) != drawn(tmp_path, noted)
