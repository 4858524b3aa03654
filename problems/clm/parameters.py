"""Values of the CLM problem's run-time parameters.

`params` maps a parameter's name to a writable array [N+1, *shape], as `Lowered.parameters` gives.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from palanquin.errors import ProblemError
from palanquin.problems.clm.references import PARTS, References
from palanquin.problems.clm.team import Team
from palanquin.problems.modules.weights import Weights
from palanquin.problems.terrains import Terrain


class Arrays(Protocol):
    """Arrays by name, such as a `NamedArray` or a dict."""

    def __getitem__(self, name: str, /) -> np.ndarray:
        """The array called `name`."""

    def __contains__(self, name: str, /) -> bool:
        """Whether there is one."""


def set_references(params: Arrays, team: Team, references: References) -> None:
    """Writes the reference motion of all bodies and feet."""
    for b, body in enumerate(team.bodies):
        for part, columns in PARTS.items():
            params[f"{body}.reference.{part}"][:] = references.bodies[:, b, columns]
    for i, robot in enumerate(team.robots):
        params[f"{robot}.reference.footholds"][:] = references.footholds[:, i]


def set_contacts(params: Arrays, team: Team, contacts: np.ndarray, before: np.ndarray) -> None:
    """Writes the contact flags.

    Args:
        params: parameters.
        team: whose robots.
        contacts: flags [N+1, R, 4] at the knots.
        before: which feet stand on the ground when the horizon begins, [R, 4]. A foot that stands
            then and at knot 0 stays where it was measured.
    """
    contacts = np.asarray(contacts, dtype=float)
    shape = (len(contacts), len(team.carriers), 4)
    if contacts.shape != shape or np.shape(before) != shape[1:]:
        raise ProblemError(
            f"contacts have shape {contacts.shape} and before {np.shape(before)}; "
            f"(N+1, {shape[1]}, 4) and {shape[1:]} are needed"
        )
    previous = np.concatenate([np.asarray(before, dtype=float)[None], contacts[:-1]])
    for i, robot in enumerate(team.robots):
        params[f"{robot}.contact"][:] = contacts[:, i]
        params[f"{robot}.previous_contact"][:] = previous[:, i]


def set_terrain(params: Arrays, terrain: Terrain, friction: float | None = None) -> None:
    """Writes the terrain's parameters; raises ProblemError for a shape that was not lowered."""
    for name, value in terrain.parameters().items():
        if f"terrain.{name}" not in params:
            raise ProblemError(f"this problem's terrain has no parameter '{name}'")
        params[f"terrain.{name}"][:] = value
    if friction is not None:
        params["terrain.friction"][:] = friction


def set_masses(params: Arrays, team: Team) -> None:
    """Writes masses, inertias and the geometry of legs, arms and grasps."""
    params["payload.mass"][:] = team.payload.mass
    params["payload.inertia"][:] = team.payload.inertia
    for carrier in team.carriers:
        name, model = carrier.name, carrier.model
        params[f"{name}.mass"][:] = model.mass
        params[f"{name}.inertia"][:] = model.inertia
        params[f"{name}.hips"][:] = model.hips
        params[f"{name}.leg_length"][:] = model.leg_length
        params[f"{name}.arm_base"][:] = model.arm
        params[f"{name}.arm_length"][:] = model.arm_length
        params[f"{name}.attach"][:] = carrier.attach


def set_weights(params: Arrays, team: Team, weights: Weights) -> None:
    """Writes the weights of (12) and (13)."""
    for body in team.bodies:
        for part in PARTS:
            params[f"{body}.weight.{part}"][:] = getattr(weights, part)
        params[f"{body}.weight.terminal"][:] = weights.terminal
    params["payload.weight.importance"][:] = weights.payload
    for robot in team.robots:
        params[f"{robot}.weight.foothold"][:] = weights.foothold
        params[f"{robot}.weight.force"][:] = weights.force
        params[f"{robot}.weight.hand_force"][:] = weights.force
        params[f"{robot}.weight.hand_torque"][:] = weights.torque


def set_input_blocks(params: Arrays, team: Team, knots: int) -> None:
    """Lets forces of feet and hands change at every `knots`-th knot only, from the first one on.

    A foot that lands in between begins with a force of its own. Raises ProblemError for less than
    one knot, or for a problem that was built without `holds_inputs`.
    """
    if not isinstance(knots, int) or knots < 1:
        raise ProblemError(f"input blocks are {knots!r} knots long; at least 1 is needed")
    for robot in team.robots:
        if f"{robot}.hold" not in params:
            if knots == 1:
                continue
            raise ProblemError("inputs cannot be held: build the problem with holds_inputs=True")
        hold = params[f"{robot}.hold"]
        hold[:] = np.arange(len(hold)) % knots != 0
