"""Optional protocols of tasks and evaluators, as built-in tasks offer them."""

from __future__ import annotations

import pytest

from gear.contracts.evaluation import (
    Additive,
    Counting,
    KeepsPredictions,
    Limited,
    Maskable,
    Ranged,
    Reports,
    Resampled,
)
from gear.contracts.specs import TaskSpec
from gear.plugins.build import find

OFFERS = {
    "semseg": {Additive, Ranged},
    "depth": {Resampled, Ranged},
    "detect2d": {Resampled, Ranged},
    "stereo3d": {Resampled, Ranged, Limited},
}


@pytest.mark.parametrize("name", OFFERS)
def test_built_in_tasks_offer_what_they_implement(name: str) -> None:
    spec = find("task", name).spec
    assert isinstance(spec, TaskSpec)
    task = spec.build(spec.config())
    for protocol in (KeepsPredictions, Maskable, Reports):
        assert isinstance(task, protocol)
    evaluator = task.evaluator()
    assert {
        protocol for protocol in (Additive, Resampled, Limited, Ranged, Counting) if isinstance(evaluator, protocol)
    } == OFFERS[name]


def test_an_object_without_the_methods_offers_nothing() -> None:
    for protocol in (KeepsPredictions, Maskable, Reports, Additive, Resampled, Limited, Ranged, Counting):
        assert not isinstance(object(), protocol)
