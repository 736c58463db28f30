"""Makes dataclasses whose fields are derived from other dataclasses, so each field and its description are written
only once.
"""

from __future__ import annotations

import dataclasses
import inspect
import textwrap
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeVar

T = TypeVar("T")

HEADING = "Attributes:"


@dataclass(frozen=True, slots=True, kw_only=True)
class DerivedField:
    """A field that is added to a dataclass.

    Attributes:
        name: name of the field.
        kind: type of the field, as a type object and not as text.
        field: default and metadata, as `dataclasses.field` makes them.
    """

    name: str
    kind: Any
    field: Any


def attribute_lines(kind: type[Any], *, without: Iterable[str] = ()) -> str:
    """The lines below `Attributes:` in the docstring of a class, for the docstring of a class with the same
    fields.

    Args:
        kind: the class.
        without: names of attributes that are left out.
    """
    _, _, section = (textwrap.dedent("    " + (kind.__doc__ or ""))).partition(f"{HEADING}\n")
    left_out = tuple(f"    {name}:" for name in without)
    return "\n".join(line for line in section.rstrip().splitlines() if not line.startswith(left_out))


def with_fields(fields: Iterable[DerivedField], attributes: str) -> Callable[[type[T]], type[T]]:
    """A decorator that makes a class a frozen, keyword-only dataclass and adds fields to it.

    The class's own fields come first. Own fields with metadata (such as `places`) come last, after the added ones.

    Args:
        fields: the added fields in order.
        attributes: lines of their descriptions, as in an `Attributes:` section.

    Raises:
        TypeError: two fields have the same name.
    """
    more = tuple(fields)

    def decorate(cls: type[T]) -> type[T]:
        own = inspect.get_annotations(cls)
        last = {name for name in own if isinstance(vars(cls).get(name), dataclasses.Field) and vars(cls)[name].metadata}
        annotations = {name: kind for name, kind in own.items() if name not in last}
        for one in more:
            if one.name in annotations:
                raise TypeError(f"{cls.__name__} has two fields named {one.name!r}")
            annotations[one.name] = one.kind
            setattr(cls, one.name, one.field)
        cls.__annotations__ = annotations | {name: own[name] for name in own if name in last}
        text = textwrap.dedent("    " + (cls.__doc__ or "")).rstrip()
        cls.__doc__ = f"{text}\n{attributes}\n" if HEADING in text else f"{text}\n\n{HEADING}\n{attributes}\n"
        return dataclass(frozen=True, kw_only=True)(cls)

    return decorate
