"""The plan of harbour: a motorway through an industrial estate, with a container terminal south of it.

The motorway runs along y = 0. Its two slips on either side lead to roads at y = -140 and y = 140, which a long
overbridge joins; a loop at every corner leads traffic back, so that no lane is a dead end.
"""

from __future__ import annotations

from authoring.towns.harbour_motorway import SLIP_JOIN_M, slip_y
from authoring.towns.network import Network, Node, Profile, Street

BOUNDS = (-240.0, -235.0, 240.0, 235.0)

ESTATE = Profile(lane_m=3.8, sidewalk_m=3.6, speed_mps=13.9)
TERMINAL = Profile(lane_m=3.9, sidewalk_m=3.6, speed_mps=11.1)
ON_SLIP = Profile(forward=1, backward=0, lane_m=3.6, sidewalk_m=0.0, speed_mps=16.7)
OFF_SLIP = Profile(forward=0, backward=1, lane_m=3.6, sidewalk_m=0.0, speed_mps=16.7)
SLIP_RADIUS_M = 48.0
BRIDGE_TOP_M = 5.9

_NODES = (
    Node(name="sw", position=(-215, -140), control="stop"),
    Node(name="sx", position=(-135, -141), control="stop"),
    Node(name="sc", position=(0, -142), control="signals"),
    Node(name="se", position=(215, -140), control="signals"),
    Node(name="nw", position=(-215, 140), control="signals"),
    Node(name="nc", position=(0, 142), control="signals"),
    Node(name="nx", position=(135, 141), control="signals"),
    Node(name="ne", position=(215, 140), control="stop"),
)


def _slip(name: str, node: str, x: float, side: int, profile: Profile) -> Street:
    """A slip from a junction at (x, ...) that bends into the motorway's outermost lane."""
    toward = -1.0 if x > 0 else 1.0
    return Street(
        name=name,
        start=node,
        corners=((x, slip_y(side), SLIP_RADIUS_M),),
        leaves_to=(-toward * SLIP_JOIN_M, slip_y(side)),
        profile=profile,
        joins=True,
    )


_STREETS = (
    Street(name="dock_x", start="sw", end="sx", profile=ESTATE),
    Street(name="dock_w", start="sx", end="sc", profile=ESTATE, bays_left=True, trees_m=26),
    Street(name="dock_e", start="sc", end="se", profile=ESTATE, bays_right=True),
    Street(name="estate_w", start="nw", end="nc", profile=ESTATE, trees_m=22),
    Street(name="estate_e", start="nc", end="nx", profile=ESTATE, bays_left=True, trees_m=26),
    Street(name="estate_x", start="nx", end="ne", profile=ESTATE),
    Street(name="bridge", start="sc", end="nc", profile=ESTATE, hump_m=BRIDGE_TOP_M, ramp_m=100.0, deck_half_m=22.0),
    Street(name="terminal", start="se", end="sc", corners=((215, -215, 20), (0, -215, 20)), profile=TERMINAL),
    Street(name="park", start="nw", end="nc", corners=((-215, 215, 20), (0, 215, 20)), profile=TERMINAL, trees_m=24),
    Street(name="farm", start="sw", end="sx", corners=((-215, -215, 20), (-135, -215, 20)), profile=TERMINAL),
    Street(name="grid", start="ne", end="nx", corners=((215, 215, 20), (135, 215, 20)), profile=TERMINAL, trees_m=20),
    _slip("on_south", "sw", -215, -1, ON_SLIP),
    _slip("off_south", "se", 215, -1, OFF_SLIP),
    _slip("on_north", "ne", 215, 1, ON_SLIP),
    _slip("off_north", "nw", -215, 1, OFF_SLIP),
    Street(name="out_w", start="sw", leaves_to=(-420, -146), profile=ESTATE),
    Street(name="out_e", start="ne", leaves_to=(420, 148), profile=ESTATE),
)

NETWORK = Network({node.name: node for node in _NODES}, {street.name: street for street in _STREETS})

# Where a driver sees a board from: (board x, y, viewpoint x, y); nothing leafy stands in between.
VIEWS = (
    (62, -23.5, -10, -9),
    (-66, 23.5, 6, 9),
    (-56, 24.5, 16, 9),
    (231, -140, 150, -142),
    (-231, 136, -150, 142),
    (-231, 145, -150, 142),
    (128, 127, 70, 138),
    (-12, -211, 60, -213),
    (-12, -220, 60, -213),
)
