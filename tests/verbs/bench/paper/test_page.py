"""The paper's tables as HTML."""

from __future__ import annotations

from gear.verbs.bench.paper.page import paper_table
from gear.verbs.bench.paper.tables import paper_tables
from tests.verbs.bench.synthetic import report


def test_the_html_has_the_layout_and_the_colours() -> None:
    text = paper_table(paper_tables(report())[1])
    assert '<th colspan="2">semseg (miou)</th>' in text and '<td class="better grey">-10.00</td>' in text
    assert "clean&amp;er" in text and text.count("<tr class=first>") == 2
