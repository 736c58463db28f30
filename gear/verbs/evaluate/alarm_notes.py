"""Warnings about defenses whose alarm level, set on the calibration pictures, gives too many false alarms in the
measured scenes.
"""

from __future__ import annotations

from collections.abc import Sequence

from gear.contracts.tasks import NO_PATCH
from gear.measuring.detection_rates import share_interval
from gear.values.serial import Json
from gear.verbs.evaluate.report import ALARMS, RowReport

EXPECTED = "false_alarms_high"
"""Key in a defense's calibration report: largest share of false alarms that chance in the calibration explains."""


def alarm_notes(rows: Sequence[RowReport], fit: Json) -> list[str]:
    """Returns one warning for each clean dataset that raises clearly more alarms than the calibration explains.

    Clearly means that two intervals do not overlap: the exact 95 % interval of the dataset's share of alarms (Clopper
    and Pearson, 1934), and the range of shares that new pictures like the calibration pictures would have.

    Args:
        rows: the results of the datasets.
        fit: report of the defense on its calibration, as in `results.json`; None for a defense without such a report.
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
    """Returns the lower end of the exact 95 % interval of a dataset's share of alarms."""
    return share_interval(round(row.defense[ALARMS] * row.samples), row.samples)[0]
