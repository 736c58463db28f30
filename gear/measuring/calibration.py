"""Calibration data of a defense: a clean dataset and, optionally, the same dataset with patches."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from gear.contracts.defenses import Defense, FitsInPhases
from gear.contracts.models import Model
from gear.contracts.tasks import NO_PATCH
from gear.dataset.reading import Dataset, scenes_of
from gear.measuring.plugin_selection import Chosen, check_model
from gear.plugins.build import blamed
from gear.plugins.datasets import open_dataset
from gear.values.errors import GearError
from gear.values.frames import UInt8Image
from gear.values.lazy_sequence import LazySequence
from gear.values.progress import NO_CALLBACKS, Callbacks
from gear.values.rng import derive_rng
from gear.values.serial import Json

Views = Mapping[str, UInt8Image]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Calibration:
    """The calibration data of a defense.

    Attributes:
        clean: dataset without patches; None without calibration data.
        patched: the same dataset with patches; None if the user gave only clean data.
        callbacks: its `on_fit_progress` is called with (number of samples that the defense has read, total number of
            samples), and its `on_fit_phase` by defenses that report the phases of their calibration.
    """

    clean: Dataset[Any] | None = None
    patched: Dataset[Any] | None = None
    callbacks: Callbacks = NO_CALLBACKS

    def fit(self, defense: Chosen, product: Defense, model: Model, cameras: Sequence[str], seed: int) -> Any:
        """Calibrates a defense for one model; this may take minutes.

        Args:
            defense: plugin of the defense with its options.
            product: the built defense.
            model: the model without the defense.
            cameras: names of the cameras whose pictures the model uses.
            seed: seed of the defense's random draws.

        Returns:
            The state of the calibrated defense; None without calibration data.

        Raises:
            GearError: the data do not fit the defense, or code of another package fails.
        """
        if self.clean is None:
            return None
        given = [one for one in (self.clean, self.patched) if one is not None]
        read: set[tuple[int, int]] = set()

        def took(side: int, index: int) -> None:
            if (side, index) not in read:
                read.add((side, index))
                self.callbacks.on_fit_progress(len(read), sum(map(len, given)))

        clean, *others = (CalibrationViews(one, cameras, partial(took, side)) for side, one in enumerate(given))
        patched: Sequence[Views] = others[0] if others else ()
        rng = derive_rng(seed, "calibrate", defense.found.spec.name)
        with blamed(defense.found, "fit"):
            if isinstance(product, FitsInPhases):
                return product.fit_in_phases(clean, patched, model, rng, self.callbacks.on_fit_phase)
            return product.fit(clean, patched, model, rng)

    def facts(self) -> list[str | None]:
        """The content keys (hashes of everything that decides the bytes) of the clean and the patched dataset;
        None for a missing one.
        """
        return [None if one is None else one.plan.content_key for one in (self.clean, self.patched)]

    def counted(self) -> Json:
        """The numbers of samples as JSON for the results: `{"calibration_samples": [clean, patched]}`, with None for a
        missing patched dataset; empty without calibration data.
        """
        if self.clean is None:
            return {}
        return {"calibration_samples": [None if one is None else len(one) for one in (self.clean, self.patched)]}

    @property
    def shows_patch(self) -> bool:
        """Whether the dataset that should be clean shows a patch."""
        return self.clean is not None and _label(self.clean) != NO_PATCH

    def doubts(self) -> list[str]:
        """Warnings about the calibration data, one line each: clean pictures that show a patch, or datasets that
        differ in more than the patch.
        """
        clean, patched, lines = self.clean, self.patched, []
        if clean is not None and self.shows_patch:
            lines.append(f"{clean.root}: shows the patch {_label(clean)}, but the defense uses its pictures as clean")
        if clean is not None and patched is not None and clean.plan.twin_key != patched.plan.twin_key:
            lines.append(f"{patched.root}: is no twin of {clean.root}, so more than a patch differs in what was learnt")
        return lines

    def note(self, measured: Dataset[Any]) -> str | None:
        """A warning if a defense is evaluated on scenes of its own calibration data; otherwise None.

        Args:
            measured: the dataset on which the defense is evaluated.
        """
        if self.clean is None or scenes_of(self.clean) != scenes_of(measured):
            return None
        return f"{measured.root}: the defense learnt from scenes that it is measured on; other scenes are harder for it"


NOTHING = Calibration()


def opened_calibration(
    clean: str | Path | None,
    patched: str | Path | None,
    models: Sequence[Chosen],
    defense: str | None,
    *,
    callbacks: Callbacks = NO_CALLBACKS,
) -> Calibration:
    """Opens the calibration data of a defense and checks them.

    Args:
        clean, patched: roots of the datasets without and with patches; None for no dataset.
        models: models that the defense protects.
        defense: name of the defense.
        callbacks: called while the defense is calibrated, as in `Calibration`.

    Raises:
        GearError: a dataset cannot be read or does not fit a model, the two datasets are swapped, or there is no
            defense.
    """
    if clean is None and patched is None:
        return NOTHING
    if not defense:
        raise GearError("defenses learn from calibration data, but there is no defense: name one with --defense")
    if clean is None:
        raise GearError("--calibration-patched is the twin of clean pictures: give them with --calibration DIR")
    opened = [None if one is None else open_dataset(one) for one in (clean, patched)]
    for dataset in opened:
        for model in models:
            if dataset is not None:
                check_model(model, dataset)
    pair = Calibration(clean=opened[0], patched=opened[1], callbacks=callbacks)
    if pair.shows_patch and pair.patched is not None and _label(pair.patched) == NO_PATCH:
        raise GearError(f"{clean} shows a patch, {patched} none: --calibration and --calibration-patched are swapped")
    return pair


def _label(dataset: Dataset[Any]) -> str:
    return dataset.plan.info.patch_label


class CalibrationViews(LazySequence[Views]):
    """The pictures of a dataset as a sequence; each sample is a mapping from camera names to (H, W, 3) uint8 pictures.

    A sample is read from disk when it is indexed.
    """

    def __init__(self, dataset: Dataset[Any], names: Sequence[str], took: Callable[[int], None]) -> None:
        """Prepares the sequence; nothing is read.

        Args:
            dataset: the dataset.
            names: names of the cameras whose pictures are returned.
            took: called with the index of each sample that is read.
        """
        self._dataset, self._names, self._took = dataset, tuple(names), took

    def __len__(self) -> int:
        return len(self._dataset)

    def item(self, index: int) -> Views:
        """Reads the pictures of the sample `index`."""
        images = self._dataset[index].images
        self._took(index)
        return {name: images[name] for name in self._names}
