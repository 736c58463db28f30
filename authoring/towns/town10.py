"""The plan of town10: a downtown of about 400 m x 400 m north and south of a canal."""

from __future__ import annotations

from authoring.towns.network import Network, Node, Profile, Street
from authoring.towns.sites import Hill, Site

BOUNDS = (-220.0, -220.0, 220.0, 220.0)

CITY = Profile()
ONE_WAY = Profile(forward=2, backward=0, lane_m=3.3)
AVENUE = Profile(forward=2, backward=2, lane_m=3.25, median_m=4.0, sidewalk_m=5.0, speed_mps=13.9)
RING = Profile(speed_mps=13.9)

_NODES = (
    Node(name="nb", position=(-96, 200), control="stop"),
    Node(name="nc", position=(2, 198), control="signals"),
    Node(name="nd", position=(98, 201), control="signals"),
    Node(name="w1", position=(-199, 108), control="stop"),
    Node(name="b1", position=(-97, 104), control="stop"),
    Node(name="c1", position=(0, 100), control="signals"),
    Node(name="d1", position=(101, 97), control="signals"),
    Node(name="e1", position=(200, 94), control="stop"),
    Node(name="w2", position=(-199, 22), control="signals"),
    Node(name="b2", position=(-92, 16), control="signals"),
    Node(name="c2", position=(-1, 14), control="signals"),
    Node(name="d2", position=(104, 10), control="signals"),
    Node(name="e2", position=(201, 14), control="signals"),
    Node(name="w3", position=(-200, -62), control="signals"),
    Node(name="c3", position=(2, -64), control="signals"),
    Node(name="d3", position=(96, -60), control="stop"),
    Node(name="e3", position=(200, -60), control="signals"),
    Node(name="w4", position=(-200, -176), control="stop"),
    Node(name="c4", position=(0, -180), control="signals"),
    Node(name="e4", position=(200, -178), control="stop"),
)

_STREETS = (
    # the ring
    Street(name="ring_nw", start="w1", end="nb", corners=((-197, 197, 24),), profile=RING, trees_m=14),
    Street(name="ring_n1", start="nb", end="nc", profile=RING, trees_m=14),
    Street(name="ring_n2", start="nc", end="nd", profile=RING, trees_m=14),
    Street(
        name="ring_ne", start="nd", end="e1", corners=((201, 198, 78),), profile=RING, trees_m=14, crossings=(0.62,)
    ),
    Street(name="ring_e1", start="e1", end="e2", profile=RING),
    Street(name="ring_e2", start="e2", end="e3", profile=RING, trees_m=14),
    Street(name="bridge_e", start="e3", end="e4", profile=RING, hump_m=1.1),
    Street(name="ring_s2", start="c4", end="e4", profile=RING, trees_m=12, crossings=(0.25,)),
    Street(name="ring_s1", start="w4", end="c4", profile=RING, bays_left=True, crossings=(0.4148,)),
    Street(name="bridge_w", start="w3", end="w4", profile=RING, hump_m=1.1),
    Street(name="ring_w2", start="w2", end="w3", profile=RING, trees_m=14),
    Street(name="ring_w1", start="w1", end="w2", profile=RING),
    # the avenue
    Street(name="avenue_1", start="nc", end="c1", profile=AVENUE, trees_m=13),
    Street(name="avenue_2", start="c1", end="c2", profile=AVENUE, trees_m=13),
    Street(name="avenue_3", start="c2", end="c3", profile=AVENUE, trees_m=13),
    Street(name="bridge_c", start="c3", end="c4", profile=AVENUE, hump_m=1.1),
    # north to south
    Street(name="birch_1", start="nb", end="b1", bays_right=True, trees_m=14),
    Street(name="birch_2", start="b1", end="b2", bays_left=True, bays_right=True),
    Street(name="dove_1", start="nd", end="d1", bays_left=True, trees_m=13),
    Street(name="dove_2", start="d1", end="d2", bays_right=True),
    Street(name="dove_3", start="d2", end="d3", corners=((109, -14, 22), (92, -36, 22))),
    # east to west
    Street(name="market_1", start="w1", end="b1", bays_left=True),
    Street(name="market_2", start="b1", end="c1", bays_right=True, trees_m=14),
    Street(name="market_3", start="c1", end="d1", bays_left=True, bays_right=True),
    Street(name="market_4", start="d1", end="e1", trees_m=14),
    Street(name="mill_1", start="w2", end="b2", profile=ONE_WAY, bays_right=True),
    Street(name="mill_2", start="b2", end="c2", profile=ONE_WAY, bays_left=True, trees_m=15),
    Street(name="mill_3", start="c2", end="d2", profile=ONE_WAY, bays_right=True),
    Street(name="mill_4", start="d2", end="e2", profile=ONE_WAY, bays_left=True, bays_right=True),
    Street(name="quay_1", start="w3", end="c3", corners=((-120, -50, 90), (-60, -66, 90)), trees_m=14),
    Street(name="quay_2", start="c3", end="d3", bays_left=True),
    Street(name="quay_3", start="d3", end="e3", trees_m=14),
    # streets out of the town, without lanes
    Street(name="out_nc", start="nc", leaves_to=(6, 420), profile=AVENUE, trees_m=14),
    Street(name="out_nb", start="nb", leaves_to=(-92, 400)),
    Street(name="out_w1", start="w1", leaves_to=(-420, 116)),
    Street(name="out_w3", start="w3", leaves_to=(-420, -70)),
    Street(name="out_w4", start="w4", leaves_to=(-420, -178)),
    Street(name="out_c4", start="c4", leaves_to=(-4, -420), profile=AVENUE, trees_m=14),
    Street(name="out_e4", start="e4", leaves_to=(206, -420)),
    Street(name="out_e3", start="e3", leaves_to=(420, -64)),
    Street(name="out_e1", start="e1", leaves_to=(420, 88)),
)

NETWORK = Network({node.name: node for node in _NODES}, {street.name: street for street in _STREETS})

CANAL_LINE = ((-430.0, -112.0), (-200.0, -119.0), (0.0, -122.0), (200.0, -119.0), (430.0, -110.0))
CANAL_HALF_WIDTH_M = 8.5

SITES = (
    Site(name="vacant_birch", kind="vacant", corners=((-110, -16), (-76, -16), (-76, 14), (-110, 14))),
    Site(name="plaza", kind="plaza", corners=((8, -60), (58, -60), (58, -20), (8, -20))),
    Site(name="lot_south", kind="parking_lot", corners=((-168, -172), (-92, -172), (-92, -136), (-168, -136))),
    Site(name="construction", kind="construction", corners=((-90, -172), (-36, -172), (-36, -136), (-90, -136))),
    Site(name="park", kind="park", corners=((18, -174), (190, -174), (190, -128), (18, -128))),
    Site(name="vacant_dove", kind="vacant", corners=((104, 14), (138, 14), (138, 48), (104, 48))),
    Site(name="vacant_curve", kind="vacant", corners=((170, 196), (202, 162), (222, 188), (194, 218))),
    Site(name="vacant_north", kind="vacant", corners=((84, 206), (116, 206), (116, 226), (84, 226))),
    Site(name="vacant_west", kind="vacant", corners=((-224, 2), (-203, 2), (-203, 44), (-224, 44))),
    Site(name="vacant_east", kind="vacant", corners=((204, -6), (224, -6), (224, 34), (204, 34))),
    Site(name="quay_garden", kind="plaza", corners=((78, -100), (118, -100), (118, -64), (78, -64))),
)
HILL = Hill(centre=(132.0, -149.5), radius_m=14.0, height_m=2.6)

# Where a driver sees a board from: (board x, y, viewpoint x, y); no tree is planted in between.
VIEWS = (
    (121, 30, 66, 8),
    (24, -40, 4, -88),
    (99, 213, 100, 150),
    (-212, 26, -197, -30),
    (-116, -162, -175, -179),
    (-121, -155, -175, -179),
    (56, -158, 110, -177),
    (55, -168, 106, -179),
    (187, 186, 126, 197),
    (191, 177, 126, 197),
    (189, 182, 156, 190),
    (213, 13, 165, 12),
    (-94, 0, -96, 58),
)
BUS_STOPS = (("quay_1", 1, 0.3), ("ring_n2", -1, 0.5), ("mill_2", -1, 0.5), ("avenue_2", -1, 0.6), ("ring_w1", 1, 0.5))
