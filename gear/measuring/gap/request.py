"""The arguments of a comparison of composed patches (pasted into clean pictures) and rendered patches, with their
checks.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gear.measuring.guard import Guard
from gear.values.errors import DatasetError, GearError
from gear.values.rng import check_seed


@dataclass(frozen=True, slots=True, kw_only=True)
class GapRequest:
    """The arguments of `gear.gap`: a comparison of composed (pasted) with rendered patches.

    Attributes:
        dataset, split: root of the dataset without a patch, and its split; None for the only split.
        patch, twin: a patch to be rendered in the same scenes, or the root of a dataset rendered with a patch; exactly
            one is given.
        model, model_settings: network whose metrics are compared, with `KEY=VALUE` options; None compares only
            pictures.
        guard: the defense that guards the network, with its calibration data; None for none.
        compositors: names of the methods that compose patches into pictures.
        samples: number of samples, counted from the first; None for all.
        town, scenes: MJCF file and scene library of a town that is not part of gear.
        out: folder of the results; None writes nothing.
        seed: seed of the defense's random draws.

    Raises:
        GearError: the arguments contradict each other.
    """

    dataset: str | Path
    patch: str | Path | None = None
    twin: str | Path | None = None
    split: str | None = None
    model: str | None = None
    model_settings: tuple[str, ...] = ()
    guard: Guard | None = None
    compositors: tuple[str, ...] = ("transport", "homography")
    samples: int | None = None
    town: str | Path | None = None
    scenes: str | Path | None = None
    out: str | Path | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        check_seed(self.seed)
        if (self.patch is None) == (self.twin is None):
            raise self._error("say one of: --twin DIR, a rendered twin; or --patch PATCH, to render one")
        if self.samples is not None and self.samples < 1:
            raise self._error(f"samples must be at least 1, got {self.samples}")
        if self.patch is None and (self.town is not None or self.scenes is not None):
            raise self._error("--town and --scenes say what to render; with --twin nothing is rendered")
        if self.patch is not None and self.out is None:
            raise self._error("a twin has to be rendered: say where to with --out DIR")
        if self.model is None and self.guard is not None:
            raise self._error("a defense guards a model: name one with --model")
        if self.model is None and self.model_settings:
            raise self._error("options are given for a model: name it with --model")

    def _error(self, problem: str) -> GearError:
        return DatasetError(self.dataset, problem)

    @property
    def folder(self) -> Path | None:
        """The folder of the report's files; None if no files are written."""
        return None if self.out is None else Path(self.out)

    @property
    def twin_root(self) -> Path:
        """The root of the dataset rendered with the patch: the user's own, or the one that `gear.gap` collects."""
        return Path(self.twin) if self.twin is not None else Path(self.out or "") / "twin"
