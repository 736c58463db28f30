"""Fields that follow from other dataclasses."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from gear.values.derived_fields import DerivedField, attribute_lines, with_fields


@dataclasses.dataclass(frozen=True)
class Source:
    """A table.

    Attributes:
        name: of it.
        one: a number, 0 to 1,
            on two lines.
    """

    name: str
    one: float = 0.5


NUMBER = DerivedField(name="one", kind=float | None, field=dataclasses.field(default=None))


def derive() -> Any:
    @with_fields([NUMBER], attribute_lines(Source, without=["name"]))
    class Derived:
        """What differs.

        Attributes:
            places: where values come from.
            preset: a name.
        """

        preset: str = "a"
        places: dict[str, int] = dataclasses.field(default_factory=dict, metadata={"places": True})

    return Derived


def test_a_derived_class_has_the_fields_and_documents_of_its_source() -> None:
    derived = derive()
    assert [field.name for field in dataclasses.fields(derived)] == ["preset", "one", "places"]
    assert derived() == derived(preset="a", one=None, places={})
    assert "    one: a number, 0 to 1,\n        on two lines." in derived.__doc__
    assert "name: of it" not in derived.__doc__
    with pytest.raises(dataclasses.FrozenInstanceError):
        derived().one = 1.0


def test_a_name_that_is_there_twice_is_an_error() -> None:
    class Twice:
        """Nothing."""

        one: int = 0

    with pytest.raises(TypeError, match="two fields named 'one'"):
        with_fields([NUMBER], "")(Twice)
