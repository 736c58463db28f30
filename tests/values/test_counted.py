"""Numbers with their nouns."""

from gear.values.counted import counted


def test_one_thing_is_singular() -> None:
    assert [counted(n, "sample") for n in (0, 1, 2)] == ["0 samples", "1 sample", "2 samples"]
