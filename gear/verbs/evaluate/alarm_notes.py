"""Warnings about alarm levels that do not carry over from the calibration pictures to the measured scene."""

from __future__ import annotations

from collections.abc import Sequence

from gear.contracts.tasks import NO_PATCH
from gear.values.serial import Json
from gear.verbs.evaluate.report import ALARMS, RowReport

EXPECTED = "false_alarms_high"
"""Value of a fit report: the largest share of false alarms that the draw of the calibration pictures explains."""


def alarm_notes(rows: Sequence[RowReport], fit: Json) -> list[str]:
    """One warning for each clean dataset that raises clearly more alarms than the calibration explains.

    Clearly: the lower end of the exact 95 % interval of its share (Clopper and Pearson, 1934) is above the upper end of
    the share that new pictures like those of the calibration have.

    Args:
        rows: the measured datasets.
        fit: what the defense learnt, as in `results.json`; None for a defense that reports nothing.
    """
    expected = (fit or {}).get("values", {}).get(EXPECTED)
    if expected is None:
        return []
    return [
        f"WARNING: {row.name}: {row.defense[ALARMS]:.0%} of {row.samples} clean pictures raise the alarm, and the "
        f"calibration pictures promise at most {expected:.0%}: the alarm level does not carry over to these scenes; "
        "calibrate on pictures of more scenes"
        for row in rows
        if row.facts["patch"] == NO_PATCH and ALARMS in row.defense and _least_share(row) > expected
    ]


def _least_share(row: RowReport) -> float:
    """Lower end of the exact 95 % interval of a dataset's share of alarms."""
    from scipy import stats

    alarms = round(row.defense[ALARMS] * row.samples)
    return float(stats.beta.ppf(0.025, alarms, row.samples - alarms + 1)) if alarms else 0.0
