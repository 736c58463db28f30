"""`gear.build_leaderboard`: makes static pages of a folder of records."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from gear.dataset.files import explained, write_whole
from gear.dataset.guarded_paths import remove_file
from gear.dataset.own_output import check_own
from gear.leaderboard.board import Table, tables
from gear.leaderboard.field_checks import LONGEST_TEXT, SHA256
from gear.leaderboard.reading import Filed, limited, read_records
from gear.leaderboard.record import canonical
from gear.leaderboard.verdict import Verdict, read_verdict
from gear.plugins.text import printable
from gear.values.counted import counted
from gear.values.errors import DatasetError, GearError
from gear.values.serial import Json
from gear.verbs.leaderboard.drive_page import drive_tables, drives_json
from gear.verbs.leaderboard.pages import drives_page, index_page, is_record_page, record_page
from gear.verbs.leaderboard.texts import board_json

RECORDS = "records"
"""Name of the folder with the pages of the records."""

BOARD = "board.json"
"""Name of the file with all tables, which is written first, so that a later run recognises the folder."""

MARK = b'"gear-leaderboard"'
"""The format's name in `board.json`."""

MOST_PAGE_BYTES = 64 << 20
"""Largest size of a record's page."""

MOST_BOARD_BYTES = 1 << 30
"""Largest size of a `board.json` that is recognised."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BoardReport:
    """The result of `gear.build_leaderboard`.

    Attributes:
        out: folder of the pages.
        tables: tables of the leaderboard.
        refused: one line per file that is no valid record or verdict.
    """

    out: Path
    tables: tuple[Table, ...]
    refused: tuple[str, ...]

    def as_json(self) -> Json:
        """Returns the content of board.json: the lines `refused`, the `tables` with their rows, and the tables of
        `drives`.
        """
        return board_json(self.tables, self.refused) | {"drives": drives_json(drive_tables(self.tables))}

    def summary(self) -> str:
        """Returns the result as text: counts, and one line per refused file."""
        rows = [row for table in self.tables for row in table.rows]
        ranked = sum(row.is_ranked for row in rows)
        shown = f"{counted(len(rows), 'row')}, {ranked} of them ranked, in {counted(len(self.tables), 'table')}"
        lines = [f"{self.out}: {shown}"]
        return "\n".join([*lines, *(f"refused: {line}" for line in self.refused)]) + "\n"


def build_leaderboard(
    records: str | Path, *, out: str | Path, checks: str | Path | None = None, commitment: str | None = None
) -> BoardReport:
    """Makes static pages of a folder of records: `index.html`, `drives.html` about drives, one page per record, and
    `board.json`.

    Pages of records that are no longer listed are removed. A folder that holds files but no earlier pages is refused.

    Args:
        records: folder with records (`*.json`).
        out: folder of the pages.
        checks: folder with verdicts of `gear leaderboard check --out`; only the maintainers of the leaderboard write
            into it. Without it every row is claimed only.
        commitment: salted hash of the withheld scenes, which the pages publish.

    Raises:
        GearError: a folder cannot be read or written, `out` holds files of somebody else, or the commitment is no hash.
    """
    if commitment is not None and not SHA256.fullmatch(commitment):
        raise GearError("the commitment must be a SHA-256, as `gear leaderboard commit FILE` prints it")
    check_own(Path(out), BOARD, _is_board, "pages")
    refused: list[str] = []
    filed: dict[str, Filed] = {}
    for one in read_records(Path(records)):
        if isinstance(one, DatasetError):
            refused.append(_line(Path(one.path).name, one.problem))
        else:
            filed.setdefault(one.sha256, one)
    verdicts = {} if checks is None else _verdicts(Path(checks), refused)
    found = tuple(tables(filed.values(), verdicts))
    report = BoardReport(out=Path(out), tables=found, refused=tuple(refused))
    with explained(report.out):
        report.out.mkdir(parents=True, exist_ok=True)
    write_whole(report.out, BOARD, canonical(report.as_json()))
    for sha256, one in filed.items():
        write_whole(report.out, f"{RECORDS}/{sha256}.html", record_page(one, verdicts.get(sha256)).encode())
    _remove_old_pages(report.out, filed)
    write_whole(report.out, "drives.html", drives_page(drive_tables(found)).encode())
    write_whole(report.out, "index.html", index_page(found, refused, commitment).encode())
    return report


def _is_board(path: Path) -> bool:
    """Whether a file is a `board.json` that gear wrote."""
    return MARK in limited(path, MOST_BOARD_BYTES)


def _verdicts(folder: Path, refused: list[str]) -> dict[str, Verdict]:
    """The verdicts of a folder by the SHA-256 of the record; a file counts only under its own name."""
    found: dict[str, Verdict] = {}
    with explained(folder):
        paths = sorted(path for path in folder.iterdir() if path.suffix == ".json")
    for path in paths:
        try:
            verdict = read_verdict(path)
        except DatasetError as error:
            refused.append(_line(path.name, error.problem))
            continue
        if path.stem == verdict.record_sha256:
            found[verdict.record_sha256] = verdict
        else:
            refused.append(_line(path.name, f"is the verdict of another record, {verdict.record_sha256[:12]}"))
    return found


def _line(name: str, problem: str) -> str:
    """One line on a refused file; names of files and texts in them are strangers'."""
    return f"{printable(name)}: {printable(problem, LONGEST_TEXT)}"


def _remove_old_pages(out: Path, listed: Collection[str]) -> None:
    """Removes the pages of records that are no longer listed, such as withdrawn ones.

    Only pages that gear wrote are removed: files with the name and the content of such a page.

    Args:
        out: folder of the pages.
        listed: SHA-256 of the listed records.

    Raises:
        DatasetError: the folder cannot be read, or leads through a link.
    """
    folder = out / RECORDS
    with explained(folder):
        if not folder.is_dir():
            return
        paths = sorted(path for path in folder.iterdir() if path.suffix == ".html" and SHA256.fullmatch(path.stem))
        for path in paths:
            is_old = path.stem not in listed and path.is_file() and not path.is_symlink()
            if is_old and is_record_page(limited(path, MOST_PAGE_BYTES)):
                remove_file(out, f"{RECORDS}/{path.name}")
