"""The architectural styles of buildings: storey heights, walls, windows, ornament, ground floors, roofs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from authoring.kit.openings import WindowStyle


@dataclass(frozen=True, slots=True, kw_only=True)
class Style:
    """The features of one building, drawn at random for its style.

    Attributes:
        wall, base: tiling materials of the upper floors and of the ground floor.
        trim: swatch or material of belts, copings and cornices.
        floor_m, ground_m: heights of an upper storey and of the ground floor, metres.
        bay_m: preferred distance between the windows, metres.
        window: style of the windows.
        cornice: `none`, `simple`, `bracket` or `classic`.
        string_courses: floors with a belt: `all`, `first` or `none`.
        roof: `flat`, `mansard` or `gable`.
        ground: `homes`, `shops`, `lobby` or `dock`.
        balconies: share of bays with a balcony, and the kind of their railing.
        door: name of the entrance door.
        quoins: whether the corners have blocks of trim.
        water_tank: whether a wooden water tank stands on the roof.
        fins: whether there are vertical fins between the bays.
        pilasters: whether there are flat columns between the bays.
        oriels: whether bay windows go through all upper floors; otherwise `escapes` adds a fire escape to one bay.
        downpipes: whether there are rain pipes at both ends of the facade.
        clutter: share of windows with an air conditioner or a flower box.
    """

    wall: str
    base: str
    trim: str
    floor_m: float
    ground_m: float
    bay_m: float
    window: WindowStyle
    cornice: str = "simple"
    string_courses: str = "none"
    roof: str = "flat"
    ground: str = "homes"
    balconies: float = 0.0
    railing: str = "bars"
    door: str = "panel_brown"
    quoins: bool = False
    water_tank: bool = False
    fins: bool = False
    pilasters: bool = False
    oriels: bool = False
    escapes: bool = False
    downpipes: bool = False
    clutter: float = 0.0


def brick_apartment(rng: np.random.Generator) -> Style:
    """Brick tenement: stone lintels and sills, bracketed cornice, sometimes a water tank."""
    wall = str(rng.choice(["brick_red", "brick_brown", "brick_buff"]))
    stone = str(rng.choice(["limestone", "sandstone", "white_paint"]))
    window = WindowStyle(
        kind="sash",
        width_m=float(rng.uniform(1.0, 1.25)),
        height_m=float(rng.uniform(1.7, 1.95)),
        sill_m=0.75,
        recess_m=0.16,
        reveal=wall,
        lintel=stone,
        ledge=stone,
    )
    return Style(
        wall=wall,
        base=str(rng.choice([wall, "ashlar"])),
        trim=stone,
        floor_m=float(rng.uniform(3.1, 3.4)),
        ground_m=4.0,
        bay_m=float(rng.uniform(2.1, 2.8)),
        window=window,
        cornice="bracket",
        string_courses=str(rng.choice(["all", "first"])),
        oriels=bool(rng.random() < 0.35),
        escapes=bool(rng.random() < 0.6),
        downpipes=bool(rng.random() < 0.5),
        clutter=0.14,
        ground=str(rng.choice(["homes", "shops"])),
        door=str(rng.choice(["panel_green", "panel_black", "panel_brown"])),
        water_tank=bool(rng.random() < 0.4),
    )


def plaster_apartment(rng: np.random.Generator) -> Style:
    """Rendered town house: painted plaster, shutters or plaster frames, small iron balconies."""
    wall = str(rng.choice(["plaster_white", "plaster_ochre", "plaster_rose", "plaster_grey"]))
    shutters = rng.random() < 0.45
    window = WindowStyle(
        kind="casement",
        width_m=float(rng.uniform(1.0, 1.2)),
        height_m=float(rng.uniform(1.65, 2.0)),
        sill_m=0.7,
        recess_m=0.2,
        reveal=wall,
        surround=None if shutters else "limestone",
        shutters=str(rng.choice(["dark_green", "teal_paint", "brown_paint", "grey_paint"])) if shutters else None,
    )
    return Style(
        wall=wall,
        base=str(rng.choice([wall, "ashlar"])),
        trim="limestone",
        floor_m=float(rng.uniform(3.1, 3.5)),
        ground_m=4.1,
        bay_m=float(rng.uniform(2.7, 3.3)) + (0.4 if shutters else 0.0),
        window=window,
        cornice="simple",
        string_courses="first",
        oriels=bool(rng.random() < 0.25) and not shutters,
        downpipes=True,
        clutter=0.16,
        roof=str(rng.choice(["flat", "gable"])),
        ground=str(rng.choice(["homes", "shops"])),
        balconies=float(rng.choice([0.0, 0.25])),
        door=str(rng.choice(["panel_green", "panel_blue", "panel_brown"])),
    )


def stone_classic(rng: np.random.Generator) -> Style:
    """Boulevard block in limestone: framed windows, string courses, heavy cornice, mansard or balustrade."""
    window = WindowStyle(
        kind="casement",
        width_m=float(rng.uniform(1.15, 1.35)),
        height_m=float(rng.uniform(2.1, 2.35)),
        sill_m=0.55,
        recess_m=0.26,
        reveal="ashlar",
        surround="limestone",
    )
    return Style(
        wall="ashlar",
        base="ashlar",
        trim="limestone",
        floor_m=float(rng.uniform(3.5, 3.8)),
        ground_m=4.6,
        bay_m=float(rng.uniform(2.6, 3.1)),
        window=window,
        cornice="classic",
        string_courses="all",
        roof=str(rng.choice(["mansard", "mansard", "flat"])),
        ground=str(rng.choice(["shops", "homes"])),
        balconies=0.3,
        door="panel_green",
        quoins=bool(rng.random() < 0.4),
        pilasters=bool(rng.random() < 0.6),
    )


def concrete_office(rng: np.random.Generator) -> Style:
    """Post-war office slab: concrete, ribbons of wide windows, fins."""
    window = WindowStyle(
        kind="modern",
        width_m=2.4,
        height_m=float(rng.uniform(1.6, 1.9)),
        sill_m=0.9,
        recess_m=0.3,
        reveal="concrete_light",
        ledge="aluminium",
    )
    return Style(
        wall="concrete",
        base=str(rng.choice(["concrete", "metal_panel"])),
        trim="concrete_light",
        floor_m=3.6,
        ground_m=4.4,
        bay_m=3.0,
        window=window,
        cornice="none",
        string_courses="none",
        ground="lobby",
        door="glass_double",
        fins=True,
    )


def shop_house(rng: np.random.Generator) -> Style:
    """One narrow house of a shopping street; every one differs from its neighbours."""
    family = (brick_apartment, plaster_apartment, plaster_apartment)[int(rng.integers(3))]
    style = family(rng)
    return replace(
        style,
        ground="shops",
        ground_m=3.9,
        water_tank=False,
        bay_m=float(rng.uniform(2.0, 2.6)),
        balconies=0.0,
        oriels=False,
        escapes=False,
    )


def warehouse_loft(rng: np.random.Generator) -> Style:
    """Former warehouse: brick, big iron windows, loading docks under a steel canopy."""
    wall = str(rng.choice(["brick_red", "brick_brown"]))
    window = WindowStyle(
        kind="industrial",
        width_m=float(rng.uniform(2.3, 2.7)),
        height_m=float(rng.uniform(2.2, 2.5)),
        sill_m=0.85,
        recess_m=0.25,
        reveal=wall,
        lintel="brick_trim",
        ledge="concrete_light",
    )
    return Style(
        wall=wall,
        base=wall,
        trim="concrete_light",
        floor_m=4.0,
        ground_m=4.8,
        bay_m=float(rng.uniform(3.8, 4.4)),
        window=window,
        cornice="simple",
        ground="dock",
        door="steel",
        water_tank=bool(rng.random() < 0.6),
    )


def modern_residential(rng: np.random.Generator) -> Style:
    """New flats: smooth light walls with a darker accent, full-height windows, balconies."""
    window = WindowStyle(
        kind="modern",
        width_m=float(rng.uniform(1.8, 2.3)),
        height_m=2.25,
        sill_m=0.12,
        recess_m=0.12,
        reveal="anthracite",
        ledge=None,
    )
    return Style(
        wall=str(rng.choice(["plaster_white", "plaster_grey", "brick_buff", "wood"])),
        base=str(rng.choice(["metal_panel", "concrete", "brick_brown"])),
        trim="anthracite",
        floor_m=3.0,
        ground_m=3.6,
        bay_m=float(rng.uniform(3.4, 4.0)),
        window=window,
        cornice="none",
        ground=str(rng.choice(["homes", "lobby"])),
        balconies=0.55,
        railing=str(rng.choice(["glass", "bars", "solid"])),
        door="glass",
    )


FAMILIES = {
    "brick_apartment": brick_apartment,
    "plaster_apartment": plaster_apartment,
    "stone_classic": stone_classic,
    "concrete_office": concrete_office,
    "warehouse_loft": warehouse_loft,
    "modern_residential": modern_residential,
}
