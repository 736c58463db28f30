"""The arguments of `gear.attack` (`AttackRequest`), and of the check that renders finished patches
(`VerifyRequest`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from gear.measuring.guard import Guard
from gear.values.errors import GearError
from gear.values.rng import check_seed


@dataclass(frozen=True, slots=True, kw_only=True)
class AttackRequest:
    """The arguments of `gear.attack`.

    Attributes:
        data, val: datasets on which patches are optimised, and on which they are validated.
        models, model_settings: names of the attacked networks, and `KEY=VALUE` options of each of them.
        out: the patch folder.
        attack, settings: name of the attack plugin, and its `KEY=VALUE` options.
        steps, queries: largest number of optimisation steps, and of forward passes; None for the default, or no limit.
        guard: the defense that the attack takes into account, with its calibration data; None for none.
        every, patience: steps between two validations; validations without improvement after which the attack ends, 0
            for never.
        compositor: method that puts patches into pictures.
        seed: seed of all random draws.
        score_weight, mask_weight: weights of the loss terms that lower the defense's score and its mask.
        allow_test_data: whether `test` splits are accepted.
        force: whether results of an earlier attack in `out` are deleted first.
        log_to, log_settings: name of a logger plugin, None for no log, and its `KEY=VALUE` options. Patches do not
            depend on them.

    Raises:
        GearError: a number is out of range.
    """

    data: tuple[str | Path, ...]
    models: tuple[str, ...]
    out: str | Path
    attack: str = "scene_specific"
    steps: int | None = None
    queries: int | None = None
    settings: tuple[str, ...] = ()
    model_settings: tuple[str, ...] = ()
    guard: Guard | None = None
    val: tuple[str | Path, ...] = ()
    every: int = 25
    patience: int = 0
    compositor: str = "transport"
    seed: int = 0
    score_weight: float = 1.0
    mask_weight: float = 1.0
    allow_test_data: bool = False
    force: bool = False
    log_to: str | None = None
    log_settings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_seed(self.seed)
        counts = (self.steps, self.queries, self.every)
        if any(count is not None and count < 1 for count in counts) or self.patience < 0:
            raise GearError("steps, queries and every must be at least 1, patience at least 0")
        if not (0 <= self.score_weight < math.inf and 0 <= self.mask_weight < math.inf):
            raise GearError("score_weight and mask_weight must be at least 0, and finite")
        if self.patience and not self.val:
            raise GearError("--patience needs validation data; give --val")


@dataclass(frozen=True, slots=True, kw_only=True)
class VerifyRequest:
    """The arguments of the check that renders finished patches in a held-out dataset.

    Attributes:
        out: the patch folder.
        data: root of a dataset with probes (`gear collect --probes`), or `DIR:SPLIT`; the patches must not have been
            optimised or validated on it.
        models: names of model plugins.
        model_settings: `KEY=VALUE` texts for the models' options.
        guard: the defense that guards the models; None for no defense.
        samples: number of samples, counted from the first; all by default.
        town, scenes: MJCF file of the town and file of its scene library, for towns that are not part of gear.
    """

    out: str | Path
    data: str | Path
    models: tuple[str, ...]
    model_settings: tuple[str, ...] = ()
    guard: Guard | None = None
    samples: int | None = None
    town: str | Path | None = None
    scenes: str | Path | None = None
