"""The example packages, from wheels, in one fresh environment, run from an empty folder as a user would.

That gear and the examples declare what they import, deptry checks.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from gear.config.nodes import parse_file
from gear.config.reader import read_node
from gear.verbs.bench.config import BenchConfig
from tests.shared import call, make_environment, once

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted(path.parent for path in (ROOT / "examples").glob("gear-*/pyproject.toml"))
TOWN = ("--town", str(ROOT / "gear/testing/data/mjcf/towns/tiny.xml"), "--scene", "board")
SCENES = f"scenes={ROOT / 'gear/testing/data/scenes/tiny.yml'}"

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory, builder: Path, gear_wheel: Path) -> Path:
    """An environment with gear and all examples from wheels, which all of a run's processes share."""
    return once(tmp_path_factory, "examples", lambda folder: install(folder, builder, gear_wheel)) / "env"


def install(folder: Path, builder: Path, gear_wheel: Path) -> None:
    env, wheels = folder / "env", folder / "wheels"
    wheel = (builder / "bin/python", "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", wheels)
    call(*wheel, *EXAMPLES, cwd=folder)
    make_environment(env)
    pip = (env / "bin/python", "-m", "pip", "install", "-q", "-c", ROOT / "constraints.txt")
    packages = [gear_wheel, *sorted(wheels.glob("*.whl"))]
    # gear of the tests' environment is not to stand in for the wheel.
    call(*pip, "--no-deps", "--ignore-installed", *packages, cwd=wheels)
    call(*pip, *packages, "pytest", "cityscapesScripts", cwd=wheels)


@pytest.fixture(scope="module")
def home(environment: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with that environment and an empty folder in it."""
    home = tmp_path_factory.mktemp("home")
    (home / "env").symlink_to(environment)
    (home / "empty").mkdir()
    return home


def gear(home: Path, *words: str) -> str:
    return call(home / "env/bin/gear", *words, cwd=home / "empty")


def test_all_are_found_and_the_broken_ones_are_named(home: Path) -> None:
    facts = json.loads(gear(home, "plugins", "--json"))
    names = {(p["kind"], p["name"], p["package"]) for p in facts["plugins"]}
    assert {
        ("defense", "jpeg_tv", "gear-defense-jpeg-tv"),
        ("defense", "local_entropy", "gear-defense-local-entropy"),
        ("task", "panoptic", "gear-task-panoptic"),
        ("model", "transformers_semseg", "gear-model-transformers"),
        ("model", "transformers_depth", "gear-model-transformers"),
        ("model", "transformers_detect2d", "gear-model-transformers"),
        ("attack", "art", "gear-attack-art"),
        ("metric", "boundary_iou", "gear-metric-boundary-iou"),
        ("task", "semseg", "mujoco-gear"),
    } <= names
    assert {b["package"] for b in facts["broken"]} == {"gear-broken"}
    assert {b["plugin"]: b["stage"] for b in facts["broken"]} == {
        "broken-import": "import",
        "broken-missing": "import",
        "broken-exit": "import",
        "broken-misspelt": "register",
        "broken-hook": "hook gear_defenses",
        "broken-rubbish": "spec",
        "broken-protocol": "spec",
        "broken-end": "import",
        "broken-interrupt": "import",
        "broken-endless": "hook gear_defenses",
        "broken-mute": "import",
    }
    assert facts["clashes"] == [
        {"kind": "defense", "name": "median", "choices": ["gear-broken/median", "mujoco-gear/median"]}
    ]


def test_a_foreign_task_gets_everything(home: Path) -> None:
    size = ("--set", "options.width_px=256", "--set", "options.height_px=128", "--set", SCENES)
    common = ("--split", "debug", "--samples", "2", "--renderer", "classic", "--quality", "fast")
    out = gear(home, "collect", "--task", "panoptic", *TOWN, *common, *size, "--patch", "random", "--out", "data")
    assert out == "data: 2 samples in split 'debug'\n"
    data = home / "empty/data"
    table = json.loads((data / "annotations/panoptic_debug.json").read_text())
    assert len(table["annotations"]) == 2 and all(a["segments_info"] for a in table["annotations"])
    gear(home, "sheet", "data", "--out", "sheet.png")
    gear(home, "view", "data", "--out", "view.html")
    assert cv2.imread(str(home / "empty/sheet.png")).std() > 20
    gear(home, "defend", "data", "--defense", "jpeg_tv", "--out", "jpeg_tv")
    eager = ("--set", "patch_mean=[3.5, 4.0, 4.3]")  # a small rendered board is calmer than the paper's photographs
    gear(home, "defend", "data", "--defense", "local_entropy", *eager, "--out", "local_entropy")
    folder = home / "empty/local_entropy/defense/debug"
    scores = json.loads((folder / "scores.json").read_text())["scores"]
    for index in range(2):
        name = f"images/debug/{index:06d}.png"
        roots = (data, home / "empty/jpeg_tv", home / "empty/local_entropy")
        before, smooth, filled = (cv2.imread(str(root / name)) for root in roots)
        assert smooth.shape == before.shape and (smooth != before).mean() > 0.2
        mask = cv2.imread(str(folder / f"masks/{index:06d}_left.png"), cv2.IMREAD_UNCHANGED) > 0
        assert 0 < mask.mean() < 1 and mask.mean() == pytest.approx(scores[index], abs=1e-4)
        assert np.array_equal(filled[~mask], before[~mask]) and not np.array_equal(filled[mask], before[mask])


def test_foreign_models_defenses_and_tasks_have_their_rows(home: Path) -> None:
    """Twins, a network, a third party's defenses; then a third party's task with its model and a defense."""
    size = ("--set", "options.width_px=256", "--set", "options.height_px=128", "--set", SCENES)
    common = (*TOWN, "--split", "debug", "--samples", "2", "--renderer", "classic", "--quality", "fast", *size)
    for task, patch in (("semseg", "none"), ("semseg", "random"), ("panoptic", "random")):
        gear(home, "collect", "--task", task, *common, "--patch", patch, "--out", f"rows/{task}-{patch}")
    network = ("--model", "ddrnet23_slim", "--set", "weights=none", "--data", "rows/semseg-none", "rows/semseg-random")
    found = {}
    for defense in (None, "jpeg_tv", "local_entropy"):
        guard = ("--defense", defense) if defense else ()
        words = (*network, *guard, "--report", "boundary_iou", "--json")
        found[defense] = json.loads(gear(home, "evaluate", *words))
        assert "boundary_miou" in found[defense]["rows"][0]["metrics"]["boundary_iou"]
        assert [row["samples"] for row in found[defense]["rows"]] == [2, 2]
        assert (home / f"empty/evaluations/semseg/ddrnet23_slim{'+' if defense else ''}{defense or ''}").is_dir()
    cost = {name: one["rows"][1]["cost"]["defense_s"] for name, one in found.items()}
    assert cost[None] == 0 and cost["jpeg_tv"] > 0 and cost["local_entropy"] > 0
    assert {one["model"]["weights_sha256"] for one in found.values()} == {found[None]["model"]["weights_sha256"]}
    assert found["local_entropy"]["differences"][0]["auroc"] is not None
    baseline = ("--model", "panoptic_parts", "--set", "weights=none", "--data", "rows/panoptic-random")
    text = gear(
        home, "evaluate", *baseline, "--defense", "local_entropy", "--report", "outside_patch", "--out", "panoptic"
    )
    assert text.startswith("panoptic: panoptic_parts guarded by local_entropy\n") and "outside_patch.pq" in text
    (folder,) = (path.parent for path in (home / "empty/panoptic").glob("*/predictions"))
    results = json.loads((folder / "predictions/panoptic.json").read_text())["annotations"]
    assert [one["image_id"] for one in results] == [1, 2]
    assert all((folder / "predictions/panoptic" / one["file_name"]).is_file() for one in results)


NETWORKS = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import tiny_folders
for name in sys.argv[2:]:
    getattr(tiny_folders, name)(Path("networks") / name)
"""
ROWS = [
    ("semseg", "mask2former", (), "miou"),
    ("depth", "depth_anything", ("--set", "inverse_scale=0.5", "--set", "inverse_shift=0.02"), "abs_rel"),
    ("detect2d", "detr", (), "ap"),
]


def test_networks_from_a_folder_have_a_row_in_each_task(home: Path) -> None:
    """Tiny networks that transformers itself has written, behind a third party's adapter."""
    tiny = ROOT / "examples/gear-model-transformers/tests"
    names = [name for _, name, _, _ in ROWS]
    call(home / "env/bin/python", "-c", NETWORKS, tiny, *names, cwd=home / "empty")
    size = ("--set", "options.width_px=256", "--set", "options.height_px=128", "--set", SCENES)
    common = (*TOWN, "--split", "debug", "--samples", "2", "--renderer", "classic", "--quality", "fast", *size)
    for task, name, options, metric in ROWS:
        data = f"folders/{task}"
        gear(home, "collect", "--task", task, *common, "--patch", "random", "--out", data)
        words = ("--model", f"transformers_{task}", "--set", f"folder=networks/{name}", *options, "--data", data)
        found = json.loads(gear(home, "evaluate", *words, "--json"))
        assert found["model"]["name"] == f"transformers_{task}"
        (row,) = found["rows"]
        assert row["samples"] == 2 and metric in row["metrics"]["task"]
        if task != "detect2d":  # two small pictures may hold nothing to detect, and then there is no precision
            assert row["metrics"]["task"][metric]["value"] is not None


def test_a_foreign_attack_makes_a_patch_that_goes_back_into_the_world(home: Path) -> None:
    """Another toolbox's attack through gear's compositor, against a network, and its patch collected."""
    size = ("--set", "options.width_px=256", "--set", "options.height_px=128", "--set", SCENES)
    common = (*TOWN, "--split", "debug", "--samples", "2", "--renderer", "classic", "--quality", "fast", *size)
    gear(home, "collect", "--task", "semseg", *common, "--probes", "--out", "attacked/data")
    options = ("--set", "height_px=16", "--set", "width_px=32", "--model-set", "weights=none", "--steps", "2")
    words = ("--attack", "art", "--model", "ddrnet23_slim", *options, "--data", "attacked/data")
    notes = json.loads(gear(home, "attack", *words, "--out", "attacked/patches", "--json"))
    assert notes["attack"]["package"] == "gear-attack-art" and notes["compositor"] == "transport"
    assert (home / "empty/attacked/patches/patch_0.png").is_file()
    gear(home, "collect", "--task", "semseg", *common, "--patch", "attacked/patches", "--out", "attacked/patched")
    table = gear(home, "gap", "attacked/data", "--twin", "attacked/patched")
    assert "PSNR inside the patch" in table


TESTED = [path for path in EXAMPLES if path.name != "gear-broken"]


@pytest.mark.parametrize("example", TESTED, ids=lambda path: path.name)
def test_each_passes_its_own_tests(home: Path, example: Path) -> None:
    config = ("-p", "no:cacheprovider", "-c", str(example / "pyproject.toml"), str(example / "tests"))
    call(home / "env/bin/python", "-m", "pytest", "-q", *config, cwd=home / "empty")


MODULES = "mujoco-gear=gear,adversarial-robustness-toolbox=art,pillow=PIL"


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)
def test_each_declares_what_it_imports(example: Path) -> None:
    """Beside what gear itself needs, which is installed wherever gear is."""
    own = [path.name for path in (example / "src").iterdir() if path.is_dir()]
    call(sys.executable, "-m", "deptry", "src", *(word for name in own for word in ("--known-first-party", name)),
         "--package-module-name-map", MODULES, "--ignore", "DEP002", "--per-rule-ignores", "DEP003=numpy|torch|cv2",
         cwd=example)  # fmt: skip


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)
def test_each_is_typed_against_gears_published_types(
    home: Path, example: Path, tmp_path: Path, mypy_cache: Path
) -> None:
    call(sys.executable, "-m", "mypy", "--strict", "--python-executable", home / "env/bin/python", "--cache-dir",
         mypy_cache, "--config-file", example / "pyproject.toml", example / "src", cwd=tmp_path)  # fmt: skip
    call(sys.executable, "-m", "ruff", "check", "--no-cache", example, cwd=tmp_path)


def test_the_wheel_can_write_new_packages(home: Path) -> None:
    for kind in ("task", "model", "attack", "defense", "metric"):
        assert gear(home, "new", kind, "my_thing").startswith(f"gear-{kind}-my-thing: ")
        assert (home / f"empty/gear-{kind}-my-thing/src/gear_{kind}_my_thing/my_thing.py").is_file()


BENCH = """
tasks:
  depth:
    models: {net: {plugin: ddrnet23_slim_depth, set: {weights: none}}}
    defenses: {jpeg_tv: {}}
places: {TOWN: ["SCENES:board"]}
samples: {attack: 1, choose: 1, measure: 2}
attack: {steps: 1}
adaptive: true
collect: {renderer: classic, quality: fast, options: {width_px: 256, height_px: 128}}
"""


def test_a_wheel_of_a_defense_gets_a_row_with_two_commands(home: Path) -> None:
    text = BENCH.replace("TOWN", TOWN[1]).replace("SCENES", SCENES.partition("=")[2])
    (home / "empty/row.yml").write_text(text)
    gear(home, "bench", "row.yml", "--out", "row", "--record")
    assert "2 rows, " in gear(home, "leaderboard", "build", "row/records", "--out", "site")
    record = json.loads((home / "empty/row/records/depth-net+jpeg_tv-seed0.json").read_text())
    package = record["entry"]["defense"]
    assert package["package"] == "gear-defense-jpeg-tv" and package["wheel_sha256"] and record["entry"]["licence"]
    board = json.loads((home / "empty/site/board.json").read_text())
    assert {row["defense"] for row in board["tables"][0]["rows"]} == {"-", "jpeg_tv (gear-defense-jpeg-tv 0.1.0)"}


def test_shipped_benches_of_examples_can_be_read() -> None:
    paths = sorted((ROOT / "examples").glob("*/bench.yml"))
    assert paths
    for path in paths:
        assert read_node(BenchConfig, parse_file(path)).adaptive, "a row needs an adaptive attack"
