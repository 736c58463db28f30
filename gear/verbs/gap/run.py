"""`gear.gap`: the whole verb as one call."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from gear.measuring.gap.report import GapReport
from gear.measuring.gap.request import GapRequest
from gear.measuring.gap.run import measure_gap
from gear.measuring.guard import Guard
from gear.reporting.display import displayed
from gear.values.progress import Callbacks, Progress, Warn


def gap(
    dataset: str | Path,
    *,
    patch: str | Path | None = None,
    twin: str | Path | None = None,
    split: str | None = None,
    model: str | None = None,
    model_settings: Iterable[str] = (),
    defense: str | None = None,
    defense_settings: Iterable[str] = (),
    calibration: str | Path | None = None,
    calibration_patched: str | Path | None = None,
    compositors: Sequence[str] = ("transport", "homography"),
    samples: int | None = None,
    town: str | Path | None = None,
    scenes: str | Path | None = None,
    out: str | Path | None = None,
    seed: int = 0,
    progress: bool = False,
    on_progress: Progress | None = None,
    on_fit_progress: Progress | None = None,
    on_warning: Warn | None = None,
) -> GapReport:
    """Compares digital patches with the same patches rendered, as pictures and by their effect on a model.

    Args:
        dataset: root of a split that was collected with probes.
        patch: what to show, as for `gear.collect`; its twin is collected into `out/twin`, or completed there.
        twin: root of a twin that was collected before; instead of `patch`.
        split: of the dataset; may be left out where there is only one.
        model: a model plugin for the task's metric; without it only pictures are compared.
        model_settings: `KEY=VALUE` texts for the model's options.
        defense: a defense plugin that guards the model.
        defense_settings: `KEY=VALUE` texts for its options.
        calibration: dataset from which the defense learns.
        calibration_patched: the same dataset with patches.
        compositors: names of compositors.
        samples: number of samples, counted from the split's first one; only these are rendered. All by default.
        town, scenes: with `patch`, files of the town and of its scene library, where they are not gear's own.
        out: folder for `gap.json` and `gap.txt`; needed with `patch`.
        seed: of what the defense draws.
        progress: shows a progress bar.
        on_progress: called after every sample.
        on_fit_progress: called after every calibration sample that the defense reads for the first time.
        on_warning: called, before anything is rendered, with what the user may not have meant: a model that sees these
            pictures at another size than it was trained on, doubtful calibration data.

    Raises:
        GearError: anything that the user can put right; its text is one line.
    """
    request = GapRequest(
        dataset=dataset,
        patch=patch,
        twin=twin,
        split=split,
        model=model,
        model_settings=tuple(model_settings),
        guard=Guard.of(defense, defense_settings, calibration, calibration_patched),
        compositors=tuple(compositors),
        samples=samples,
        town=town,
        scenes=scenes,
        out=out,
        seed=seed,
    )
    callbacks = Callbacks.of(on_progress=on_progress, on_fit_progress=on_fit_progress, on_warning=on_warning)
    with displayed(callbacks, "gap", progress=progress) as shown:
        return measure_gap(request, shown)
