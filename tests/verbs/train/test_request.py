"""Requests of a training."""

from __future__ import annotations

import pytest

from gear.values.errors import GearError
from gear.verbs.train.request import TrainRequest


def request(**values: object) -> TrainRequest:
    return TrainRequest(**{"task": "depth", "model": "net", "data": ("d",), "out": "o", **values})  # type: ignore[arg-type]


def test_data_are_required() -> None:
    with pytest.raises(GearError, match="there are no data to train on; give --data DIR"):
        request(data=())


def test_values_keep_the_names_of_the_config() -> None:
    values = request(lr=0.1, batch=4).config_values
    assert (values["learning_rate"], values["batch"], values["epochs"]) == (0.1, 4, None)


def test_adversarial_comes_before_the_settings() -> None:
    assert request(settings=("a=1",)).config_settings == ("a=1",)
    assert request(settings=("a=1",), adversarial="eot").config_settings == ("adversarial.attack=eot", "a=1")


@pytest.mark.parametrize(
    ("seconds", "text"), [(None, None), (0.0, None), (90.0, "90s"), (1e-5, "0.00001s"), (0.1, "0.1s")]
)
def test_a_time_budget_has_all_digits(seconds: float | None, text: str | None) -> None:
    assert request(time_budget_s=seconds).command_flags["time_budget"] == text
