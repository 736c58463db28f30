"""Parts of the leaderboard's pages."""

from __future__ import annotations

from gear.leaderboard.verdict import Verdict, finding
from gear.verbs.leaderboard.pages import index_page, record_page
from tests.leaderboard.conftest import filed, record, sha


def test_a_record_page_shows_the_verdict() -> None:
    one = filed(record())
    assert "Nobody has checked this record" in record_page(one, None)
    facts = {"seed": 1, "repeated": 2, "fresh": 0, "environment": {}}
    verdict = Verdict(record_sha256=sha("x"), state="differs", findings=(finding("differs", "<b>other</b>"),), **facts)  # type: ignore[arg-type]
    page = record_page(one, verdict)
    assert "Check: differs" in page and "&lt;b&gt;other&lt;/b&gt;" in page and "<b>" not in page


def test_an_empty_board_is_a_page() -> None:
    page = index_page([], ["<x>: is no gear-record"], None)
    assert "&lt;x&gt;" in page and "Content-Security-Policy" in page and "<table>" not in page
