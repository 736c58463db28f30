"""`gear.gap`: compares composed patches (pasted into pictures) with the same patches rendered in the scene."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from gear.measuring.gap.report import GapReport
from gear.measuring.gap.request import GapRequest
from gear.measuring.gap.run import measure_gap
from gear.measuring.guard import Guard
from gear.reporting.display import displayed
from gear.values.progress import Callbacks, PhaseProgress, Progress, Warn


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
    on_fit_phase: PhaseProgress | None = None,
    on_warning: Warn | None = None,
) -> GapReport:
    """Compares composed patches (pasted into pictures) with the same patches rendered: in pixels and in their effect.

    Args:
        dataset: root of a dataset that was collected with probes and without a patch.
        patch: patch folder, picture or `random`; the same samples are rendered with this patch into `out/twin`.
        twin: root of an existing dataset with the same samples and a patch; replaces `patch`.
        split: split of the dataset; optional if there is only one.
        model: name of a model plugin with which the task's metrics are measured; None compares only the pictures.
        model_settings: `KEY=VALUE` texts for the model's options.
        defense: name of a defense plugin that guards the model.
        defense_settings: `KEY=VALUE` texts for the defense's options.
        calibration: dataset without patches on which the defense is calibrated.
        calibration_patched: the calibration dataset rendered with patches.
        compositors: names of the methods that compose patches into pictures.
        samples: number of samples, counted from the first; only these are rendered. All by default.
        town, scenes: MJCF file and scene library of a town that is not part of gear; needed only with `patch`.
        out: folder for `gap.json` and `gap.txt`; required with `patch`.
        seed: seed of the defense's random draws.
        progress: shows a progress bar.
        on_progress: called after every sample.
        on_fit_progress: called after every calibration sample that the defense reads for the first time.
        on_fit_phase: called with (unit, done, total) after every step of a phase of the calibration, such as a training
            step, if the defense reports its phases.
        on_warning: called before anything is rendered with lines on settings that may be unintended, such as pictures
            of another size than the model was trained on, or doubtful calibration data.

    Raises:
        GearError: an error that the user can correct; the message is one line.
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
    callbacks = Callbacks.of(
        on_progress=on_progress, on_fit_progress=on_fit_progress, on_fit_phase=on_fit_phase, on_warning=on_warning
    )
    with displayed(callbacks, "gap", progress=progress) as shown:
        return measure_gap(request, shown)
