from __future__ import annotations

import importlib
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import torch

from gear.networks import shipped
from gear.networks.weights import write
from gear.values.errors import GearError

WEIGHTS = Path(__file__).parents[2] / "weights"


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A weights distribution on the path, with its metadata, as an installer leaves it; gives its folder."""
    site, package = tmp_path / "site", tmp_path / "site" / "my_weights"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("from pathlib import Path\nFOLDER = Path(__file__).parent\n")
    info = site / "my_weights-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-weights\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[gear.weights]\nmine = my_weights\n")
    monkeypatch.syspath_prepend(str(site))
    importlib.invalidate_caches()
    shipped.shipped_folders.cache_clear()
    yield package
    shipped.shipped_folders.cache_clear()
    sys.modules.pop("my_weights", None)


def test_an_installed_package_is_found_by_its_entry_point(install: Path) -> None:
    assert shipped.shipped_folders()[0] == install
    assert shipped.shipped("my_net") is None
    write(install / "models" / "my_net.safetensors", {"a": torch.zeros(2)}, {})
    assert shipped.shipped("my_net") == install / "models" / "my_net.safetensors"
    assert shipped.resolve("shipped", "my_net") == shipped.shipped("my_net")


def test_a_broken_package_is_named(install: Path) -> None:
    (install / "__init__.py").write_text("import a_module_that_is_not_there\n")
    with pytest.raises(GearError, match=r"my-weights is broken .*a_module_that_is_not_there"):
        shipped.shipped_folders()


def test_the_checkouts_own_package_is_what_its_project_says(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(WEIGHTS))
    module = importlib.import_module("gear_weights")
    assert module.FOLDER == shipped.CHECKOUT
    project = (WEIGHTS / "pyproject.toml").read_text()
    assert 'entry-points."gear.weights"' in project and '= "gear_weights"' in project
    assert (module.FOLDER / "models").is_dir() and (module.FOLDER / "patches").is_dir()


@pytest.mark.slow
def test_the_wheel_of_the_weights_is_found_once_installed(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", str(WEIGHTS), "-w", str(tmp_path)]
    subprocess.run(build, check=True, capture_output=True)
    wheel = next(tmp_path.glob("mujoco_gear_weights-*.whl"))
    assert wheel.stat().st_size <= 90e6
    site = tmp_path / "site"
    subprocess.run(
        [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", str(site), str(wheel)],
        check=True,
        capture_output=True,
    )
    code = "import gear.networks.shipped as s; print(s.shipped_folders()[0])"
    found = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(site)!r}); {code}"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()
    assert Path(found) == site / "gear_weights"


def test_what_weights_mean(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shipped, "shipped_folders", lambda: (tmp_path,))
    assert shipped.resolve("none", "net") is None
    assert shipped.resolve("some/file.safetensors", "net") == Path("some/file.safetensors")
    with pytest.raises(GearError, match="net has no weights here: install mujoco-gear-weights, or say weights="):
        shipped.resolve("shipped", "net")
    write(tmp_path / "models" / "other.safetensors", {"a": torch.zeros(2)}, {})
    with pytest.raises(GearError, match="net has no weights here: those installed are of other; say weights="):
        shipped.resolve("shipped", "net")


def test_a_header_is_read_without_torch(tmp_path: Path) -> None:
    path = tmp_path / "a.safetensors"
    metadata = {"options": json.dumps({"input_scale": 0.5}), "metrics": "not JSON", "seed": "3"}
    write(path, {"a": torch.zeros(2, 3), "b": torch.zeros(4, dtype=torch.bfloat16)}, metadata)
    file = shipped.inspect(path)
    assert file.shapes == {"a": (2, 3), "b": (4,)}
    assert file.numbers == 10
    assert file.facts() == {"options": {"input_scale": 0.5}, "metrics": "not JSON", "seed": "3"}
    assert file.option("input_scale") == 0.5 and file.option("other") is None
    assert shipped.trained_option(str(path), "net", "input_scale") == 0.5
    assert shipped.trained_option("none", "net", "input_scale") is None
    code = f"import sys, gear.networks.shipped as s; s.inspect({str(path)!r}); sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize(("content", "problem"), [(None, "no such weights file"), (b"hello", "not a safetensors file")])
def test_a_file_that_is_none_is_refused(tmp_path: Path, content: bytes | None, problem: str) -> None:
    path = tmp_path / "x.safetensors"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(GearError, match=problem):
        shipped.inspect(path)


@pytest.mark.parametrize("text", ['{"miou": NaN}', '{"miou": 1e999}', r'{"miou": "\udc80"}', "[" * 100_000])
def test_metadata_that_are_no_json_stay_texts(tmp_path: Path, text: str) -> None:
    """`gear weights show --json` and `gear models --json` print JSON whatever a file says of itself."""
    path = tmp_path / "a.safetensors"
    write(path, {"a": torch.zeros(1)}, {"metrics": text})
    assert shipped.inspect(path).facts()["metrics"] == text
