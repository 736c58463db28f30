"""What a question costs is how often the network is asked."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gear.contracts.attacks import Budget, Term
from gear.plugins.attacks.optimisation.objectives import DepthObjective, SemsegObjective
from gear.plugins.attacks.optimisation.queries import BlackBoxObjective
from gear.plugins.attacks.scene_specific import scene_specific
from gear.testing.attack_contract import AttackContract
from gear.testing.tiny_compositor import TinyCompositor
from gear.values.errors import GearError


class OnSemseg(AttackContract):
    spec = scene_specific


class OnDepth(AttackContract):
    spec = scene_specific
    task = "depth"


TEXTURES = np.full((1, 3, 4, 8), 0.5, np.float32)


def oracle_of(contract: AttackContract, objective: Any, queries: int | None = 50) -> tuple[Any, BlackBoxObjective]:
    model, dataset = contract.model(), contract.dataset()
    return model, BlackBoxObjective(
        model, dataset, TinyCompositor(dataset), objective, Budget(steps=1, queries=queries)
    )


@pytest.mark.parametrize(
    ("contract", "objective", "costs"),
    [
        (OnSemseg, SemsegObjective(), [1, 1, 1]),
        (OnSemseg, SemsegObjective(target=7), [1, 1, 1]),
        (OnSemseg, SemsegObjective(gamma=0.5), [2, 2, 1]),
        (OnDepth, DepthObjective(), [2, 2, 1]),
        (OnDepth, DepthObjective(direction="farther"), [2, 2, 1]),
    ],
)
def test_every_pass_is_paid_for(contract: type[AttackContract], objective: Any, costs: list[int]) -> None:
    model, oracle = oracle_of(contract(), objective)
    for indices, cost in zip(([0], [0, 1], [1, 0]), costs, strict=True):
        before, passes = oracle.left, model.passes
        assert oracle.cost(indices) == cost
        assert np.isfinite(oracle.harm(TEXTURES, indices))
        assert before - oracle.left == model.passes - passes == cost


class HalfOfIt:
    """Somebody else's objective, which does not say whether it asks for clean answers."""

    def terms(self, model: Any, views: Any, samples: Any, indices: Any) -> dict[str, Term]:
        return {"half": Term(value=model.forward(views)["logits"].mean() / 2)}


def test_objectives_of_others_ask_for_nothing_but_the_question() -> None:
    model, oracle = oracle_of(OnSemseg(), HalfOfIt())
    oracle.harm(TEXTURES, [0, 1])
    assert (oracle.left, model.passes) == (49, 1)


class Unsaid:
    """An objective of a network that says nothing."""

    def terms(self, model: Any, views: Any, samples: Any, indices: Any) -> dict[str, Term]:
        return {"unsaid": Term(value=model.forward(views)["logits"].mean() * float("nan"))}


def test_an_answer_that_is_no_number_is_said() -> None:
    _, oracle = oracle_of(OnSemseg(), Unsaid())
    with pytest.raises(GearError, match=r"^the objective is NaN or infinite.* samples 0, 1 with the patch"):
        oracle.harm(TEXTURES, [0, 1])


def test_what_cannot_be_paid_is_not_asked() -> None:
    model, oracle = oracle_of(OnSemseg(), SemsegObjective(gamma=0.5), queries=3)
    oracle.harm(TEXTURES, [0])
    with pytest.raises(RuntimeError, match="no queries left"):
        oracle.harm(TEXTURES, [1])
    assert (oracle.left, model.passes) == (1, 2)
    with pytest.raises(GearError, match="--queries"):
        oracle_of(OnSemseg(), SemsegObjective(), queries=None)


def test_what_was_spent_and_on_what_is_kept() -> None:
    _, oracle = oracle_of(OnDepth(), DepthObjective())
    oracle.harm(TEXTURES, [1])
    _, again = oracle_of(OnDepth(), DepthObjective())
    again.restore(oracle.state())
    assert (again.left, again.cost([1]), again.cost([0])) == (48, 1, 2)
