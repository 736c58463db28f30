"""Twins and evaluations in a real browser, opened from disk."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import gear
from gear.view.write import write_view

from .browser import Browser
from .test_view_browser import cells, loaded, no_trouble, text

pytestmark = pytest.mark.slow

CHOOSE = """
(() => {
  const select = document.getElementById('%s');
  select.value = [...select.options].find((option) => option.textContent.startsWith('%s')).value;
  select.dispatchEvent(new Event('change'));
})()
"""
BOX = """
(() => {
  const { left, top, width, height } = document.querySelector('#compare .pair').getBoundingClientRect();
  return [left, top, width, height];
})()
"""


@pytest.fixture(scope="module")
def page(twins: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("page") / "page.html"
    write_view(twins.none, out, twins=[twins.patched], evaluations=[twins.evaluation, twins.defended])
    return out


def shown_pair(browser: Browser) -> np.ndarray:
    """The pixels of the compared pictures as the browser shows them, RGB, in the datasets' size."""
    browser.value("document.getElementById('compare').style.width = '700px'")  # so that all of it is in the window
    loaded(browser, "#compare .pair img")
    left, top, width, height = (round(side) for side in browser.value(BOX))
    shot = cv2.imdecode(np.frombuffer(io.BytesIO(browser.screenshot()).getvalue(), np.uint8), cv2.IMREAD_COLOR)
    return cv2.resize(shot[top : top + height, left : left + width, ::-1], (400, 240), interpolation=cv2.INTER_AREA)


def test_the_slider_shows_one_twin_left_of_it_and_the_other_right(browser: Browser, page: Path, twins: Any) -> None:
    browser.open(page, "#/sample/3")
    none, odd = (gear.open_dataset(root)[3].images["left"].astype(int) for root in (twins.none, twins.patched))
    seen = shown_pair(browser).astype(int)
    for columns, here, there in ((slice(150, 198), none, odd), (slice(202, 216), odd, none)):
        rows = slice(101, 139)  # of the patch, without the labels in the corners
        near, far = (np.abs(seen[rows, columns] - one[rows, columns]).mean() for one in (here, there))
        assert near < 25 and (far > 2 * near or columns.stop < 181), (columns, near, far)
    browser.value("const s = document.getElementById('compare-at'); s.value = 0; s.dispatchEvent(new Event('input'))")
    seen = shown_pair(browser).astype(int)
    assert np.abs(seen[105:135, 185:215] - odd[105:135, 185:215]).mean() < 25
    no_trouble(browser)


def test_the_difference_is_black_but_on_the_patch(browser: Browser, page: Path) -> None:
    browser.open(page, "#/sample/3")
    browser.value("document.querySelector('[data-mode=difference]').click()")
    seen = shown_pair(browser).astype(int)
    inside = np.zeros(seen.shape[:2], bool)
    inside[100:140, 180:220] = True
    assert (
        seen[inside].mean() > 60
        and seen[~cv2.dilate(inside.astype(np.uint8), np.ones((9, 9))).astype(bool)].mean() < 12
    )
    assert [Path(one).name for one in browser.requests] == ["rgb_0003.png"] * 2  # the files: the page has losses
    browser.requests.clear()
    browser.press("c")
    assert browser.value("document.querySelector('[data-mode=slider]').getAttribute('aria-pressed')") == "true"
    browser.press("c")
    assert loaded(browser, "#compare .two img") == 2
    no_trouble(browser)


def test_outlines_fit_defended_pictures_that_are_stored_smaller(browser: Browser, page: Path) -> None:
    browser.open(page, "#/sample/3")
    browser.until("document.querySelectorAll('#sample figure').length > 6")
    box = "f.querySelector('svg')?.getAttribute('viewBox')"
    shown = f"[...document.querySelectorAll('#sample figure')].map((f) => [f.querySelector('b').textContent, {box}])"
    boxes = dict(browser.value(shown))
    defended = {name: box for name, box in boxes.items() if name.startswith("Defended")}
    assert len(defended) == 2 and set(defended.values()) == {boxes["Camera left · none"]} == {"-0.5 -0.5 400 240"}
    texts = str(browser.value("[...document.querySelectorAll('#sample figcaption')].map((f) => f.textContent).join()"))
    assert "200 × 120" in texts
    no_trouble(browser)


def test_samples_are_sorted_by_what_changed_most(browser: Browser, page: Path) -> None:
    browser.open(page)
    assert cells(browser) == ["000000", "000001", "000002", "000003"]
    browser.value(CHOOSE % ("sort", "Picture change"))
    assert cells(browser) == ["000003", "000002", "000001", "000000"]
    values = browser.value("[...document.querySelectorAll('#cells .sorted')].map((one) => Number(one.textContent))")
    assert values == sorted(values, reverse=True) and values[0] > 0
    browser.value("document.getElementById('order').click()")
    assert cells(browser) == ["000000", "000001", "000002", "000003"]
    assert "sort=pictures" in str(browser.value("location.hash")) and "order=up" in str(browser.value("location.hash"))
    browser.open(page, str(browser.value("location.hash")).replace("order=up", ""))
    assert cells(browser)[0] == "000003"
    assert any("Changed objects" in option for option in options(browser, "sort"))
    no_trouble(browser)


def options(browser: Browser, name: str) -> list[str]:
    return list(browser.value(f"[...document.getElementById('{name}').options].map((one) => one.textContent)"))


def test_what_the_patch_did_to_objects_is_listed_drawn_and_filtered(browser: Browser, page: Path) -> None:
    browser.open(page, "#/sample/0")
    browser.until("document.querySelectorAll('#sample table').length > 3")
    card = "[...document.querySelectorAll('#sample .card')].find((one) => one.textContent.startsWith('What the patch'))"
    rows = browser.value(f"[...{card}.querySelectorAll('tbody tr')].map((row) => row.firstChild.textContent)")
    assert rows and set(rows) == {"hidden"}
    figures = "[...document.querySelectorAll('#sample figure')]"
    counted = "[f.querySelector('b').textContent, f.querySelectorAll('.change.hidden').length]"
    boxes = dict(browser.value(f"{figures}.map((f) => {counted})"))
    assert boxes["Camera left · odd"] == boxes["Prediction objects · odd · odd"] == len(rows)
    assert boxes["Camera left · none"] == boxes["Prediction objects · odd · odd + jpeg"] == 0
    browser.open(page, "#/samples?change=hidden")
    assert len(cells(browser)) == 4
    browser.open(page, "#/samples?change=invented")
    assert cells(browser) == []
    no_trouble(browser)


def test_predictions_and_defended_pictures_are_channels_with_legends(browser: Browser, page: Path) -> None:
    browser.open(page)
    wanted = ["Prediction objects · none · odd", "Defended left · odd · odd + jpeg", "Preview boxes · none"]
    assert set(wanted) <= set(options(browser, "channel"))
    browser.value(CHOOSE % ("channel", "Prediction objects · none · odd"))
    assert loaded(browser, "#cells img") == 8  # each over its camera's picture
    assert "object of the ground truth" in text(browser, "#channel-legend")
    browser.press("t")
    assert (
        browser.value("document.getElementById('channel').selectedOptions[0].textContent")
        == "Prediction objects · odd · odd"
    )
    browser.value(CHOOSE % ("channel", "Preview boxes"))
    assert "person" in text(browser, "#channel-legend")
    no_trouble(browser)


def test_depth_has_a_colour_bar_and_the_map_has_streets(browser: Browser, write_dataset: Any, tmp_path: Path) -> None:
    root = write_dataset("depth", 2)
    write_view(root, tmp_path / "page.html")
    browser.open(tmp_path / "page.html")
    browser.value(CHOOSE % ("channel", "Preview depth"))
    assert text(browser, "#channel-legend").startswith("depth (m)")
    ticks = browser.value(
        "[...document.querySelectorAll('#channel-legend .ticks span')].map((one) => parseFloat(one.style.left))"
    )
    assert ticks[0] == 0 and ticks[-1] == 100 and ticks == sorted(ticks)
    assert "gradient" in browser.value("document.querySelector('.colour-bar').style.background")
    no_trouble(browser)


def test_the_map_shows_the_lanes_of_the_town(
    browser: Browser, write_dataset: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gear.view.write.streets", lambda town: [["lane", 6.0, [-50.0, -34.0, 80.0, -34.0]]])
    write_view(write_dataset("depth", 2), tmp_path / "page.html")
    browser.open(tmp_path / "page.html", "#/map")
    grey = """
    new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => {
      const canvas = document.querySelector('#map canvas');
      const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
      let count = 0;
      const isLane = (i) => data[i] === 0x2c && data[i + 1] === 0x35 && data[i + 2] === 0x40;
      for (let i = 0; i < data.length; i += 4) count += isLane(i);
      done(count);
    })))
    """
    assert browser.value(grey) > 5000
    no_trouble(browser)
    browser.value("document.querySelector('.legend input').click()")
    assert browser.value(grey) == 0
