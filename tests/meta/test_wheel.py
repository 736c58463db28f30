"""The wheel holds everything: it works from an empty folder, without the checkout."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest


@pytest.mark.slow
def test_the_wheel_is_whole_and_not_too_large(gear_wheel: Path) -> None:
    files = zipfile.ZipFile(gear_wheel).infolist()
    names = {file.filename for file in files}
    assert {
        "gear/py.typed",
        "gear/data/mjcf/towns/town10.xml",
        "gear/data/mjcf/vehicles/truck_box.xml",
        "gear/data/mjcf/surfaces/billboard.xml",
        "gear/data/configs/scenes/town10.yml",
        "gear/data/configs/simulation/default.yml",
        "gear/testing/data/mjcf/towns/tiny.xml",
    } <= names
    assert not [name for name in names if name.startswith(("tests/", "authoring/", "benchmarks/"))]
    assert sum(file.compress_size for file in files if "/data/mjcf/" in file.filename) <= 45e6
    assert gear_wheel.stat().st_size <= 48e6


@pytest.mark.slow
def test_the_wheel_collects_from_an_empty_folder(gear_wheel: Path, tmp_path: Path) -> None:
    zipfile.ZipFile(gear_wheel).extractall(tmp_path / "site")
    empty = tmp_path / "empty"
    empty.mkdir()
    code = (
        f"import sys; sys.path.insert(0, {str(tmp_path / 'site')!r})\n"
        "from gear.cli.main import main; import gear; assert 'site' in gear.__file__\n"
        "sys.exit(main(['collect', '--task', 'depth', '--renderer', 'classic', '--quality', 'fast', '--split', 'debug',"
        " '--samples', '1', '--set', 'options.width_px=320', '--set', 'options.height_px=96']))"
    )
    done = subprocess.run([sys.executable, "-P", "-c", code], cwd=empty, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("data/depth/town10-billboard01-ClearNoon/none: 1 sample in split 'debug'")
    assert len(list(empty.rglob("*.tiff"))) == 1
