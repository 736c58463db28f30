"""Where things are in the atlas textures. UV rectangles are (u0, v0, u1, v1), v up."""

from __future__ import annotations

Rect = tuple[float, float, float, float]

# windows.png: rows of frames from the top, eight dressings (curtains, blinds, lamps) each
WINDOW_ROWS = {"casement": 0, "sash": 1, "modern": 2, "industrial": 3}
WINDOW_COLUMNS = 8
# shop_fronts.png: three rows of four shop windows, then a row of eight doors
SHOP_COUNT = 12
LOBBY_PANES = (8, 9, 10, 11)
DOORS = ("panel_green", "panel_brown", "panel_blue", "panel_black", "glass", "glass_double", "steel", "shutter")
# signs.png, upper half: two columns of eight fascias; below: posters, then blade signs
FASCIA_COUNT = 16
POSTER_COUNT = 4
BLADE_COUNT = 8
# awnings.png: strips that tile along u
AWNING_COUNT = 8
# far_facades.png: strips that tile along u over FAR_WIDTH_M; an upper and a ground floor for each style
FAR_STYLES = (
    "brick_apartment",
    "plaster_apartment",
    "stone_classic",
    "glass_office",
    "concrete_office",
    "shop_row",
    "warehouse_loft",
    "modern_residential",
)
FAR_WIDTH_M = 24.0
# lenses.png: a row of four discs
LENSES = ("red", "amber", "green", "dark")
IRONWORK = ("manhole", "manhole_square", "drain", "tree_grate")


def grid_rect(column: int, row: int, columns: int, rows: int, *, inset: float = 0.004) -> Rect:
    """A cell of a grid whose first row is the picture's top; `inset` is a share of the cell kept clear of its edge."""
    u0, v1 = column / columns, 1 - row / rows
    du, dv = inset / columns, inset / rows
    return u0 + du, v1 - 1 / rows + dv, u0 + 1 / columns - du, v1 - dv


def window_rect(kind: str, dressing: int) -> Rect:
    """One window of a kind of `WINDOW_ROWS`."""
    return grid_rect(dressing % WINDOW_COLUMNS, WINDOW_ROWS[kind], WINDOW_COLUMNS, len(WINDOW_ROWS))


def shop_rect(index: int) -> Rect:
    """One shop window of twelve."""
    row, column = divmod(index % SHOP_COUNT, 4)
    return grid_rect(column, row, 4, 4)


def door_rect(name: str) -> Rect:
    """One door of `DOORS`."""
    return grid_rect(DOORS.index(name), 3, 8, 4)


def fascia_rect(index: int) -> Rect:
    """One shop sign, eight times as wide as high."""
    row, column = divmod(index % FASCIA_COUNT, 2)
    return grid_rect(column, row, 2, 16)


def poster_rect(index: int) -> Rect:
    """One poster, two wide to three high."""
    column = index % POSTER_COUNT
    return column / 4 + 0.001, 0.126, column / 4 + 0.249, 0.499


def blade_rect(index: int) -> Rect:
    """One square sign that hangs over the pavement."""
    return grid_rect(index % BLADE_COUNT, 7, 8, 8)


def awning_rows(index: int) -> tuple[float, float]:
    """v of the lower and upper edge of an awning's strip."""
    _, v0, _, v1 = grid_rect(0, index % AWNING_COUNT, 1, AWNING_COUNT, inset=0.08)
    return v0, v1


def far_rows(style: str, *, ground: bool) -> tuple[float, float]:
    """v of the lower and upper edge of a far facade's floor."""
    _, v0, _, v1 = grid_rect(0, 2 * FAR_STYLES.index(style) + ground, 1, 2 * len(FAR_STYLES), inset=0.02)
    return v0, v1


def lens_rect(name: str) -> Rect:
    """One traffic light lens."""
    return grid_rect(LENSES.index(name), 0, 4, 1)


def ironwork_rect(name: str) -> Rect:
    """One cover of cast iron."""
    row, column = divmod(IRONWORK.index(name), 2)
    return grid_rect(column, row, 2, 2)


# traffic_signs.png: a grid of four by four, each sign filling its cell's inner 94 %
TRAFFIC_SIGNS = (
    "stop",
    "yield",
    "priority",
    "no_entry",
    "speed_30",
    "speed_50",
    "one_way",
    "parking",
    "crossing",
    "turn_right",
    "no_parking",
    "warning_children",
    "roundabout",
    "street_name",
    "bus_stop",
    "chevron",
)


def traffic_sign_rect(name: str) -> Rect:
    """One traffic sign."""
    row, column = divmod(TRAFFIC_SIGNS.index(name), 4)
    return grid_rect(column, row, 4, 4, inset=0.03)
