"""`gear.gap`: how far digital patches are from the same patches rendered, and whether they do as much.

Nothing here asks a patch to be adversarial: a gap is a fact about pictures. With a model, the task's metric is taken on
the untouched pictures, on the composed ones and on the rendered ones.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gear.collecting.patch_sources import digest_of, read_patch
from gear.dataset.files import clear_scratch, explained, inside, write_whole
from gear.dataset.layout import patch_path
from gear.dataset.reading import Dataset, Twins, pair_twins
from gear.dataset.sidecar import dump_json
from gear.dataset.store import check_output
from gear.plugins.datasets import open_dataset
from gear.values.errors import DatasetError
from gear.values.frames import UInt8Image
from gear.values.progress import Progress, Warn
from gear.values.rng import check_seed
from gear.verbs.gap.effect import RENDERED, Effect
from gear.verbs.gap.picture_gap import picture_gap, visible_mask
from gear.verbs.gap.report import GapReport, SampleGap
from gear.verbs.gap.twin import check_clean, collect_twin

if TYPE_CHECKING:
    from gear.compositor.pasting import Pasting


REPORT = "gap.json"
TABLE = "gap.txt"


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
    on_progress: Progress | None = None,
    on_fit_progress: Progress | None = None,
    on_warning: Warn | None = None,
) -> GapReport:
    """Holds digital patches against rendered ones.

    Args:
        dataset: root of a split that was collected with probes.
        patch: what to show, as for `gear.collect`; its twin is collected into `out/twin`, or taken up again.
        twin: root of a twin that is there already; instead of `patch`.
        split: of the dataset; may be left out where there is only one.
        model: a model plugin for the task's metric; none for pictures alone.
        model_settings: `KEY=VALUE` texts for the model's options.
        defense: a defense plugin that the model stands behind.
        defense_settings: for its options.
        calibration: dataset from which the defense learns.
        calibration_patched: the same with patches.
        compositors: names of compositors.
        samples: so many of the split's first samples, of which alone a twin is collected then; all unless given.
        town, scenes: with `patch`, files of the town and of its scene library, where they are none of gear's own.
        out: folder for `gap.json` and `gap.txt`; needed with `patch`.
        seed: of what the defense draws.
        progress: told after every sample.
        learning: told after every calibration sample that the defense reads for the first time.
        noted: told, before anything is rendered, of what the user may not have meant: a model that sees these pictures
            at another size than it learnt from, doubtful data for the defense to learn from.

    Raises:
        GearError: anything that the user can put right; its text is one line.
    """
    from gear.compositor.opening import open_compositor

    check_seed(seed)
    clean = open_dataset(dataset, split)
    if (patch is None) == (twin is None):
        raise DatasetError(clean.root, "say one of: --twin DIR, a rendered twin; or --patch PATCH, to render one")
    if samples is not None and samples < 1:
        raise DatasetError(clean.root, f"samples must be at least 1, got {samples}")
    if patch is None and (town is not None or scenes is not None):
        raise DatasetError(clean.root, "--town and --scenes say what to render; with --twin nothing is rendered")
    if patch is not None and out is None:
        raise DatasetError(clean.root, "a twin has to be rendered: say where to with --out DIR")
    model_settings, defense_settings = tuple(model_settings), tuple(defense_settings)
    learns_from = (calibration, calibration_patched)
    if model is None and (defense is not None or defense_settings or any(learns_from)):
        raise DatasetError(clean.root, "a defense guards a model: name one with --model")
    if model is None and model_settings:
        raise DatasetError(clean.root, "options are given for a model: name it with --model")
    if out is not None:
        check_output(Path(out), "write the gap into a folder of its own")
    check_clean(clean)
    root = Path(twin) if twin is not None else Path(out or "") / "twin"
    if patch is None:
        pairs = pair_twins(clean, open_dataset(root, clean.plan.info.split))
    # What does not suit the dataset is to be found before a twin is rendered.
    engines = {name: open_compositor(name, clean, rounding=True) for name in compositors}
    effect = (
        None
        if model is None
        else Effect.of(
            model,
            model_settings,
            clean,
            tuple(compositors),
            defense=defense,
            defense_settings=defense_settings,
            calibration=learns_from,
            seed=seed,
            on_fit_progress=on_fit_progress,
        )
    )
    if on_warning is not None and effect is not None:
        for line in effect.notes:
            on_warning(line)
    if patch is not None:
        collect_twin(clean, patch, root, samples=samples, town=town, scenes=scenes)
        pairs = pair_twins(clean, open_dataset(root, clean.plan.info.split))
    count = min(len(pairs), samples or len(pairs))
    images = shown_patches(pairs.second, len(clean.sidecar(0).record.surfaces))
    if out is not None:
        with explained(Path(out)):
            Path(out).mkdir(parents=True, exist_ok=True)
    found: list[SampleGap] = []
    if on_progress is not None:
        on_progress(0, count)
    for index in range(count):
        found += sample_gaps(pairs, engines, images, index, effect)
        if on_progress is not None:
            on_progress(index + 1, count)
    report = GapReport(
        dataset=str(clean.root),
        twin=str(pairs.second.root),
        split=clean.plan.info.split,
        patch=pairs.second.plan.patch["label"],
        renderer=clean.named("renderer"),
        quality=clean.content(str, "quality"),
        samples=tuple(found),
        effect={} if effect is None else effect.result(),
        sample_effects=() if effect is None else tuple(effect.samples),
        metric="" if effect is None else effect.metric,
        model=model,
        defense=defense,
        seed=seed,
    )
    if out is not None:
        folder = Path(out)
        write_whole(folder, REPORT, dump_json(report.as_json()))
        write_whole(folder, TABLE, (report.table() + "\n").encode())
        clear_scratch(folder)
    return report


def sample_gaps(
    pairs: Twins[Any],
    engines: Mapping[str, Pasting],
    images: Sequence[UInt8Image],
    index: int,
    effect: Effect | None,
) -> list[SampleGap]:
    """The metrics of each view of one sample that shows a patch."""
    clean, rendered = pairs[index]
    composed: dict[str, dict[str, UInt8Image]] = {name: dict(clean.images) for name in engines}
    found = []
    for view, picture in rendered.images.items():
        mask = visible_mask(rendered.surfaces, view, *picture.shape[:2])
        if mask.any() or effect is not None:  # `homography` pastes over what hides a patch, and a model sees that
            for name, engine in engines.items():
                composed[name][view] = composed_picture(engine, images, index, view)
        if not mask.any():
            continue
        gaps = {name: picture_gap(pictures[view], picture, mask) for name, pictures in composed.items()}
        seen = [s for s in rendered.surfaces if s.camera == view and s.visible_px]
        found.append(
            SampleGap(
                index=index,
                view=view,
                visible_px=int(mask.sum()),
                distance_m=min(s.distance_m for s in seen),
                incidence_deg=max(s.incidence_deg for s in seen),
                gaps=gaps,
            )
        )
    if effect is not None:
        shown = {name: replace(clean, images=pictures) for name, pictures in composed.items()}
        effect.update(index, clean, {**shown, RENDERED: rendered})
    return found


def composed_picture(engine: Pasting, images: Sequence[UInt8Image], index: int, view: str) -> UInt8Image:
    """(H, W, 3) uint8 of one sample with patches, through a compositor that rounds."""
    import torch

    patches = [torch.from_numpy(image.copy()).permute(2, 0, 1).float() / 255 for image in images]
    with torch.no_grad():
        values = engine.compose(patches, [index], view)[0].permute(1, 2, 0).cpu().numpy()
    return np.asarray(np.rint(values * 255), dtype=np.uint8)


def shown_patches(twin: Dataset[Any], surfaces: int) -> list[UInt8Image]:
    """The patches that a twin shows, from the copy that it keeps.

    Raises:
        DatasetError: it shows none, or fewer than there are surfaces, or the copy is not what was shown.
    """
    label = twin.plan.patch["label"]
    paths = [inside(twin.root, patch_path(label, f"patch_{i}.png")) for i in range(surfaces)]
    there = [path for path in paths if path.is_file()]
    if len(there) < surfaces:
        raise DatasetError(
            twin.root, f"shows {len(there)} patches on {surfaces} surfaces; collect the twin with one for each"
        )
    images = [read_patch(path) for path in there]
    if images and digest_of(images) != twin.plan.patch["sha256"]:
        raise DatasetError(paths[0].parent, "is not what the pictures show; collect the twin again, with --force")
    return images
