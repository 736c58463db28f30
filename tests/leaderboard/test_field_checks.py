"""Checks of the values in records."""

from __future__ import annotations

import pytest

from gear.leaderboard.field_checks import check_name, check_number, check_plugin_name, check_sha256, check_text
from gear.values.errors import FieldError


@pytest.mark.parametrize("text", ["", "a/b", "..", "a\nb", "<b>", "x" * 81, " x"])
def test_names_are_plain(text: str) -> None:
    with pytest.raises(FieldError, match="name"):
        check_name("name", text)
    check_name("name", "town10-billboard01 +x")


def test_other_values() -> None:
    check_plugin_name("name", "package/plugin")
    check_text("text", "")
    check_sha256("hash", "0" * 64)
    check_number("n", 1.0, low=0, high=1)
    for check, text in ((check_plugin_name, "a/../b"), (check_text, "\x1b[0m"), (check_sha256, "A" * 64)):
        with pytest.raises(FieldError):
            check("field", text)
    for value in (float("nan"), float("inf"), -0.1, 1.1):
        with pytest.raises(FieldError):
            check_number("n", value, low=0, high=1)
