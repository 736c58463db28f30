"""Compares composed patches (pasted into clean pictures by a compositor) with the same patches rendered.

The patches need not be adversarial, because the pictures themselves are compared. With a model, the task's metrics are
also computed on the clean, the composed and the rendered pictures.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gear.collecting.patch_sources import digest_of, read_patch
from gear.dataset.files import clear_scratch, explained, inside, write_whole
from gear.dataset.json_text import dump_json
from gear.dataset.layout import patch_path
from gear.dataset.reading import Dataset, Twins, pair_twins
from gear.dataset.store import check_output
from gear.measuring.gap.effect import RENDERED, Effect
from gear.measuring.gap.picture_gap import picture_gap, visible_mask
from gear.measuring.gap.report import GapReport, SampleGap
from gear.measuring.gap.request import GapRequest
from gear.measuring.gap.twin import check_clean, collect_twin
from gear.plugins.datasets import open_dataset
from gear.values.errors import DatasetError
from gear.values.frames import UInt8Image
from gear.values.progress import Callbacks

if TYPE_CHECKING:
    from gear.compositor.base import BaseCompositor

REPORT = "gap.json"
TABLE = "gap.txt"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Comparison:
    """The datasets, compositors, patches and model of a comparison.

    Attributes:
        pairs: the clean dataset and its rendered twin.
        engines: compositors by name.
        images: the patches that the twin shows, (h, w, 3) uint8, one per surface.
        effect: measures the effect of the patches on a model; None without a model.
    """

    pairs: Twins[Any]
    engines: Mapping[str, BaseCompositor]
    images: Sequence[UInt8Image]
    effect: Effect | None


def measure_gap(request: GapRequest, callbacks: Callbacks) -> GapReport:
    """Compares composed patches (pasted into clean pictures) with rendered patches, and writes the report if requested.

    Args:
        request: the arguments of `gear gap`.
        callbacks: functions that receive progress and warnings.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    clean = open_dataset(request.dataset, request.split)
    if request.folder is not None:
        check_output(request.folder, "write the gap into a folder of its own")
    check_clean(clean)
    compared = _opened(request, clean, callbacks)
    if request.folder is not None:
        with explained(request.folder):
            request.folder.mkdir(parents=True, exist_ok=True)
    report = _measured(request, compared, callbacks)
    if request.folder is not None:
        write_whole(request.folder, REPORT, dump_json(report.as_json()))
        write_whole(request.folder, TABLE, (report.table() + "\n").encode())
        clear_scratch(request.folder)
    return report


def _opened(request: GapRequest, clean: Dataset[Any], callbacks: Callbacks) -> _Comparison:
    """Opens everything. The twin is rendered last, so that errors are found before."""
    from gear.compositor.registry import open_compositor

    split = clean.plan.info.split
    pairs = None if request.twin is None else pair_twins(clean, open_dataset(request.twin_root, split))
    engines = {name: open_compositor(name, clean, rounding=True) for name in request.compositors}
    effect = None if request.model is None else Effect.of(request, clean, callbacks)
    if pairs is None:
        assert request.patch is not None
        collect_twin(
            clean,
            request.patch,
            request.twin_root,
            samples=request.samples,
            town=request.town,
            scenes=request.scenes,
        )
        pairs = pair_twins(clean, open_dataset(request.twin_root, split))
    images = shown_patches(pairs.second, len(clean.sidecar(0).record.surfaces))
    return _Comparison(pairs=pairs, engines=engines, images=images, effect=effect)


def _measured(request: GapRequest, compared: _Comparison, callbacks: Callbacks) -> GapReport:
    """Compares sample by sample."""
    pairs, effect = compared.pairs, compared.effect
    count = min(len(pairs), request.samples or len(pairs))
    found: list[SampleGap] = []
    callbacks.on_progress(0, count)
    for index in range(count):
        found += sample_gaps(pairs, compared.engines, compared.images, index, effect)
        callbacks.on_progress(index + 1, count)
    fit = None if effect is None else effect.fit_report()
    for problem in () if fit is None else fit.problems:
        callbacks.on_warning(f"WARNING: {problem}")
    clean, twin = pairs.first, pairs.second
    return GapReport(
        dataset=str(clean.root),
        twin=str(twin.root),
        split=clean.plan.info.split,
        patch=twin.plan.patch["label"],
        renderer=clean.named("renderer"),
        quality=clean.content(str, "quality"),
        samples=tuple(found),
        effect={} if effect is None else effect.result(),
        sample_effects=() if effect is None else tuple(effect.samples),
        metric="" if effect is None else effect.metric,
        model=request.model,
        defense=None if request.guard is None else request.guard.defense,
        seed=request.seed,
        fit=fit,
    )


def sample_gaps(
    pairs: Twins[Any],
    engines: Mapping[str, BaseCompositor],
    images: Sequence[UInt8Image],
    index: int,
    effect: Effect | None,
) -> list[SampleGap]:
    """Compares the views of one sample that show a patch.

    Args:
        pairs: the clean dataset and the same dataset rendered with the patch.
        engines: compositors by name.
        images: the patches, (h, w, 3) uint8 sRGB, one per surface.
        index: index of the sample.
        effect: receives the sample, to measure the effect on a model; None without a model.
    """
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


def composed_picture(engine: BaseCompositor, images: Sequence[UInt8Image], index: int, view: str) -> UInt8Image:
    """Composes patches into one view of a sample; returns the (H, W, 3) uint8 sRGB picture.

    Args:
        engine: compositor that rounds its result to whole levels of 0..255.
        images: patches, (h, w, 3) uint8 sRGB, one per surface.
        index, view: index of the sample and name of the camera.
    """
    import torch

    patches = [torch.from_numpy(image.copy()).permute(2, 0, 1).float() / 255 for image in images]
    with torch.no_grad():
        values = engine.compose(patches, [index], view)[0].permute(1, 2, 0).cpu().numpy()
    return np.asarray(np.rint(values * 255), dtype=np.uint8)


def shown_patches(twin: Dataset[Any], surfaces: int) -> list[UInt8Image]:
    """Reads the patches that a dataset was rendered with, from the copies that the dataset holds.

    Args:
        twin: the dataset with patches.
        surfaces: number of surfaces of its scene.

    Returns:
        (H, W, 3) uint8 sRGB patches, one per surface, in the order of the surfaces.

    Raises:
        DatasetError: the dataset has fewer patches than surfaces, or the copies differ from the rendered patches.
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
