"""Reports on paper: no column of a table is cut off at the edge of the page."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.reporting.html_table import html_table
from gear.reporting.report_page import report_page
from gear.verbs.bench.table import OBJECT_COLUMNS, REST
from gear.verbs.evaluate.table import number

from .browser import Browser

PAPER_PX = round(277 / 25.4 * 96)
"""Width of A4 landscape without its margins of 10 mm, in pixels of CSS."""

RIGHT = """Math.max(...[...document.querySelectorAll('td, th, img')].map(
  one => one.getBoundingClientRect().right + one.scrollWidth - one.clientWidth))"""
"""Where the rightmost cell or picture ends, with what it does not show, in pixels of CSS."""


@pytest.mark.parametrize("name", ["net", "ddrnet23_slim_depth_of_a_long_name"])
def test_the_widest_table_fits_on_paper(browser: Browser, tmp_path: Path, name: str) -> None:
    titles = ["network", "defense", "patch", "reference.car_bev_moderate_r40", "change", "gain", "outside patch", "p",
              *OBJECT_COLUMNS, *REST]  # fmt: skip
    value = f"{number(0.123)} [0.100, 0.150]"
    cells = [name, "hyperneuron", "adaptive patch (failed)", *[value] * (len(titles) - 3)]
    pixel = "data:image/gif;base64,R0lGODlhAQABAIAAAAAAAP///yH5BAEAAAAALAAAAAABAAEAAAIBRAA7"
    row = f'<div class="row">{f"<figure><img width=560 height=280 src={pixel}></figure>" * 4}</div>'
    path = tmp_path / "report.html"
    path.write_text(report_page("bench", [html_table(titles, [(True, cells)] * 3), row]))
    browser.open(path)
    browser._call("Emulation.setEmulatedMedia", media="print")
    browser._call("Emulation.setDeviceMetricsOverride", width=PAPER_PX, height=700, deviceScaleFactor=1, mobile=False)
    try:
        right = browser.value(RIGHT)
        tops = browser.value("[...document.querySelectorAll('img')].map(one => one.getBoundingClientRect().top)")
    finally:
        browser._call("Emulation.setEmulatedMedia", media="")
        browser._call("Emulation.setDeviceMetricsOverride", width=1360, height=900, deviceScaleFactor=1, mobile=False)
    assert 0.9 * PAPER_PX < right <= PAPER_PX + 1
    assert len(set(tops)) == 1, "four pictures stand beside each other"
