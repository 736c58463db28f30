"""What a third party's task gives that cannot be written or measured: one line names the method and the fault."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gear.contracts.tasks import Encoded
from gear.dataset.checks.output_checks import check_encoded
from gear.metrics.depth import DepthEvaluator
from gear.plugins import manager
from gear.plugins.catalogue import Catalogue, Owner
from gear.plugins.tasks.depth import DepthTask
from gear.plugins.tasks.semseg import SemsegTask
from gear.values.errors import PluginError, SamplesFailedError
from gear.verbs.evaluate.run import evaluate
from tests.verbs.conftest import Install, Small
from tests.verbs.evaluate.conftest import Oracle, model_spec

TEXT: Any = {"a.txt": "text"}
PIXELS: Any = {"a.png": np.zeros((2, 2), np.uint8)}
UNWRITABLE: list[tuple[Any, str]] = [
    (None, "TypeError: {} must give an Encoded, got NoneType"),
    (Encoded(files=TEXT, facts={}), r"TypeError: {}: file 'a.txt' must be bytes, got str"),
    (Encoded(files=PIXELS, facts={}), "file 'a.png' must be bytes, got ndarray"),
    (Encoded(files={}, facts={"n": np.int64(3)}), r"TypeError: {}: facts must be JSON: .*int64"),
    (Encoded(files={}, facts={"n": float("nan")}), r"ValueError: {}: facts must be JSON: "),
]


@pytest.mark.parametrize(("given", "message"), UNWRITABLE)
def test_of_a_sample(
    tmp_path: Path, collect_small: Any, monkeypatch: pytest.MonkeyPatch, given: Any, message: str
) -> None:
    owner = Owner(plugin="their-depth", package="their-package", version="1.2")
    found = tuple(dataclasses.replace(f, owner=owner) for f in manager.catalogue().of_kind("task"))
    monkeypatch.setattr("gear.plugins.build.catalogue", lambda: Catalogue(found))
    monkeypatch.setattr(DepthTask, "encode", lambda *_: given)
    monkeypatch.setattr("gear.collecting.missing.FRESH_TRIES", 0)  # a fresh process has gear's own task
    blamed = r"depth \(their-package 1\.2\) failed at sample 0: .*"
    with pytest.raises(SamplesFailedError, match=blamed + message.format("encode")):
        collect_small("depth", tmp_path / "a", samples=1)
    assert not list((tmp_path / "a").rglob("samples/*"))


@pytest.mark.parametrize(("given", "message"), UNWRITABLE)
def test_of_a_prediction(
    tmp_path: Path, small: Small, install: Install, monkeypatch: pytest.MonkeyPatch, given: Any, message: str
) -> None:
    data = small("semseg")
    install(model_spec(lambda _: Oracle([data]), "semseg"))
    monkeypatch.setattr(SemsegTask, "encode_prediction", lambda *_: given)
    with pytest.raises(PluginError, match=r"prediction of sample \d: .*" + message.format("encode_prediction")):
        evaluate(data, model="odd", out=tmp_path / "out")


UNCOUNTABLE: list[tuple[Any, str]] = [
    (None, "{} must give metrics by name, got NoneType"),
    ({"mae_m": "low"}, "{}: metric 'mae_m' must be a number, got str"),
    ({3: 0.5}, "{}: metric 3 must be a number, got float"),
]


@pytest.mark.parametrize("method", ["update", "result"])
@pytest.mark.parametrize(("given", "message"), UNCOUNTABLE)
def test_of_metrics(
    tmp_path: Path,
    small: Small,
    install: Install,
    monkeypatch: pytest.MonkeyPatch,
    method: str,
    given: Any,
    message: str,
) -> None:
    data = small("depth")
    install(model_spec(lambda _: Oracle([data]), "depth"))
    monkeypatch.setattr(DepthEvaluator, method, lambda *_: given)
    with pytest.raises(
        PluginError, match=r"depth \(mujoco-gear .*\) failed at its evaluator: " + message.format(method)
    ):
        evaluate(data, model="odd", out=tmp_path / "out")
    assert not (tmp_path / "out/results.json").exists()


def test_what_can_be_written_is_given_back() -> None:
    encoded = Encoded(files={"a.png": b"1"}, facts={"n": [1, None, "x"]})
    assert check_encoded(encoded, "encode") is encoded
