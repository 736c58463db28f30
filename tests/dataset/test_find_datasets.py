"""A folder of datasets is no dataset: the error names those inside, whatever command asks."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.cli.main import main
from gear.dataset.find_datasets import LISTED, no_dataset, roots_of


def folder_of(root: Path, count: int) -> Path:
    for number in range(count):
        plan = root / f"scene/{number}/gear/test/plan.json"
        plan.parent.mkdir(parents=True)
        plan.write_text("{}")
    return root


def test_the_datasets_inside_are_named(tmp_path: Path) -> None:
    folder_of(tmp_path, LISTED + 2)
    assert len(roots_of(tmp_path)) == LISTED + 2 and roots_of(tmp_path / "scene/3") == [tmp_path / "scene/3"]
    said = str(no_dataset(tmp_path))
    assert "is a folder of 7 datasets; give one of them: " in said and said.endswith("scene/4, …")
    assert "is not a dataset of gear's" in str(no_dataset(tmp_path / "nothing"))


@pytest.mark.parametrize(
    "words",
    [
        ["verify"],
        ["sheet"],
        ["gap", "--twin", "x"],
        ["export", "--layout", "coco", "--out", "new"],
        ["defend", "--defense", "jpeg", "--out", "new"],
        ["merge", "--out", "new"],
    ],
)
def test_every_command_names_them(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder_of(tmp_path, 2))
    assert main([words[0], "scene", *words[1:]]) == 2
    said = capsys.readouterr().err
    assert said == "gear: scene: is a folder of 2 datasets; give one of them: scene/0, scene/1\n"
