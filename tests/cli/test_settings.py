"""Settings of the command line keep the words in which they were given."""

from __future__ import annotations

import argparse
import pickle

import pytest

from gear.cli.device import add_device
from gear.cli.settings import add_settings
from gear.config.overrides import with_overrides
from gear.plugins.build import NO_OPTIONS
from gear.values.errors import ConfigError
from gear.values.setting import Setting


@pytest.mark.parametrize(
    ("words", "text", "given"),
    [
        (["--set", "a=1"], "a=1", "--set a=1"),
        (["--model-set=a=1"], "a=1", "--model-set a=1"),
        (["--model-s", "a=1"], "a=1", "--model-set a=1"),
        (["--device", "cpu"], "device=cpu", "--device cpu"),
    ],
)
def test_settings_of_a_command_line(words: list[str], text: str, given: str) -> None:
    parser = argparse.ArgumentParser()
    add_settings(parser, "--set", "--model-set", dest="model_settings", help="")
    add_device(parser, "model_settings")
    assert parser.parse_args([]).model_settings == []
    settings = parser.parse_args([*words, "--set", "b=2"]).model_settings
    assert settings == [text, "b=2"]
    with pytest.raises(ConfigError) as raised:
        with_overrides(NO_OPTIONS, [Setting("above.below=1"), settings[0], Setting("=", given=settings[0].given)])
    assert str(raised.value).startswith(f"{given}: expected KEY=VALUE")


def test_a_setting_is_equal_to_its_text_and_survives_another_process() -> None:
    setting = Setting("a=1", given="--log-set a=1")
    again = pickle.loads(pickle.dumps(setting))
    assert again == setting == "a=1" and again.given == "--log-set a=1"
    assert Setting("a=1").given == "--set a=1"
