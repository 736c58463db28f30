"""The plan of the suburb: winding residential streets around a circus, a park with a pond, a row of shops."""

from __future__ import annotations

from authoring.towns.network import Network, Node, Profile, Street

BOUNDS = (-170.0, -170.0, 175.0, 170.0)
FLAT_M = 300.0
CIRCUS_M = 24.0

HOME = Profile(lane_m=3.3, sidewalk_m=3.6, speed_mps=8.3)
COLLECTOR = Profile(lane_m=3.4, sidewalk_m=3.6, speed_mps=11.1)
CIRCUS = Profile(forward=1, backward=0, lane_m=3.85, sidewalk_m=3.6, speed_mps=6.0)

_NODES = (
    Node(name="ce", position=(CIRCUS_M, 0)),
    Node(name="cn", position=(0, CIRCUS_M)),
    Node(name="cw", position=(-CIRCUS_M, 0)),
    Node(name="cs", position=(0, -CIRCUS_M)),
    Node(name="n1", position=(-4, 128), control="signals"),
    Node(name="n2", position=(4, 74)),
    Node(name="n4", position=(88, 124), control="signals"),
    Node(name="e1", position=(150, 4), control="signals"),
    Node(name="e2", position=(100, 3), control="stop"),
    Node(name="s1", position=(4, -132), control="signals"),
    Node(name="s2", position=(-6, -72)),
    Node(name="w1", position=(-138, -4), control="signals"),
    Node(name="w2", position=(-134, 66)),
    Node(name="w3", position=(-130, -70), control="stop"),
)

_ARC_M = CIRCUS_M - 1.0
_STREETS = (
    Street(name="circus_ne", start="ce", end="cn", corners=((24, 24, _ARC_M),), profile=CIRCUS),
    Street(name="circus_nw", start="cn", end="cw", corners=((-24, 24, _ARC_M),), profile=CIRCUS),
    Street(name="circus_sw", start="cw", end="cs", corners=((-24, -24, _ARC_M),), profile=CIRCUS),
    Street(name="circus_se", start="cs", end="ce", corners=((24, -24, _ARC_M),), profile=CIRCUS),
    Street(name="north_1", start="cn", end="n2", corners=((-2, 52, 60),), profile=HOME, trees_m=22),
    Street(name="north_2", start="n2", end="n1", corners=((4, 100, 70),), profile=HOME, trees_m=21),
    Street(name="elm", start="n2", end="w2", corners=((-32, 72, 45), (-72, 50, 42), (-106, 62, 40)), bays_right=True,
           profile=HOME, trees_m=21),
    Street(name="east_1", start="ce", end="e2", profile=HOME, bays_right=True, trees_m=20),
    Street(name="east_2", start="e2", end="e1", profile=HOME, trees_m=22),
    Street(name="ash", start="e2", end="n4", corners=((102, 34, 60), (74, 76, 50)), profile=HOME, trees_m=21),
    Street(name="south_1", start="cs", end="s2", corners=((0, -46, 60),), profile=HOME, trees_m=22),
    Street(name="south_2", start="s2", end="s1", corners=((-8, -100, 70),), profile=HOME, trees_m=21),
    Street(name="oak", start="s2", end="w3", corners=((-42, -78, 60), (-88, -54, 60)), profile=HOME, trees_m=22),
    Street(name="west", start="cw", end="w1", corners=((-58, -4, 80), (-100, 3, 70)), profile=HOME, bays_left=True,
           trees_m=21),
    Street(name="ring_n", start="n1", end="n4", corners=((42, 134, 90),), profile=COLLECTOR, trees_m=21),
    Street(name="ring_ne", start="n4", end="e1", corners=((142, 114, 42), (158, 56, 80)), profile=COLLECTOR,
           trees_m=21),
    Street(name="ring_se", start="e1", end="s1", corners=((152, -52, 90), (138, -126, 48), (62, -138, 90)),
           profile=COLLECTOR, trees_m=21, crossings=(0.341,)),
    Street(name="ring_s", start="s1", end="w3", corners=((-62, -136, 90), (-126, -130, 45)), profile=COLLECTOR,
           trees_m=22),
    Street(name="ring_w1", start="w3", end="w1", corners=((-140, -36, 60),), profile=COLLECTOR, trees_m=22),
    Street(name="ring_w2", start="w1", end="w2", corners=((-140, 30, 60),), profile=COLLECTOR, trees_m=22),
    Street(name="ring_nw", start="w2", end="n1", corners=((-132, 130, 44), (-62, 136, 90)), profile=COLLECTOR,
           bays_right=True, trees_m=22),
    Street(name="out_e", start="e1", leaves_to=(296, 40), corners=((220, 2, 80),), profile=COLLECTOR, trees_m=22),
    Street(name="out_s", start="s1", leaves_to=(-36, -296), corners=((8, -210, 80),), profile=COLLECTOR, trees_m=22),
)  # fmt: skip

NETWORK = Network({node.name: node for node in _NODES}, {street.name: street for street in _STREETS})

# Houses wall to wall along these sides of streets (1 left, -1 right).
TERRACES = {("north_1", 1), ("north_1", -1), ("elm", -1), ("west", 1), ("south_1", 1), ("ring_nw", -1), ("ash", 1)}
PARK = ((34, -34), (160, -34), (160, -150), (8, -150), (8, -84), (34, -66))
SHOPS = ((50, -8), (90, -8), (90, -27), (50, -27))
# Lights (junction, arm) that let traffic into the circus when it is full.
LIGHTS = {("cs", "south_1")}
BUS_STOPS = (("ring_n", -1, 0.5), ("ring_se", 1, 0.32), ("ring_s", 1, 0.5))

# Boards (x, y, facing in degrees) and from where a driver sees them: no house and no tree comes between.
BOARDS = (
    (-4.0, 138.0, 270.0),
    (-148.0, -4.0, 0.0),
    (0.0, -10.0, 268.0),
    (131.0, -72.0, 60.0),
    (13.0, -113.0, 116.0),
    (19.5, -104.0, 128.0),
    (83.0, 135.5, 272.0),
    (92.0, 135.0, 268.0),
)
EYES = ((-2, 84), (-90, 2), (1, -62), (148, -28), (-4, -66), (-4, -66), (80, 84), (80, 84))
