from __future__ import annotations

from gear.reporting.report_page import NEARBY, POLICY, report_page


def test_a_page_is_whole_and_escapes_its_title() -> None:
    page = report_page("<b>", ["<p>one</p>", "<p>two</p>"])
    assert page.startswith("<!doctype html>") and page.endswith("</body></html>\n")
    assert "<title>&lt;b&gt;</title>" in page and "<h1>&lt;b&gt;</h1>" in page
    assert POLICY.format(sources="data:") in page and "<p>one</p>\n<p>two</p>" in page


def test_pictures_may_be_files_next_to_the_page() -> None:
    page = report_page("x", [], sources=NEARBY)
    assert "img-src 'self' file:;" in page and "default-src 'none'" in page
