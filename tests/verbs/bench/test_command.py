"""Steps of a bench as command lines."""

from __future__ import annotations

import shlex

from gear.verbs.bench.command import command
from gear.verbs.bench.plan import Step


def words(step: Step) -> list[str]:
    return shlex.split(command(step))


def test_arguments_become_flags() -> None:
    arguments = {"task": "depth", "settings": ["a=1", "b=x y"], "probes": True, "out": "my folder"}
    assert words(Step(verb="collect", title="", arguments=arguments)) == [
        "gear", "collect", "--task", "depth", "--set", "a=1", "--set", "b=x y", "--probes", "--out", "my folder",
    ]  # fmt: skip


def test_data_of_an_evaluation_follow_one_flag_and_pools_are_left_out() -> None:
    arguments = {"data": ["a", "b"], "model_settings": ["w=1"], "reports": ["reference"], "pools": {"all": ["a"]}}
    assert words(Step(verb="evaluate", title="", arguments=arguments)) == [
        "gear", "evaluate", "--data", "a", "b", "--model-set", "w=1", "--report", "reference",
    ]  # fmt: skip
