"""The layout of a case's states X and inputs U, and ours.

X is [N+1, 13 (R+1)]: payload, then robots; each position, orientation (w, x, y, z), velocity
(world), angular velocity (body). U is [N, 30 R]: per robot, for LF, RF, LH, RH the force f [3] and
the foot r [3] relative to the body's position, then hand force [3] and torque [3]; world axes.
"""

from __future__ import annotations

import numpy as np

from palanquin.problems.clm.parameters import Arrays
from palanquin.problems.clm.references import PARTS, STATE
from palanquin.problems.clm.team import Team
from palanquin.problems.robots import FEET

INPUTS = 30


def to_case_layout(trajectory: Arrays, team: Team) -> tuple[np.ndarray, np.ndarray]:
    """(X, U) of a trajectory that maps a block's name to an array [N+1, size]."""
    bodies = [np.hstack([trajectory[f"{body}.{part}"] for part in PARTS]) for body in team.bodies]
    inputs = []
    for robot in team.robots:
        for limb in FEET:
            foot = trajectory[f"{robot}.{limb}.foot"] - trajectory[f"{robot}.position"]
            inputs += [trajectory[f"{robot}.{limb}.force"], foot]
        inputs += [trajectory[f"{robot}.hand.force"], trajectory[f"{robot}.hand.torque"]]
    return np.hstack(bodies), np.hstack(inputs)[:-1]


def from_case_layout(trajectory: Arrays, team: Team, xs: np.ndarray, us: np.ndarray) -> None:
    """Writes (X, U) into a trajectory; the last knot's inputs stay as they are."""
    for b, body in enumerate(team.bodies):
        for part, columns in PARTS.items():
            trajectory[f"{body}.{part}"][:] = xs[:, STATE * b : STATE * (b + 1)][:, columns]
    for i, robot in enumerate(team.robots):
        inputs = us[:, INPUTS * i : INPUTS * (i + 1)].reshape(len(us), 10, 3)
        base = trajectory[f"{robot}.position"][:-1]
        for f, limb in enumerate(FEET):
            trajectory[f"{robot}.{limb}.force"][:-1] = inputs[:, 2 * f]
            trajectory[f"{robot}.{limb}.foot"][:-1] = base + inputs[:, 2 * f + 1]
        trajectory[f"{robot}.hand.force"][:-1] = inputs[:, 8]
        trajectory[f"{robot}.hand.torque"][:-1] = inputs[:, 9]
