"""Starting points: the measured knot, and a trajectory to begin from."""

from __future__ import annotations

import numpy as np

from palanquin import _core
from palanquin.problems.clm.parameters import Arrays
from palanquin.problems.clm.references import PARTS, References
from palanquin.problems.clm.team import Team
from palanquin.problems.modules.rigid_body import GRAVITY
from palanquin.problems.robots import FEET


def fill_measured(knot: Arrays, team: Team, bodies: np.ndarray, feet: np.ndarray) -> None:
    """Writes a measurement into a knot.

    Args:
        knot: maps a block's name to a writable array of its size, as `Lowered.knot` gives.
        team: payload and robots.
        bodies: states [R+1, 13].
        feet: positions in the world, m, [R, 4, 3].
    """
    for b, body in enumerate(team.bodies):
        for part, columns in PARTS.items():
            knot[f"{body}.{part}"][:] = bodies[b, columns]
    for i, robot in enumerate(team.robots):
        for f, limb in enumerate(FEET):
            knot[f"{robot}.{limb}.foot"][:] = feet[i, f]


def fill_guess(
    trajectory: Arrays,
    team: Team,
    references: References,
    contacts: np.ndarray,
    feet: np.ndarray,
) -> None:
    """Writes a trajectory to start from: the references, with `carrying_forces`.

    Args:
        trajectory: maps a block's name to a writable array [N+1, size].
        team: payload and robots.
        references: of the same horizon.
        contacts: flags [N+1, R, 4].
        feet: positions in the world, m, [N+1, R, 4, 3]; see `footholds`.
    """
    for b, body in enumerate(team.bodies):
        for part, columns in PARTS.items():
            trajectory[f"{body}.{part}"][:] = references.bodies[:, b, columns]
    forces = carrying_forces(team, contacts)
    for i, robot in enumerate(team.robots):
        for f, limb in enumerate(FEET):
            trajectory[f"{robot}.{limb}.foot"][:] = feet[:, i, f]
            trajectory[f"{robot}.{limb}.force"][:] = forces[:, i, f]
        trajectory[f"{robot}.hand.force"][:] = _share(team)
        trajectory[f"{robot}.hand.torque"][:] = 0.0


def carrying_forces(team: Team, contacts: np.ndarray) -> np.ndarray:
    """Ground reaction forces [N+1, R, 4, 3], N, that carry the weight, given flags [N+1, R, 4].

    Each robot carries itself and an equal share of the payload, evenly on its standing feet.
    """
    flags = np.asarray(contacts, dtype=bool)
    forces = _core.carrying_forces(team.core, flags.reshape(len(flags), -1))
    return forces.reshape(*flags.shape, 3)


def _share(team: Team) -> np.ndarray:
    """The weight of the payload that each robot carries, N, [3]."""
    return team.payload.mass / len(team.carriers) * np.array(GRAVITY)


def footholds(
    wanted: np.ndarray, contacts: np.ndarray, before: np.ndarray, feet: np.ndarray
) -> np.ndarray:
    """Foot positions [N+1, R, 4, 3] that obey (7): `wanted` in swing and on landing, then kept.

    Args:
        wanted: positions in the world [N+1, R, 4, 3].
        contacts: flags [N+1, R, 4].
        before: feet that stand when the horizon begins, [R, 4].
        feet: measured positions [R, 4, 3].
    """
    n = len(wanted)
    flags, standing = (np.asarray(a, dtype=bool) for a in (contacts, before))
    positions = _core.carried_feet(
        np.reshape(wanted, (n, -1)),
        flags.reshape(n, -1),
        standing.reshape(1, -1),
        np.reshape(feet, (-1, 3)),
    )
    return positions.reshape(np.shape(wanted))
