"""The paper's tables: their layout, numbers and tones."""

from __future__ import annotations

from dataclasses import replace

from gear.verbs.bench.paper.tables import Cell, paper_tables
from gear.verbs.bench.plan import ADAPTIVE
from tests.verbs.bench.synthetic import report


def test_table_1_has_the_auroc_of_patches_against_none() -> None:
    table = paper_tables(report())[0]
    assert (table.name, table.tasks, table.columns) == ("table1", (("semseg", 1),), ("net_1",))
    found = [(line.scene, line.label, line.cells[0].text) for line in table.lines]
    assert found == [
        ("town10-board_1", "detector", "0.90"), ("town10-truck", "detector", "0.80"), ("mean", "detector", "0.85"),
    ]  # fmt: skip


def test_table_2_is_relative_to_the_undefended_clean_network() -> None:
    _, table, adaptive = paper_tables(report())
    assert table.tasks == (("semseg (miou)", 2),) and table.columns == ("net_1", "attacked")
    assert [(line.scene, line.label) for line in table.lines] == [
        ("town10-board_1", "-"), ("town10-board_1", "clean&er"), ("town10-truck", "-"), ("town10-truck", "clean&er"),
    ]  # fmt: skip
    bare, cleaner, _, other = (line.cells for line in table.lines)
    assert bare == (Cell(text="70.00", tone="reference"), Cell(text="-20.00", is_grey=True))
    assert cleaner == (Cell(text="-2.00", tone="worse"), Cell(text="-10.00", tone="better", is_grey=True))
    assert other == (Cell(text="+0.00", tone="same"), Cell(text="-20.00", tone="same", is_grey=True))
    assert adaptive.lines[1].cells[1] == Cell(text="-25.00", tone="worse", is_grey=True)


def test_there_is_no_table_of_adaptive_patches_without_any() -> None:
    full = report()
    tasks = [
        replace(task, results=tuple(
            replace(one, evaluation=replace(
                one.evaluation, pools=tuple(pool for pool in one.evaluation.pools if pool.name != ADAPTIVE)))
            for one in task.results))
        for task in full.tasks
    ]  # fmt: skip
    assert [table.name for table in paper_tables(full)] == ["table1", "table2", "table2-adaptive"]
    assert [table.name for table in paper_tables(replace(full, tasks=tuple(tasks)))] == ["table1", "table2"]
