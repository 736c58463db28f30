"""Parts of HTML reports."""

from __future__ import annotations

from gear.reporting.html_table import Link, html_table


def test_names_are_escaped_in_tables() -> None:
    text = html_table(["<b>"], [(True, ["a & b"]), (False, ["'c'"])])
    assert "<th>&lt;b&gt;</th>" in text
    assert "<tr class=first><td>a &amp; b</td></tr>" in text
    assert "<tr><td>&#x27;c&#x27;</td></tr>" in text


def test_links_are_escaped() -> None:
    table = html_table(["x"], [(False, [Link("a<b", 'x"y.html')])])
    assert '<a href="x&quot;y.html">a&lt;b</a>' in table
