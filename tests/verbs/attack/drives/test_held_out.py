"""The summary of held-out drives."""

from __future__ import annotations

import pytest

from gear.verbs.attack.drives.held_out import summary
from tests.verbs.drive.test_report import result


def test_the_summary_of_a_twin() -> None:
    found = summary([result("patch", 0, is_crash=True), result("patch", 1)])
    assert (found["drives"], found["crashes"], found["phantoms"]) == (2, 1, 0)
    assert found["interval"] == pytest.approx([0.0126, 0.9874], abs=1e-4)
    assert found["impact_mps"] == 5.0 and found["score"] == pytest.approx((0.5 + result("patch", 1).measures.score) / 2)
    nothing = summary([])
    assert nothing["drives"] == 0 and nothing["interval"] is None and nothing["least_ttc_s"] is None
