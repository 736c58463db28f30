"""The code blocks of the documents, and what their fences promise.

| fence | what the tests do with the block |
|---|---|
| `sh run` | runs it, in the page's order, in an empty folder, with small pictures (`small_gear.py`) |
| `sh` | parses every `gear` command with the command's own parser; reads the collection that it describes |
| `python` | runs it after the page's `sh run` blocks, in their folder; its tests must pass |
| `python parse` | compiles it: it names things that only the reader has |
| `yaml NAME` | reads it as the config that NAME says: `collection`, `scenes`, `camera`, `bench` |
| `xml` | parses it |
| `text` | nothing: what a command prints, a tree of files, a formula |

The commands that make and test a package of a new plugin run in tests/verbs/scaffold, for every kind of plugin.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"

FENCES = {
    "sh run", "sh", "python", "python parse", "yaml collection", "yaml scenes", "yaml camera", "yaml bench",
    "yaml drive", "yaml scenarios", "xml", "text",
}  # fmt: skip

DIRECTIVES = ("{",)
"""How the fences of Sphinx's directives begin."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """One fenced block of a page.

    Attributes:
        page: path of its file.
        line: number of its first line, the fence.
        fence: what stands behind the three backquotes.
        text: its content, with a newline at the end.
    """

    page: Path
    line: int
    fence: str
    text: str

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT)}:{self.line}"


def pages() -> list[Path]:
    """Every document that a user reads: the READMEs, CONTRIBUTING, the pages of the site."""
    own = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "authoring/README.md", ROOT / "weights/README.md"]
    own += [*sorted(ROOT.glob("examples/*/README.md")), ROOT / "weights/gear_weights/patches/README.md"]
    site = [path for path in DOCS.rglob("*.md") if not {"generated", "_build"} & set(path.relative_to(DOCS).parts)]
    return [*(path for path in own if path.is_file()), *sorted(site)]


def blocks_of(page: Path) -> list[Block]:
    """The fenced blocks of a page in order, without Sphinx's directives."""
    text = page.read_text(encoding="utf-8")
    found = re.finditer(r"^```([^\n`]*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    blocks = [
        Block(page=page, line=text.count("\n", 0, match.start()) + 1, fence=match[1].strip(), text=match[2])
        for match in found
    ]
    return [block for block in blocks if not block.fence.startswith(DIRECTIVES)]


def all_blocks(*fences: str) -> list[Block]:
    """The blocks of all pages that have one of these fences."""
    return [block for page in pages() for block in blocks_of(page) if block.fence in fences]


def commands(block: Block) -> Iterator[str]:
    """The command lines of a shell block: continued lines are joined, comments and empty lines left out."""
    for line in block.text.replace("\\\n", " ").splitlines():
        command = re.sub(r"(^|\s)#.*", "", line).strip()
        if command:
            yield command
