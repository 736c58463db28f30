"""Folders of strangers: with a link in any place of an output folder, no command changes a file elsewhere."""

from __future__ import annotations

import argparse
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from gear.cli.main import full_parser, main
from gear.testing.tiny_networks import tiny_depth, tiny_segmenter
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from tests.dataset.splits import tree
from tests.verbs.bench.conftest import FEW, write
from tests.verbs.conftest import put_package

PICTURES = ["--set", f"scenes={TINY_SCENES}", "--set", "options.width_px=128", "--set", "options.height_px=64"]

VERBS = ["collect", "evaluate", "attack", "train", "defend", "gap", "bench", "export", "merge", "leaderboard", "drive"]

SINGLE_FILES = {"sheet", "towns", "view"}
"""Commands that write one or two files beside others, each by `write_alone`, and delete nothing."""

NEW_FOLDERS = {"import", "new"}
"""Commands that refuse a folder with files in it (`gear.dataset.whole_tree` and tests/verbs/scaffold/test_write.py)."""

NOTHING = {"show-config"}
"""Commands that write nothing."""

DRIVES = f"""
drivers: {{truth: {{controller: truth}}}}
towns: {{"{TINY_TOWN}": [board]}}
scenarios: {{free_road: [30]}}
collect: {{quality: fast, scenes: "{TINY_SCENES}"}}
"""

FORCES = {"collect", "attack"}

UNUSED = ["gear", "gear/scratch", "gear/debug/begun"]
"""Places that a finished folder need not have, and that commands use meanwhile; the last one only by `COLLECTING`."""

COLLECTING = {"collect", "evaluate", "attack", "train", "defend", "gap", "bench", "export"}


def collect(out: Path, *more: str) -> list[str]:
    where = ["--town", str(TINY_TOWN), "--scene", "board", "--renderer", "classic", "--quality", "fast"]
    return ["collect", "--task", "semseg", *where, "--out", str(out), *PICTURES, *(more or ("--split", "debug"))]


def arguments(verb: str, home: Path, out: Path) -> list[str]:
    """The command that made the output folder of a verb."""
    data, small = str(home / "data"), ["--set", "height_px=12", "--set", "width_px=24"]
    town = ["--town", str(TINY_TOWN), "--scenes", str(TINY_SCENES)]
    commands = {
        "collect": collect(out, "--split", "debug", "--samples", "1", "--patch", "random", "--probes"),
        "evaluate": ["evaluate", "--model", "tiny_segmenter", "--data", f"{data}:debug"],
        "attack": ["attack", "--model", "tiny_segmenter", "--data", f"{data}:train", "--steps", "1", *small],
        "train": ["train", "--task", "semseg", "--model", "tiny_segmenter", "--data", f"{data}:train", "--epochs", "1"],
        "defend": ["defend", data, "--split", "debug", "--defense", "jpeg"],
        "gap": ["gap", data, "--samples", "1", "--split", "debug", "--patch", "random", *town],
        "bench": ["bench", str(home / "bench.yml")],
        "export": ["export", str(home / "stereo"), "--layout", "kitti"],
        "merge": ["merge", str(home / "first"), str(home / "second")],
        "leaderboard": ["leaderboard", "build", str(home / "records")],
        "drive": ["drive", str(home / "drive.yml")],
    }
    return [*commands[verb], "--out", str(out / "tree" if verb == "export" else out)]


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with data, and the finished output folder of every verb."""
    folder = tmp_path_factory.mktemp("links")
    with pytest.MonkeyPatch.context() as patched:
        put_package(patched, [tiny_segmenter, tiny_depth])
        assert main(collect(folder / "data", "--split", "debug", "--samples", "2", "--probes")) == 0
        assert main(collect(folder / "data", "--split", "train", "--samples", "4", "--probes")) == 0
        yield folder


@pytest.fixture(scope="module")
def finished(home: Path) -> Callable[[str], Path]:
    def made(verb: str) -> Path:
        out = home / verb
        if not out.exists():
            if verb == "bench":
                write(home, (*FEW, ("{width_px: 256, height_px: 128}", "{width_px: 128, height_px: 64}")))
            if verb == "merge":
                for number, part in enumerate(("first", "second"), 1):
                    assert main([*collect(home / part, "--samples", "2"), "--shard", f"{number}/2"]) == 0
            if verb == "drive":
                (home / "drive.yml").write_text(DRIVES)
            if verb == "leaderboard":
                (home / "records").mkdir()
            if verb == "export":  # an export that was killed, in the hidden folder beside its place
                stereo = [word.replace("semseg", "stereo3d") for word in collect(home / "stereo")]
                assert main([*stereo, "--samples", "1"]) == 0
                assert main(arguments(verb, home, out)) == 0
                (out / "tree").rename(out / ".tree.gear-export")
            else:
                assert main(arguments(verb, home, out)) == 0
        return out

    return made


def has_out(parser: argparse.ArgumentParser) -> bool:
    """Whether a command, or one of its own commands, has the flag `--out`."""
    inner = [
        one
        for action in parser._actions
        if isinstance(action, argparse._SubParsersAction)
        for one in action.choices.values()
    ]
    return "--out" in parser._option_string_actions or any(has_out(one) for one in inner)


def test_every_command_with_an_output_folder_is_tested() -> None:
    (commands,) = (one for one in full_parser()._actions if isinstance(one, argparse._SubParsersAction))
    with_out = {name for name, parser in commands.choices.items() if has_out(parser)}
    assert with_out == {*VERBS, *SINGLE_FILES, *NEW_FOLDERS, *NOTHING}


@pytest.mark.parametrize(
    ("verb", "force"),
    [
        pytest.param(verb, force, marks=[pytest.mark.slow] * (verb == "bench"))
        for verb in VERBS
        for force in (False, True)
        if verb in FORCES or not force
    ],
)
def test_links_in_an_output_folder_lead_to_no_deleted_file(
    verb: str,
    force: bool,
    home: Path,
    finished: Callable[[str], Path],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    whole = finished(verb)
    command = arguments(verb, home, tmp_path / "out") + ["--force"] * force + ["--seed", "9"] * force
    places = [path.relative_to(whole).as_posix() for path in sorted(whole.rglob("*"))]
    if verb == "bench":  # of the datasets and evaluations in it one each
        places = [place for place in places if len(Path(place).parts) < 3 or "none/" in f"{place}/"][:30]
    top = ".tree.gear-export" if verb == "export" else ""
    unused_places = UNUSED if verb in COLLECTING else UNUSED[:-1]
    for place in [*places, *(f"{top}/{unused}".strip("/") for unused in unused_places)]:
        out, victim = tmp_path / "out", tmp_path / "victim"
        shutil.copytree(whole, out)
        linked = out / place
        if linked.is_dir():
            shutil.move(linked, victim)
        else:
            victim.mkdir()
            (shutil.move if linked.exists() else shutil.copy)(linked if linked.exists() else __file__, victim / "file")
        (victim / "000009.json").write_text('{"files": {}}')
        linked.parent.mkdir(parents=True, exist_ok=True)
        linked.symlink_to(victim / "file" if (victim / "file").exists() and linked.suffix else victim)
        before = tree(victim), tree(out)
        capfd.readouterr()
        code, said = main(command), capfd.readouterr().err
        assert (code, said.count("\n")) == (2, 1), (place, said)
        wanted = (
            "is not empty; merge" if verb == "merge" else "is a link; gear writes and deletes nothing through links"
        )
        assert wanted in said, place
        assert (tree(victim), tree(out)) == before, place
        for folder in (out, victim):
            shutil.rmtree(folder)
