"""`gear attack` through a defense: one that cleans pictures, one that wraps the model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.per_picture import PerPicture
from gear.testing.tiny_networks import tiny_segmenter
from gear.values.errors import GearError
from gear.verbs.attack.run import attack
from tests.verbs.attack.conftest import SMALL, wrapping
from tests.verbs.conftest import Collected, Install, Nothing, Small


def test_a_defense_is_looked_through(small: Small, install: Install, tmp_path: Path) -> None:
    plain = attack(small(), model="tiny_segmenter", out=tmp_path / "plain", steps=2, settings=SMALL)
    aware = attack(small(), model="tiny_segmenter", out=tmp_path / "aware", steps=2, settings=SMALL, defense="gaussian")
    assert aware.facts["defense"]["name"] == "gaussian"
    assert not np.array_equal(plain.patches[0].rgb, aware.patches[0].rgb)


def test_a_defense_around_the_model_is_looked_through(small: Small, install: Install, tmp_path: Path) -> None:
    """As gear evaluate has it, whose metrics the attack is for."""
    install(tiny_segmenter, wrapping)
    facts: dict[str, Any] = {"model": "tiny_segmenter", "steps": 2, "settings": SMALL}
    plain = attack(small(), out=tmp_path / "plain", **facts)
    aware = attack(small(), out=tmp_path / "aware", defense="wrapping", **facts)
    assert not np.array_equal(plain.patches[0].rgb, aware.patches[0].rgb)
    assert aware.facts["weights_sha256"] is not None, "what is wrapped is hashed"


class OnlyScores(PerPicture):
    """A defense of others that leaves pictures as they are and offers attacks nothing."""

    def __init__(self, config: Nothing) -> None:
        pass

    def clean(self, picture: Any) -> Any:
        return picture, None

    def clean_tensor(self, pictures: torch.Tensor) -> torch.Tensor:
        return pictures


only_scores = DefenseSpec(
    name="only_scores", summary="Scores.", config=Nothing, build=OnlyScores, outputs=frozenset({"score"}),
    gradient="differentiable",
)  # fmt: skip


FEW = ["false_alarms=0.2"]
"""Eight calibration pictures tell no level that one in twenty exceeds."""


def learnt(collected: Collected, **facts: Any) -> dict[str, Any]:
    data = collected("semseg", "calibration", scene="board", split="val", samples=8)
    return {"model": "tiny_segmenter", "settings": SMALL, "calibration": data, "defense_settings": FEW, **facts}


@pytest.mark.parametrize("defense", ["fpda", "hyperneuron"])
def test_an_attack_lowers_the_score_of_a_defense_that_only_scores(
    defense: str, small: Small, collected: Collected, install: Install, tmp_path: Path
) -> None:
    install(tiny_segmenter)
    asked = learnt(collected, defense=defense, steps=12)
    aware = attack(small(), out=tmp_path / "aware", score_weight=5, **asked)
    blind = attack(small(), out=tmp_path / "blind", score_weight=0, **asked)
    scores = aware.facts["curves"]["defense_score"]
    assert aware.facts["defense_weights"] == {"score": 5.0, "mask": 1.0}
    assert np.mean(scores[-3:]) > np.mean(scores[:3]), "the term is the negative score"
    assert "defense_score" not in blind.facts["curves"]
    assert not np.array_equal(aware.patches[0].rgb, blind.patches[0].rgb)
    assert aware.facts["calibration_seconds"] > 0


def test_a_score_without_a_gradient_is_no_adaptive_attack(
    small: Small, collected: Collected, install: Install, tmp_path: Path
) -> None:
    install(tiny_segmenter)
    with pytest.raises(GearError, match=r"score of the defense has no gradient.*--score-weight 0"):
        attack(
            small(), out=tmp_path / "share",
            **learnt(collected, defense="hyperneuron", defense_settings=[*FEW, "aggregate=share"], steps=2),
        )  # fmt: skip


def test_a_defense_that_offers_attacks_nothing_is_refused(small: Small, install: Install, tmp_path: Path) -> None:
    install(tiny_segmenter, only_scores)
    with pytest.raises(GearError, match="'only_scores' leaves pictures as they are and has no `defend_batch`"):
        attack(small(), model="tiny_segmenter", out=tmp_path / "out", steps=2, settings=SMALL, defense="only_scores")


class Posterised(PerPicture):
    """A defense of others that claims a gradient and rounds it away."""

    def __init__(self, config: Nothing) -> None:
        pass

    def clean(self, picture: Any) -> Any:
        return (picture // 64 * 64).astype(np.uint8), None

    def clean_tensor(self, pictures: torch.Tensor) -> torch.Tensor:
        return (pictures * 4).floor() / 4


posterised = DefenseSpec(
    name="posterised", summary="Few levels.", config=Nothing, build=Posterised, outputs=frozenset({"images"}),
    gradient="differentiable",
)  # fmt: skip


def test_pictures_without_a_gradient_are_no_adaptive_attack(small: Small, install: Install, tmp_path: Path) -> None:
    install(tiny_segmenter, posterised)
    with pytest.raises(GearError, match=r"pictures that the defense returns have no gradient.*--attack square"):
        attack(small(), model="tiny_segmenter", out=tmp_path / "out", steps=2, settings=SMALL, defense="posterised")


@pytest.mark.parametrize("defense", ["lgs", "jpeg", "median", "bit_depth"])
def test_a_gradient_passes_every_defense_of_pictures(
    defense: str, small: Small, install: Install, tmp_path: Path
) -> None:
    install(tiny_segmenter)
    facts: dict[str, Any] = {"model": "tiny_segmenter", "steps": 1, "settings": SMALL}
    aware = attack(small(), out=tmp_path / defense, defense=defense, **facts)
    assert all(size > 0 for size in aware.facts["curves"]["gradient"])


def test_weights_of_a_defense_are_plausible(small: Small, tmp_path: Path) -> None:
    with pytest.raises(GearError, match="score_weight and mask_weight must be at least 0"):
        attack(small(), model="tiny_segmenter", out=tmp_path / "out", score_weight=-1)
