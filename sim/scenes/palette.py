"""Colours of the pictures, RGBA in [0, 1], the same in MuJoCo, in Rerun and in the figures."""

Colour = tuple[float, float, float, float]

ROBOT_COLOURS: tuple[Colour, ...] = (
    (0.95, 0.45, 0.10, 1.0),  # orange
    (0.13, 0.45, 0.85, 1.0),  # blue
    (0.60, 0.25, 0.75, 1.0),  # violet
    (0.90, 0.70, 0.10, 1.0),  # yellow
)
SHELL: Colour = (0.86, 0.87, 0.89, 1.0)
CARBON: Colour = (0.10, 0.105, 0.115, 1.0)
METAL: Colour = (0.33, 0.345, 0.37, 1.0)
RUBBER: Colour = (0.045, 0.045, 0.05, 1.0)
LENS: Colour = (0.15, 0.35, 0.45, 1.0)
TIMBER: Colour = (0.80, 0.60, 0.38, 1.0)
PAYLOAD_PLAN: Colour = (0.20, 0.75, 0.35, 1.0)
FORCE: Colour = (0.90, 0.20, 0.25, 0.9)
PUSH: Colour = (0.95, 0.80, 0.10, 1.0)
TILES = ((0.60, 0.63, 0.66), (0.54, 0.57, 0.60))
"""Light and dark tiles of the ground, RGB."""
GAP: Colour = (0.36, 0.38, 0.40, 1.0)
"""The floor between areas that may be stepped on."""
OBSTACLE: Colour = (0.70, 0.42, 0.33, 0.55)
DITCH: Colour = (0.025, 0.025, 0.03, 1.0)
DITCH_EDGE: Colour = (0.90, 0.75, 0.15, 1.0)


def robot_colour(index: int) -> Colour:
    """The colour of robot `index` of a team; they repeat after four."""
    return ROBOT_COLOURS[index % len(ROBOT_COLOURS)]
