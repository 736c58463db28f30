"""Lists the sections of `docs/results` whose numbers were measured with other inputs: `python docs/stale_results.py`.

Each section of results names the inputs that its numbers depend on, with a digest of each: `towns` (everything in
`mjcf`), `models` and `patches` (the shipped files). A section whose digest differs from that of
the files in this checkout is stale: measure its numbers again before you compare them with new ones. The index page of
the results lists the stale sections; a test fails when the list is out of date.

`python docs/stale_results.py digests [COMMIT]` prints the digests of this checkout, or of a commit, for a new section.
"""

from __future__ import annotations

import hashlib
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

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

BEGIN, END = "<!-- stale: written by docs/stale_results.py -->", "<!-- end of stale -->"
LINE = re.compile(r"^- \*\*Inputs:\*\* (.*)$", re.MULTILINE)
DIGEST = re.compile(r"(\w+) `([0-9a-f]{8})`")


def digest(folder: Path) -> str:
    """Eight hexadecimal digits of all files below a folder, by their names and git's hashes of their content."""
    entries = []
    for path in folder.rglob("*"):
        if path.is_file() and path.suffix not in IGNORED:
            data = path.read_bytes()
            blob = hashlib.sha1(b"blob %d\0" % len(data) + data, usedforsecurity=False).hexdigest()
            entries.append((path.relative_to(folder).as_posix(), blob))
    return _digest_of(entries)


def digest_at(commit: str, folder: str) -> str:
    """The same digest for a folder of a commit."""
    listed = subprocess.run(
        ["git", "-c", "core.quotePath=false", "ls-tree", "-r", commit, f"{folder}/"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    lines = [line.split("\t") for line in listed.splitlines() if Path(line).suffix not in IGNORED]
    return _digest_of([(path.removeprefix(f"{folder}/"), facts.split()[2]) for facts, path in lines])


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


def index() -> str:
    """The index page with the list of stale sections."""
    now = current()
    rows = []
    for page, heading, inputs in sections():
        changed = [name for name, value in inputs.items() if value != now[name]]
        if changed:
            rows.append(f"| [{page.stem}]({page.name}) | {heading} | {', '.join(changed)} |")
    table = ["| page | section | inputs that changed since |", "|---|---|---|", *rows] if rows else ["None."]
    before, _, rest = INDEX.read_text(encoding="utf-8").partition(BEGIN)
    return "\n".join([before + BEGIN, "", *table, "", END + rest.partition(END)[2]])


def _digest_of(entries: list[tuple[str, str]]) -> str:
    return hashlib.sha256("".join(f"{name}\0{blob}\n" for name, blob in sorted(entries)).encode()).hexdigest()[:8]


if __name__ == "__main__":
    if sys.argv[1:2] == ["digests"]:
        at = {name: digest_at(sys.argv[2], folder) for name, folder in INPUTS.items()} if sys.argv[2:] else current()
        print(", ".join(f"{name} `{value}`" for name, value in at.items()))
    else:
        INDEX.write_text(index(), encoding="utf-8")
