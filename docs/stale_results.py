"""Marks which numbers of `docs/results` are current: `python docs/stale_results.py`.

Each section of results names the inputs that its numbers depend on, with a digest of each: `towns` (everything in
`mjcf`), `models` and `patches` (the shipped files). A section whose digests are not those of the files in this checkout
is stale: its numbers describe an earlier state, and have to be measured again before they are compared with new ones.
The script writes the line *State* of each section, and the tables of current and of earlier sections on the index page
of the results. A test fails if they are out of date.

`python docs/stale_results.py digests [COMMIT]` prints the digests of this checkout, or of a commit, for a new section.
"""

from __future__ import annotations

import functools
import hashlib
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from gear.world.assets.asset_hash import without_key_points

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "docs" / "results"
INDEX = RESULTS / "index.md"

INPUTS = {
    "towns": "mjcf",
    "models": "weights/gear_weights/models",
    "patches": "weights/gear_weights/patches",
}
"""Folders by the name of the input."""

IGNORED = {".md", ".pyc"}
"""Files on which no number depends."""

UNSEEN = "dynamics/"
"""Folder of `mjcf` that no picture shows: the physics of the ego car."""

BEGIN, END = "<!-- states: written by docs/stale_results.py -->", "<!-- end of states -->"
LINE = re.compile(r"^- \*\*Inputs:\*\* (.*)$", re.MULTILINE)
STATE = re.compile(r"^- \*\*State:\*\* .*\n", re.MULTILINE)
DIGEST = re.compile(r"(\w+) `([0-9a-f]{8})`")


def digest(folder: Path) -> str:
    """Eight hexadecimal digits of all files below a folder, by their names and git's hashes of their content."""
    entries = []
    for path in folder.rglob("*"):
        is_unseen = path.relative_to(folder).as_posix().startswith(UNSEEN)
        if path.is_file() and path.suffix not in IGNORED and not is_unseen:
            entries.append((path.relative_to(folder).as_posix(), _blob(path.suffix, path.read_bytes())))
    return _digest_of(entries)


def _blob(suffix: str, content: bytes) -> str:
    """Git's hash of a file's content; MJCF counts without key points."""
    data = without_key_points(content) if suffix == ".xml" else content
    return hashlib.sha1(b"blob %d\0" % len(data) + data, usedforsecurity=False).hexdigest()


def digest_at(commit: str, folder: str) -> str:
    """The same digest for a folder of a commit."""
    listed = subprocess.run(
        ["git", "-c", "core.quotePath=false", "ls-tree", "-r", commit, f"{folder}/"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    lines = [line.split("\t") for line in listed.splitlines() if Path(line).suffix not in IGNORED]
    entries = [(path.removeprefix(f"{folder}/"), _blob_at(facts.split()[2], path)) for facts, path in lines]
    return _digest_of([entry for entry in entries if not entry[0].startswith(UNSEEN)])


def _blob_at(blob: str, path: str) -> str:
    """The hash of `_blob` of a file in git's history.

    Args:
        blob: git's hash of its content.
        path: its path.
    """
    if not path.endswith(".xml"):
        return blob
    content = subprocess.run(["git", "cat-file", "blob", blob], cwd=ROOT, capture_output=True, check=True).stdout
    return _blob(".xml", content)


@functools.cache
def current() -> dict[str, str]:
    """Digests of this checkout by input."""
    return {name: digest(ROOT / folder) for name, folder in INPUTS.items()}


def sections() -> Iterator[tuple[Path, str, dict[str, str]]]:
    """Page, heading and digests of every section of results.

    Raises:
        ValueError: a section does not name its inputs.
    """
    for page in sorted(RESULTS.glob("*.md")):
        if page == INDEX:
            continue
        for section in re.split(r"^## ", page.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]:
            heading, found = section.splitlines()[0], LINE.search(section)
            if found is None:
                raise ValueError(f"{page.name}: {heading}: no line '- **Inputs:** ...'")
            inputs = dict(DIGEST.findall(found[1]))
            if (not inputs and found[1] != "none") or inputs.keys() - INPUTS.keys():
                raise ValueError(f"{page.name}: {heading}: cannot read the inputs {found[1]!r}")
            yield page, heading, inputs


def changed(inputs: dict[str, str]) -> list[str]:
    """The inputs of a section that are not those of this checkout."""
    now = current()
    return [name for name, value in inputs.items() if value != now[name]]


def marked(page: Path) -> str:
    """The text of a page of results with the line *State* of each section."""
    start, *rest = re.split(r"^(?=## )", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    found = [inputs for path, _, inputs in sections() if path == page]
    return start + "".join(_with_state(section, inputs) for section, inputs in zip(rest, found, strict=True))


def _with_state(section: str, inputs: dict[str, str]) -> str:
    other = changed(inputs)
    state = f"**earlier**; these inputs have changed since: {', '.join(other)}" if other else "current"
    return LINE.sub(lambda line: f"{line[0]}\n- **State:** {state}", STATE.sub("", section))


def index() -> str:
    """The index page with the tables of current and of earlier sections."""
    current_rows, earlier_rows = [], []
    for page, heading, inputs in sections():
        row = f"| [{page.stem}]({page.name}) | {heading} |"
        other = changed(inputs)
        if other:
            earlier_rows.append(f"{row} {', '.join(other)} |")
        else:
            current_rows.append(row)
    tables = [
        "", "### Current", "", "| page | section |", "|---|---|", *current_rows,
        "", "### Earlier", "", "| page | section | inputs that changed since |", "|---|---|---|", *earlier_rows, "",
    ]  # fmt: skip
    before, _, rest = INDEX.read_text(encoding="utf-8").partition(BEGIN)
    return "\n".join([before + BEGIN, *tables, END + rest.partition(END)[2]])


def _digest_of(entries: list[tuple[str, str]]) -> str:
    return hashlib.sha256("".join(f"{name}\0{blob}\n" for name, blob in sorted(entries)).encode()).hexdigest()[:8]


if __name__ == "__main__":
    if sys.argv[1:2] == ["digests"]:
        at = {name: digest_at(sys.argv[2], folder) for name, folder in INPUTS.items()} if sys.argv[2:] else current()
        print(", ".join(f"{name} `{value}`" for name, value in at.items()))
    else:
        for page in sorted(RESULTS.glob("*.md")):
            page.write_text(index() if page == INDEX else marked(page), encoding="utf-8")
