"""`gear attack --verify` and what comes after: patches back in the world, and on which samples they may be checked."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import gear
from gear.cli.main import main
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import DatasetError, GearError
from gear.verbs.attack.run import attack
from gear.verbs.collect.run import collect
from tests.verbs.attack.conftest import SMALL
from tests.verbs.conftest import Install, Small, size_settings, verified


def test_the_patch_goes_back_into_the_world(small: Small, install: Install, tmp_path: Path) -> None:
    attack(small(), model="tiny_segmenter", out=tmp_path / "p", steps=2, settings=SMALL)
    collect(
        "semseg", town=TINY_TOWN, scene="board", split="train", samples=2, renderer="classic", quality="fast",
        patch=str(tmp_path / "p"), out=tmp_path / "patched",
        settings=[f"scenes={TINY_SCENES}", *size_settings("semseg")],
    )  # fmt: skip
    assert len(gear.open_twins(small(), tmp_path / "patched")) == 2


def test_the_rendered_check(small: Small, install: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["attack", "--model=tiny_segmenter", f"--data={small()}", "--steps=2", f"--out={tmp_path / 'p'}"]
    words += [*(f"--set={text}" for text in SMALL), f"--verify={small(split='val')}"]
    assert main(words) == 2
    assert "say where its town and scene library lie with --town and --scenes" in capsys.readouterr().err
    words += [f"--town={TINY_TOWN}", f"--scenes={TINY_SCENES}"]
    assert main([*words, "--json"]) == 0
    both = json.loads(capsys.readouterr().out)
    assert both["attack"]["steps_done"] == 2 and both["verify"].keys() == {"tiny_segmenter"}
    assert main(words) == 0
    table = capsys.readouterr().out
    assert "PSNR inside the patch" in table and "rendered / digital" in table
    (written,) = (tmp_path / "p" / "verify").glob("board-val-*/tiny_segmenter/gap.json")
    report = json.loads(written.read_text())
    assert report["median_psnr_db"]["transport"] > 35 > report["median_psnr_db"]["homography"]
    assert (tmp_path / "p" / "patch_0.png").exists(), "the check leaves the patch folder as it was"
    other = verified(
        tmp_path / "p", small(split="val", seed=5), models=["tiny_segmenter"], defense="median", samples=1,
        town=TINY_TOWN, scenes=f"{TINY_SCENES}:board",
    )["tiny_segmenter"]  # fmt: skip
    assert len(list((tmp_path / "p" / "verify").glob("board-val-*"))) == 2, "every dataset has a check of its own"
    assert other.defense == "median" and "tiny_segmenter behind median" in other.table()
    assert json.loads(written.read_text()) == report
    both = verified(
        tmp_path / "p", small(split="val", seed=6), models=["tiny_segmenter", "other_segmenter"], samples=1,
        town=TINY_TOWN, scenes=f"{TINY_SCENES}:board",
    )  # fmt: skip
    assert both["other_segmenter"].twin == both["tiny_segmenter"].twin, "rendered once for all of them"


def test_checks_want_other_samples_than_patches_are_made_on(
    small: Small, install: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = small()
    with pytest.raises(GearError, match="--data and --val hold the same samples"):
        attack(data, model="tiny_segmenter", val=data, out=tmp_path / "x", steps=1, settings=SMALL)
    words = ["attack", "--model=tiny_segmenter", f"--data={data}", "--steps=1", f"--out={tmp_path / 'x'}"]
    assert main([*words, f"--verify={data}"]) == 2
    assert "no patch may be made on what --verify names" in capsys.readouterr().err
    assert main([*words, f"--verify={tmp_path / 'nowhere'}"]) == 2
    assert main([*words, f"--town={TINY_TOWN}"]) == 2
    (tmp_path / "several").mkdir()
    (tmp_path / "several/one").symlink_to(data)
    words[2] = f"--data={tmp_path / 'several'}"
    assert main([*words, f"--verify={data}"]) == 2, "a folder of datasets is looked into"
    assert "give it another split than --data" in capsys.readouterr().err
    assert not (tmp_path / "x").exists(), "all of it is said before anything is made"
    attack(data, model="tiny_segmenter", out=tmp_path / "x", steps=1, settings=SMALL)
    with pytest.raises(DatasetError, match="was made on; verify it on other samples"):
        verified(tmp_path / "x", data, models=["tiny_segmenter"], town=TINY_TOWN, scenes=TINY_SCENES)


def test_patches_are_not_checked_on_what_chose_them(
    small: Small, install: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The best of many on some samples does better there than elsewhere."""
    val = small(split="val")
    words = ["attack", "--model=tiny_segmenter", f"--data={small()}", f"--val={val}", f"--out={tmp_path / 'x'}"]
    assert main([*words, f"--verify={val}", f"--town={TINY_TOWN}", f"--scenes={TINY_SCENES}"]) == 2
    assert "no patch may be made on what --verify names; give it another split than --val" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()
    attack(small(), model="tiny_segmenter", val=val, out=tmp_path / "x", steps=1, settings=SMALL)
    with pytest.raises(DatasetError, match="was made on; verify it on other samples"):
        verified(tmp_path / "x", val, models=["tiny_segmenter"], town=TINY_TOWN, scenes=TINY_SCENES)


def test_the_same_scenes_are_no_others_however_they_are_rendered(
    small: Small, install: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plain, probed = small(probes=False), small()
    with pytest.raises(GearError, match="--data and --val hold the same samples"):
        attack(plain, model="tiny_segmenter", val=probed, out=tmp_path / "x", steps=1, compositor="homography")
    words = [
        "attack",
        "--model=tiny_segmenter",
        f"--data={plain}",
        "--compositor=homography",
        f"--out={tmp_path / 'x'}",
    ]
    assert main([*words, f"--verify={probed}"]) == 2
    assert "no patch may be made on what --verify names" in capsys.readouterr().err
    assert main([*words, f"--verify={small(split='val', probes=False)}"]) == 2
    assert "has no probes, which --verify needs" in capsys.readouterr().err
    assert main([*words, f"--verify={small(scene='double', split='val')}"]) == 2
    assert "has patch surfaces 2" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()
