"""A guard: a defense as the user requests it, with name, options and calibration data."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from gear.measuring.calibration import NOTHING, Calibration, opened_calibration
from gear.measuring.plugin_selection import Chosen, check_defense, chosen_defense
from gear.values.errors import GearError
from gear.values.progress import NO_CALLBACKS, Callbacks


@dataclass(frozen=True, slots=True, kw_only=True)
class Guard:
    """A request for a defense.

    Attributes:
        defense: name of a defense plugin.
        settings: options of the defense as `KEY=VALUE` texts.
        calibration: root of the clean calibration dataset; None without calibration data.
        calibration_patched: root of the same dataset with patches; None without patched calibration data.
    """

    defense: str
    settings: tuple[str, ...] = ()
    calibration: str | Path | None = None
    calibration_patched: str | Path | None = None

    @staticmethod
    def of(
        defense: str | None,
        settings: Iterable[str] = (),
        calibration: str | Path | None = None,
        calibration_patched: str | Path | None = None,
    ) -> Guard | None:
        """Makes the request for a defense from the arguments of a verb such as `evaluate`; None without a defense.

        Args:
            defense: name of the defense; None for no defense.
            settings: `KEY=VALUE` options of the defense.
            calibration: clean dataset for the calibration.
            calibration_patched: the same samples with a patch.

        Raises:
            GearError: options or calibration data are given without a defense.
        """
        options = tuple(settings)
        if defense:
            return Guard(
                defense=defense, settings=options, calibration=calibration, calibration_patched=calibration_patched
            )
        if options:
            raise GearError(f"{options[0]} is a defense's option, but there is no defense: name one with --defense")
        if calibration is not None or calibration_patched is not None:
            raise GearError("defenses learn from calibration data, but there is no defense: name one with --defense")
        return None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class OpenedGuard:
    """A requested defense whose plugin was found and whose calibration data were opened.

    Attributes:
        defense: the plugin with its options; None without a defense.
        calibration: the calibration data.
    """

    defense: Chosen | None = None
    calibration: Calibration = field(default=NOTHING)


UNGUARDED = OpenedGuard()


def open_guard(
    guard: Guard | None,
    models: Sequence[Chosen],
    task: str,
    *,
    callbacks: Callbacks = NO_CALLBACKS,
) -> OpenedGuard:
    """Finds the plugin of a requested defense, opens its calibration data, and checks that they fit the models and
    the task.

    Args:
        guard: the request for a defense; None for no defense.
        models: models that the defense protects, one after the other.
        task: name of the dataset's task.
        callbacks: called while the defense is calibrated, as in `Calibration`.

    Raises:
        GearError: there is no such defense, an option does not fit, the data cannot be read, or the defense does not
            fit the models or the task.
    """
    if guard is None:
        return UNGUARDED
    chosen = chosen_defense(guard.defense, guard.settings)
    assert chosen is not None
    calibration = opened_calibration(
        guard.calibration,
        guard.calibration_patched,
        models,
        guard.defense,
        callbacks=callbacks,
    )
    for model in models:
        check_defense(chosen, model, task, is_calibrated=calibration.clean is not None)
    return OpenedGuard(defense=chosen, calibration=calibration)
