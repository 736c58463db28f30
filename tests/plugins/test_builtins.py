from __future__ import annotations

from pathlib import Path

import pytest

import gear.plugins
from gear.plugins.builtins import BUILTINS
from gear.plugins.manager import discover

ROOT = Path(gear.plugins.__file__).parent


@pytest.mark.parametrize("kind", ["tasks", "models"])
def test_every_module_with_a_hook_is_listed(kind: str) -> None:
    files = sorted(path for path in (ROOT / kind).glob("*.py") if "\n@hookimpl\n" in path.read_text())
    assert [f"gear.plugins.{kind}.{path.stem}" for path in files] == sorted(
        name for name in BUILTINS if name.startswith(f"gear.plugins.{kind}.")
    )


def test_every_listed_module_brings_a_plugin() -> None:
    owners = {entry.owner.plugin for entry in discover([]).found}
    assert owners == set(BUILTINS) and len(BUILTINS) == len(set(BUILTINS))
