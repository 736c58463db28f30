"""Tables fit their width."""

from __future__ import annotations

import pytest

from gear.measuring.text_table import number_table, text_table


@pytest.mark.parametrize("width", [60, 100, 140])
def test_lists_fit_and_keep_their_first_columns(width: int) -> None:
    rows = [[f"network_{i}", "semseg", "a long description " * 12] for i in range(5)]
    lines = text_table(("name", "task", "summary"), rows, width=width)
    assert len(lines) == 6 and max(map(len, lines)) <= width
    assert all(
        line.startswith(f"network_{i}  semseg  a long") and line.endswith("…") for i, line in enumerate(lines[1:])
    )


def test_wrapped_descriptions_are_whole() -> None:
    words = [f"word{i}" for i in range(60)]
    lines = text_table(("name", "summary"), [["one", " ".join(words)]], width=60, wrap=True)
    assert max(map(len, lines)) <= 60 and " ".join(lines[1:]).split()[1:] == words


def test_numbers_that_do_not_fit_follow_in_further_blocks() -> None:
    head = ["", *(f"metric_{i}" for i in range(9))]
    rows = [[f"data/{name}", *(f"0.{i}00 [0.100, 0.200]" for i in range(9))] for name in ("none", "patch")]
    lines = number_table([head, *rows], width=100)
    assert max(map(len, lines)) <= 100 and lines.count("") == 2
    assert [line.split()[0] for line in lines if line.startswith("data/")] == ["data/none", "data/patch"] * 3
    shown = [cell for line in lines if line and not line.startswith("data/") for cell in line.split()]
    assert shown == head[1:]


def test_a_row_without_a_cell_in_a_block_is_left_out_there() -> None:
    cells = [["", "a" * 30, "b" * 30], ["one", "1", "2"], ["two", "3", ""]]
    assert number_table(cells, width=40) == [
        " " * 5 + "a" * 30, "one  1", "two  3", "", " " * 5 + "b" * 30, "one  2"
    ]  # fmt: skip
