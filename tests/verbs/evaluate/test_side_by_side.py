"""Two evaluations that are started at once in one folder are kept apart."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.values.errors import DatasetError
from gear.verbs.evaluate.run import evaluate
from tests.verbs.conftest import Install, Small
from tests.verbs.evaluate.conftest import Oracle, model_spec


def test_the_second_is_refused_and_the_first_goes_on(small: Small, install: Install, tmp_path: Path) -> None:
    data = small("depth")
    install(model_spec(lambda config: Oracle([data]), "depth"))
    tried: list[int] = []

    def begin_another(done: int, samples: int) -> None:
        tried.append(done)
        with pytest.raises(DatasetError, match="another gear run is using this folder; wait for its end"):
            evaluate(data, model="odd", out=tmp_path)

    assert evaluate(data, model="odd", out=tmp_path, on_progress=begin_another).rows[0].made == len(tried) - 1 == 2
    assert evaluate(data, model="odd", out=tmp_path).rows[0].made == 0
