"""The page in a real browser, opened from disk."""

from __future__ import annotations

import dataclasses
import json
import shutil
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gear.contracts.tasks import Encoded, Sample, Sidecar, SplitInfo
from gear.dataset.files import write_whole
from gear.dataset.json_text import dump_json
from gear.dataset.layout import manifest_path, sidecar_path
from gear.dataset.reading import Dataset
from gear.dataset.sidecar import sidecar_bytes
from gear.plugins.datasets import open_dataset
from gear.values.frames import Frame, UInt8Image
from gear.values.rig import CameraMount, Rig
from gear.values.scene import SceneRecord
from gear.view.write import write_page, write_view

from .browser import Browser
from .view_datasets import store_samples

pytestmark = pytest.mark.slow

RUN = "document.title='ran'"
EVIL = f"""</script><script>{RUN}</script><img src=x onerror="{RUN}">'"{{{{script}}}}&lt;b&gt;"""

WIDTHS = """
[...document.querySelectorAll('#sample figure')].map((f) => [...f.querySelectorAll('img')].map((i) => i.naturalWidth))
"""
PIXELS = """
(() => {
  const img = document.querySelectorAll('#cells img')[%d];
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [img.naturalWidth, img.naturalHeight];
  const pen = canvas.getContext('2d');
  pen.drawImage(img, 0, 0);
  return [...pen.getImageData(0, 0, canvas.width, canvas.height).data];
})()
"""
OUTLINE = """
(() => {
  const cell = document.querySelectorAll('.cell')[7];
  const box = cell.querySelector('.stack').getBoundingClientRect();
  const line = cell.querySelector('polygon').getBoundingClientRect();
  return [line.left, line.top, line.right, line.bottom].map((v, i) => (v - (i % 2 ? box.top : box.left)) / box.width);
})()
"""
MAP_SPOTS = """
new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => {
  const canvas = document.querySelector('#map canvas');
  const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
  let [x, y, egos, boards] = [0, 0, 0, 0];
  for (let i = 0; i < data.length; i += 4) {
    if (data[i] === 255 && data[i + 1] === 106) boards += 1;
    if (data[i] !== 124 || data[i + 1] !== 192 || data[i + 2] !== 255) continue;
    const p = i / 4;
    if (!egos || p % canvas.width < x) [x, y] = [p % canvas.width, Math.floor(p / canvas.width)];
    egos += 1;
  }
  const box = canvas.getBoundingClientRect();
  done([box.left + x + 6, box.top + y, egos, boards]);
})))
"""
BARS = """
Object.fromEntries([...document.querySelectorAll('#statistics .card')].map((card) => [
  card.querySelector('h2').textContent,
  Object.fromEntries([...card.querySelectorAll('.bars dt')].map((dt) =>
    [dt.textContent, dt.nextSibling.nextSibling.textContent])),
]))
"""


@pytest.fixture
def page(write_dataset: Any, tmp_path: Path) -> Path:
    """Eight stereo samples, the board from 30 m to 10 m away."""
    write_view(write_dataset("stereo3d", 8), tmp_path / "page.html")
    return tmp_path / "page.html"


def loaded(browser: Browser, selector: str) -> Any:
    return browser.until(
        f"(() => {{ const all = [...document.querySelectorAll('{selector}')];"
        " return all.length && all.every((img) => img.complete && img.naturalWidth) && all.length; })()"
    )


def cells(browser: Browser) -> list[str]:
    return list(
        browser.value("[...document.querySelectorAll('#cells li:not([hidden]) .caption b')].map((b) => b.textContent)")
    )


def text(browser: Browser, selector: str) -> str:
    return str(browser.value(f"document.querySelector('{selector}').textContent"))


def hash_of(browser: Browser) -> str:
    return str(browser.value("location.hash"))


def wait_for_hash(browser: Browser, wanted: str) -> None:
    browser.until(f"location.hash === '{wanted}'")


def no_trouble(browser: Browser) -> None:
    assert browser.errors == []
    assert browser.requests == []


def test_the_sheet_shows_every_sample_as_it_is(browser: Browser, page: Path, tmp_path: Path) -> None:
    browser.open(page)
    assert cells(browser) == [f"{i:06d}" for i in range(8)]
    assert text(browser, "#count") == "8 samples"
    browser.press("1")
    assert loaded(browser, "#cells img") == 8
    dataset = open_dataset(tmp_path / "stereo3d")
    for number in (0, 7):
        shown = np.array(browser.value(PIXELS % number)).reshape(124, 408, 4)[..., :3]
        assert np.abs(shown - dataset[number].images["left"].astype(int)).mean() < 12
        assert np.abs(shown - dataset[number].images["left"].astype(int)[:, ::-1]).mean() > 20
    no_trouble(browser)


def test_outlines_lie_on_the_patch(browser: Browser, page: Path, tmp_path: Path) -> None:
    browser.open(page)
    truth = next(t for t in open_dataset(tmp_path / "stereo3d")[7].surfaces if t.camera == "left")
    assert truth.corners_px is not None
    corners = (np.array(truth.corners_px) + 0.5) / 408
    wanted = [*corners.min(axis=0), *corners.max(axis=0)]
    assert browser.value(OUTLINE) == pytest.approx(wanted, abs=2 / 300)
    browser.press("o")
    assert browser.value("getComputedStyle(document.querySelector('.cell svg')).display") == "none"
    assert text(browser, ".outlines").startswith("Patch outline")
    assert browser.value("document.querySelector('.outlines').getAttribute('aria-pressed')") == "false"


def test_everything_can_be_done_with_keys(browser: Browser, page: Path) -> None:
    browser.open(page)
    focused = "document.activeElement.querySelector('.caption b')?.textContent"
    browser.press("ArrowRight")
    assert browser.value(focused) == "000000"
    browser.press("ArrowRight")
    browser.press("ArrowDown")
    wide = browser.value("getComputedStyle(document.querySelector('#cells')).gridTemplateColumns.split(' ').length")
    assert wide > 1 and browser.value(focused) == f"{1 + wide:06d}"
    browser.press("ArrowUp")
    assert browser.value(focused) == "000001"
    browser.press("Enter")
    wait_for_hash(browser, "#/sample/1")
    browser.until("document.querySelector('#sample-title')?.textContent === 'Sample 000001'")
    browser.press("ArrowRight")
    wait_for_hash(browser, "#/sample/2")
    browser.press("ArrowLeft")
    browser.press("ArrowLeft")
    wait_for_hash(browser, "#/sample/0")
    assert browser.value("document.querySelector('#previous').disabled")
    browser.press("ArrowLeft")
    assert hash_of(browser) == "#/sample/0"
    browser.press("ArrowRight")
    wait_for_hash(browser, "#/sample/1")
    browser.press("Escape")
    wait_for_hash(browser, "#/samples")
    browser.until(f"({focused}) === '000001'")
    for key, wanted in (("m", "#/map"), ("h", "#/statistics"), ("s", "#/samples")):
        browser.press(key)
        wait_for_hash(browser, wanted)
    browser.press("f")
    assert browser.value("!document.querySelector('#filters').hidden && document.activeElement.type === 'range'")
    browser.press("Escape")
    assert browser.value("document.querySelector('#filters').hidden")
    browser.press("?")
    assert browser.value("document.querySelector('#help').open")
    browser.press("Escape")
    browser.until("!document.querySelector('#help').open")
    assert hash_of(browser) == "#/samples"
    browser.press("[")
    assert browser.value("getComputedStyle(document.documentElement).getPropertyValue('--strength')") == "0.9"
    no_trouble(browser)


def test_filters_choose_samples_and_live_in_the_address(browser: Browser, page: Path, tmp_path: Path) -> None:
    distances = [s.surfaces[0].distance_m for s in open_dataset(tmp_path / "stereo3d")]
    near = [f"{i:06d}" for i, distance in enumerate(distances) if distance <= 15]
    assert 0 < len(near) < 8
    browser.open(page)
    slide = (
        "(() => { const slider = document.querySelector('[aria-label=\"Patch distance, at most\"]'); slider.value = 15;"
        " slider.dispatchEvent(new Event('input')); })()"
    )
    browser.value(slide)
    assert cells(browser) == near
    assert text(browser, "#count") == f"{len(near)} of 8 samples"
    assert hash_of(browser) == "#/samples?distance=0%7E15"
    browser.press("m")
    wait_for_hash(browser, "#/map?distance=0%7E15")
    browser.open(page, "#/samples?distance=0%7E15")
    assert cells(browser) == near
    assert browser.value("document.querySelector('[aria-label=\"Patch distance, at most\"]').value") == "15"
    browser.value("document.querySelector('#reset').click()")
    assert len(cells(browser)) == 8 and hash_of(browser) == "#/samples"
    browser.open(page, "#/samples?visible=99~100&distance=0~1")
    assert cells(browser) == [] and browser.value("document.querySelector('#nothing').checkVisibility()")
    for broken in ("#/sample/999", "#/nonsense?distance=a~b&%E0%A4", "#%"):
        browser.open(page, broken)
        assert len(cells(browser)) == 8
    no_trouble(browser)


def test_filters_look_at_the_objects_of_the_task(browser: Browser, write_dataset: Any, tmp_path: Path) -> None:
    root = write_dataset("detect2d", 8)
    objects = [open_dataset(root).sidecar(i).facts["objects"] for i in range(8)]
    label, far = objects[0][0]["label"], max(thing["distance_m"] for things in objects for thing in things)
    wanted = [
        f"{i:06d}"
        for i, things in enumerate(objects)
        if any(t["label"] == label and t["distance_m"] <= far / 2 and t["occluded_fraction"] >= 0.2 for t in things)
    ]
    assert 0 < len(wanted) < 8
    write_view(root, tmp_path / "page.html")
    asked = f"#/samples?object.distance_m=0~{far / 2}&object.occluded_fraction=20~100&thing={label}"
    browser.open(tmp_path / "page.html", asked)
    assert cells(browser) == wanted
    assert text(browser, "#filters").count("Object distance") == 1
    browser.press("h")
    assert "Object distance" in browser.value(BARS)
    browser.value("document.querySelector('#reset').click()")
    assert text(browser, "#count") == "8 samples"
    no_trouble(browser)


def test_without_surfaces_nothing_speaks_of_patches(browser: Browser, tmp_path: Path) -> None:
    task: Any = OddTask()
    store_samples(tmp_path / "odd", "semseg", task, {}, 1, alter=lambda one: dataclasses.replace(one, surfaces=()))
    write_page(dataclasses.replace(open_dataset(tmp_path / "odd"), task=task), tmp_path / "odd.html")
    for fragment in ("", "#/sample/0", "#/map"):
        browser.open(tmp_path / "odd.html", fragment)
        browser.press("f")
        browser.until("'sample' !== location.hash.split('/')[1] || document.querySelectorAll('#sample details').length")
        assert browser.value("document.body.innerText.match(/surface|outline/gi)") is None


def test_columns_of_long_texts_come_last(browser: Browser, write_dataset: Any, tmp_path: Path) -> None:
    write_view(write_dataset("detect2d", 1), tmp_path / "page.html")
    browser.open(tmp_path / "page.html", "#/sample/0")
    headers = "[...document.querySelectorAll('#sample [aria-label=objects] th')].map((th) => th.textContent)"
    browser.until(f"({headers}).length")
    found = browser.value(headers)
    assert found[-1] == "rle" and "distance_m" in found


def test_a_sample_tells_all_it_knows(browser: Browser, page: Path, tmp_path: Path) -> None:
    browser.open(page, "#/sample/5")
    sidecar = open_dataset(tmp_path / "stereo3d").sidecar(5)
    browser.until("document.querySelectorAll('#sample details').length === 2")
    captions = browser.value("[...document.querySelectorAll('#sample figcaption b')].map((b) => b.textContent)")
    assert captions == ["Camera left", "Camera right", "Preview left", "Preview right"]
    assert loaded(browser, "#sample img") == 6  # a preview lies over its camera's picture
    rows = "document.querySelectorAll('#sample [aria-label=\"%s\"] tbody tr').length"
    assert browser.value(rows % "objects") == len(sidecar.facts["objects"])
    assert browser.value(rows % "Actors") == len(sidecar.record.actors)
    assert browser.value(rows % "Patch surfaces") == 2
    browser.value("document.querySelector('#sample details summary').click()")
    browser.until("document.querySelector('#sample details pre').textContent.length > 100")
    assert json.loads(text(browser, "#sample details pre"))["index"] == 5
    links = browser.value("[...document.querySelectorAll('#sample [aria-label=Files] a')].map((a) => a.href)")
    assert links == [(tmp_path / "stereo3d" / path).as_uri() for path in sidecar.files]
    no_trouble(browser)


def test_the_map_shows_who_is_where_and_opens_samples(browser: Browser, page: Path) -> None:
    browser.open(page, "#/map")
    x, y, ego_px, board_px = browser.value(MAP_SPOTS)
    assert ego_px > 200 and board_px > 50
    browser.click(x, y)  # the ego cars drive eastwards from sample to sample: the leftmost is the first
    wait_for_hash(browser, "#/sample/0")
    browser.open(page, "#/map")
    browser.value("document.querySelector('#map .legend input').click()")
    assert browser.value(MAP_SPOTS)[2] == 0
    no_trouble(browser)


def test_statistics_count_what_is_shown(browser: Browser, page: Path, tmp_path: Path) -> None:
    dataset = open_dataset(tmp_path / "stereo3d")
    browser.open(page, "#/statistics")
    found = browser.value(BARS)
    actors = Counter(a.asset for i in range(8) for a in dataset.sidecar(i).record.actors if a.role != "ego")
    assert found["Actors by kind"] == {name: str(number) for name, number in actors.items()}
    kinds = Counter(thing["kitti_type"] for i in range(8) for thing in dataset.sidecar(i).facts["objects"])
    assert {name: shown.split(" ")[0] for name, shown in found["objects.kitti_type"].items()} == {
        name: str(number) for name, number in kinds.items()
    }
    browser.open(page, "#/statistics?distance=0~11")
    few = browser.value(BARS)["Actors by role"]
    assert few["ego"] == text(browser, "#count").split(" ")[0] != "8"
    for asset in actors:  # an ego car of that kind is in every sample, and is not what was chosen
        browser.open(page, f"#/statistics?asset={asset}")
        among = sum(
            any(a.asset == asset and a.role != "ego" for a in dataset.sidecar(i).record.actors) for i in range(8)
        )
        assert text(browser, "#count").split(" ")[0] == str(among)
    no_trouble(browser)


def test_full_pictures_come_from_the_dataset_while_it_is_there(
    browser: Browser, write_dataset: Any, tmp_path: Path
) -> None:
    root = write_dataset("depth", 2)
    assert write_view(root, tmp_path / "page.html", max_mb=0.03).scale < 1
    browser.open(tmp_path / "page.html", "#/sample/1")
    browser.until(f"({WIDTHS})[0][0] === 408")
    assert browser.requests == [(root / "leftImg8bit/test/rgb_0001.png").as_uri()] and browser.errors == []
    shutil.move(root, tmp_path / "elsewhere")
    browser.open(tmp_path / "page.html", "#/sample/1")
    loaded(browser, "#sample img")
    assert 0 < browser.value(WIDTHS)[0][0] < 408
    assert all("ERR_FILE_NOT_FOUND" in error for error in browser.errors)


class OddTask:
    """Nobody's task: cameras of two sizes, previews of a third, facts that are a list, names that bite."""

    def rig(self) -> Rig:
        sizes = {f"front{EVIL}": (160, 90), "rear": (96, 96)}
        return Rig(cameras=tuple(CameraMount(name=n, width_px=w, height_px=h) for n, (w, h) in sizes.items()))

    def ground_truth(self, frame: Frame, record: SceneRecord) -> Sample:
        return Sample(record=record, images={name: view.rgb for name, view in frame.views.items()}, surfaces=())

    def encode(self, sample: Sample, info: SplitInfo) -> Encoded:
        files = {f"raw/{sample.record.index}{name[:4]}": p.tobytes() for name, p in sample.images.items()}
        return Encoded(files=files, facts=[EVIL, {"__proto__": {EVIL: 1}, "constructor": EVIL}])

    def finalise(self, sidecars: Any, info: SplitInfo) -> dict[str, bytes]:
        return {}

    def decode(self, root: Path, sidecar: Sidecar, info: SplitInfo) -> Sample:
        images = {}
        for camera in sidecar.record.cameras:
            data = (root / f"raw/{sidecar.record.index}{camera.name[:4]}").read_bytes()
            images[camera.name] = np.frombuffer(data, np.uint8).reshape(camera.height_px, camera.width_px, 3)
        return Sample(record=sidecar.record, images=images, surfaces=())

    def preview(self, sample: Sample) -> dict[str, UInt8Image]:
        if sample.record.index == 1:
            raise RuntimeError(EVIL)
        return {EVIL: np.full((40, 200, 3), 128, np.uint8), "rear labels": 255 - sample.images["rear"]}


def evil_record(record: SceneRecord) -> SceneRecord:
    actors = tuple(dataclasses.replace(actor, asset=f"{EVIL}{actor.id}") for actor in record.actors)
    weather = dataclasses.replace(record.weather, name=EVIL)
    return dataclasses.replace(record, actors=actors, weather=weather, town=EVIL, scene="__proto__")


def test_names_that_bite_are_only_names(browser: Browser, odd: Dataset[Any], tmp_path: Path) -> None:
    info = dataclasses.replace(odd.plan.info, town=EVIL, scene=EVIL, patch_label=EVIL)
    plan = dataclasses.replace(odd.plan, info=info, content={EVIL: EVIL, "__proto__": {"a": EVIL}})
    report = write_page(
        dataclasses.replace(odd, plan=plan, manifest={**odd.manifest, EVIL: {EVIL: EVIL}}), tmp_path / "odd.html"
    )
    assert [index for index, _ in report.problems] == [1]
    for fragment in ("", "#/sample/0", "#/sample/1", "#/map", "#/statistics"):
        browser.open(tmp_path / "odd.html", fragment)
        browser.press("f")
        browser.until("document.querySelectorAll('#filters select').length")
        if "sample" in fragment:
            browser.until("document.querySelectorAll('#sample details').length === 2")
            browser.value("document.querySelectorAll('#sample details summary').forEach((one) => one.click())")
        assert browser.value("document.title") != "ran"
        assert browser.value("document.querySelectorAll('img[src=x], main script, aside script').length") == 0
        no_trouble(browser)
    assert EVIL in text(browser, "#statistics") and EVIL in text(browser, "#about")
    browser.open(tmp_path / "odd.html", "#/sample/1")
    assert EVIL in text(browser, "#sample .problem")


def test_a_task_from_outside_is_shown_like_any_other(browser: Browser, odd: Dataset[Any], tmp_path: Path) -> None:
    write_page(odd, tmp_path / "odd.html")
    browser.open(tmp_path / "odd.html", "#/sample/0")
    assert loaded(browser, "#sample img") == 5  # two cameras, a chart alone, and a preview over the camera it names
    sizes = browser.value("[...document.querySelectorAll('#sample .stack')].map((s) => s.style.aspectRatio)")
    assert sorted(sizes) == sorted(["160 / 90", "96 / 96", "200 / 40", "96 / 96"])
    browser.open(tmp_path / "odd.html")
    browser.press("3")
    browser.until("!!document.querySelector('.cell .none')")  # the sample whose preview failed has none
    assert loaded(browser, "#cells img") == 1
    no_trouble(browser)


def test_lists_of_numbers_can_be_distinguished(browser: Browser, odd: Dataset[Any], tmp_path: Path) -> None:
    plan = dataclasses.replace(odd.plan, content={"edges_px": [1145.898, 20.12345, 1e-9], "boards": [], "truck": [{}]})
    write_page(dataclasses.replace(odd, plan=plan), tmp_path / "odd.html")
    browser.open(tmp_path / "odd.html", "#/statistics")
    rows = "[...document.querySelectorAll('#statistics [aria-label=content] tr')].map((row) => row.innerText)"
    assert browser.value(rows) == ["edges_px\t1145.9, 20.123, 0", "boards\tnone", "truck\t1 value"]
    no_trouble(browser)


@pytest.fixture
def odd(tmp_path: Path) -> Dataset[Any]:
    """Two of its samples, the second without previews."""
    task: Any = OddTask()
    store_samples(tmp_path / "odd", "semseg", task, {}, 2, alter=evil_record)
    opened = open_dataset(tmp_path / "odd")
    return dataclasses.replace(opened, task=task)


def test_every_control_has_a_name(browser: Browser, page: Path) -> None:
    for fragment in ("", "#/sample/2", "#/map", "#/statistics"):
        browser.open(page, fragment)
        browser.press("f")
        nodes = browser.tree()
        controls = ("button", "link", "slider", "combobox", "searchbox", "checkbox", "region", "dialog", "image")
        named = [(n["role"]["value"], n.get("name", {}).get("value", "")) for n in nodes if not n.get("ignored")]
        assert [role for role, name in named if role in controls and not name.strip()] == []
        assert {"slider", "button", "link", "combobox", "searchbox"} <= {role for role, _ in named}


def test_a_thousand_samples_open_without_decoding_them_all(
    browser: Browser, write_dataset: Any, tmp_path: Path
) -> None:
    source: Dataset[Any] = open_dataset(write_dataset("depth", 8))
    root = tmp_path / "many"
    for index in range(1000):
        sidecar = source.sidecar(index % 8)
        record = dataclasses.replace(sidecar.record, index=index, sequence=index)
        write_whole(
            root, sidecar_path("test", index), sidecar_bytes(dataclasses.replace(sidecar, record=record, files={}))
        )
    write_whole(root, manifest_path("test"), dump_json({"samples": [{}] * 1000, "indexes": {}}))

    few = list(source)

    class Repeating:
        def decode(self, _: Path, sidecar: Sidecar, __: SplitInfo) -> Sample:
            return dataclasses.replace(few[sidecar.record.index % 8], record=sidecar.record)

        def preview(self, sample: Sample) -> Any:
            return source.task.preview(sample)

    many = dataclasses.replace(source, root=root, task=Repeating(), manifest={"samples": [{}] * 1000, "indexes": {}})  # type: ignore[arg-type]
    report = write_page(many, tmp_path / "many.html", max_mb=12.0)
    assert 6e6 < report.size_bytes < 15e6 and report.samples == 1000
    browser.open(tmp_path / "many.html")
    assert len(cells(browser)) == 1000
    loaded(browser, "#cells img[src]")
    assert 0 < browser.value("document.querySelectorAll('#cells img[src]').length") < 400
    browser.value("document.querySelector('#main').scrollTop = 1e7")
    browser.until("document.querySelectorAll('.cell')[999].querySelector('img').naturalWidth")
    browser.until("!document.querySelector('.cell img').src")
    scrolled = browser.value("document.querySelector('#main').scrollTop")
    browser.press("h")
    browser.press("s")
    assert browser.value("document.querySelector('#main').scrollTop") == pytest.approx(scrolled, abs=300)
    browser.press("m")
    assert 0 < browser.value(MAP_SPOTS)[2] < 8 * 13 * 13  # eight places, each a small arrow however far one zooms in
    browser.open(tmp_path / "many.html", "#/sample/999")
    browser.until("document.querySelectorAll('#sample details').length === 2")
    no_trouble(browser)
