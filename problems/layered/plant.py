"""The reduced-order plant: single rigid bodies and bars, with the exact multipliers (V-B.1).

The multipliers follow from the accelerations of the holonomic rows, psi'' = 0 (10), which are
linear in accelerations and multipliers:

    [ M(q)  -J' ] [ a      ]   [ f      ]
    [ J      0  ] [ lambda ] = [ -gamma ]

A payload is a point mass on its bar, which adds to M and f. The planner knows nothing of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from palanquin.problems.layered import rotations
from palanquin.problems.layered.bar import Bar
from palanquin.problems.layered.holonomic import Holonomic, Motion, hat
from palanquin.problems.layered.interconnected import Team
from palanquin.problems.layered.planner import RobotStates
from palanquin.problems.modules.rigid_body import GRAVITY


@dataclass(frozen=True)
class Payload:
    """A point mass on a bar.

    Attributes:
        mass: kg.
        place: where on the bar, 0 at its first robot to 1 at its second.
    """

    mass: float = 0.0
    place: float = 0.5


class Plant:
    """Moves robots and bars under given forces.

    Args:
        team: robots and bars.
        payloads: one per bar; none unless told.
        step: length of an integration step (Runge-Kutta of order 4), s.
    """

    def __init__(self, team: Team, payloads: tuple[Payload, ...] = (), step: float = 0.005) -> None:
        self.team, self.step = team, step
        self.payloads = payloads or tuple(Payload() for _ in team.bars)
        self._size = 6 * team.robots
        self._rows = sum(bar.rows for bar in team.bars)
        self._function = self._build()
        self.multipliers = np.zeros(self._rows)

    def advance(
        self, states: RobotStates, forces: np.ndarray, pushes: np.ndarray, duration: float
    ) -> RobotStates:
        """The states `duration` later.

        Args:
            states: now; feet stay where they are.
            forces: at the feet, world, N, [M, 4, 3].
            pushes: at the centres of mass, world, N, [M, 3].
            duration: s.
        """
        steps = max(1, round(duration / self.step))
        h = duration / steps
        for i in range(steps):
            states = self._runge_kutta(states, forces, pushes, h, i == 0)
        return states

    def constraint_error(self, states: RobotStates) -> float:
        """Largest |length - nominal length| of a bar, m."""
        errors = [0.0]
        for bar in self.team.bars:
            ends = [
                states.position[i] + states.rotation[i] @ np.asarray(d)
                for i, d in zip(bar.robots, bar.attach, strict=True)
            ]
            errors.append(abs(float(np.linalg.norm(ends[0] - ends[1])) - bar.length))
        return max(errors)

    def energy(self, states: RobotStates) -> float:
        """Kinetic and potential energy of robots and payloads, J."""
        mass = self._evaluate(states, np.zeros((self.team.robots, 4, 3)), None)[0]
        v = np.hstack([states.velocity, states.angular_velocity]).ravel()
        potential = -(np.asarray(self.team.masses)[:, None] * states.position @ np.array(GRAVITY))
        return float(0.5 * v @ mass @ v + potential.sum() + self._payload_potential(states))

    def _payload_potential(self, states: RobotStates) -> float:
        total = 0.0
        for bar, payload in zip(self.team.bars, self.payloads, strict=True):
            ends = [
                states.position[i] + states.rotation[i] @ np.asarray(d)
                for i, d in zip(bar.robots, bar.attach, strict=True)
            ]
            place = (1 - payload.place) * ends[0] + payload.place * ends[1]
            total -= payload.mass * float(place @ np.array(GRAVITY))
        return total

    def _runge_kutta(
        self, start: RobotStates, forces: np.ndarray, pushes: np.ndarray, h: float, record: bool
    ) -> RobotStates:
        """One step in coordinates theta about the rotations at its start, R = R_0 exp(theta)."""
        robots = self.team.robots
        y = np.zeros((robots, 12))
        y[:, 0:3], y[:, 3:6], y[:, 9:12] = (
            start.position, start.velocity, start.angular_velocity,
        )  # fmt: skip

        def slope(y: np.ndarray) -> np.ndarray:
            states = _at(start, y)
            a = self._accelerations(states, forces, pushes)
            theta, w = y[:, 6:9], y[:, 9:12]
            turn = rotations.cross(theta, w)
            return np.hstack([y[:, 3:6], a[:, :3], w + turn / 2 + rotations.cross(theta, turn) / 12,
                              a[:, 3:]])  # fmt: skip

        first = slope(y)
        if record:
            self.multipliers = self._last_multipliers
        second = slope(y + h / 2 * first)
        third = slope(y + h / 2 * second)
        fourth = slope(y + h * third)
        return _at(start, y + h / 6 * (first + 2 * second + 2 * third + fourth))

    def _accelerations(
        self, states: RobotStates, forces: np.ndarray, pushes: np.ndarray
    ) -> np.ndarray:
        mass, f, J, gamma = self._evaluate(states, forces, pushes)
        n, m = self._size, self._rows
        matrix = np.zeros((n + m, n + m))
        matrix[:n, :n], matrix[:n, n:], matrix[n:, :n] = mass, -J.T, J
        solution = np.linalg.solve(matrix, np.concatenate([f, -gamma]))
        self._last_multipliers = solution[n:]
        return solution[:n].reshape(-1, 6)

    def _evaluate(
        self, states: RobotStates, forces: np.ndarray, pushes: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        R, robots = states.rotation, self.team.robots
        wrench = np.zeros((robots, 6))
        wrench[:, :3] = forces.sum(axis=1) + (0.0 if pushes is None else pushes)
        moments = rotations.cross(states.feet - states.position[:, None], forces).sum(axis=1)
        wrench[:, 3:] = np.einsum("iba,ib->ia", R, moments)
        argument = np.concatenate([
            states.position.ravel(), np.swapaxes(R, 1, 2).ravel(), states.velocity.ravel(),
            states.angular_velocity.ravel(), wrench.ravel(),
        ])  # fmt: skip
        flat = np.asarray(self._function(argument)).ravel()
        n, m = self._size, self._rows
        mass, f, J, gamma = np.split(flat, np.cumsum([n * n, n, m * n]))
        return mass.reshape(n, n), f, J.reshape(n, m).T, gamma

    def _build(self) -> ca.Function:
        """(Mass matrix, forces, J, gamma), flat, over poses, velocities and wrenches."""
        robots = range(self.team.robots)
        r, v, w = ([ca.SX.sym(f"{s}{i}", 3) for i in robots] for s in "rvw")
        R = [ca.SX.sym(f"R{i}", 3, 3) for i in robots]
        wrench = [ca.SX.sym(f"f{i}", 6) for i in robots]
        motions = [Motion(r[i], R[i], v[i], w[i]) for i in robots]
        inertias = [
            ca.SX([m] * 3 + list(inertia))
            for m, inertia in zip(self.team.masses, self.team.inertias, strict=True)
        ]
        mass = ca.diag(ca.vertcat(*inertias))
        force = []
        for i, m, inertia in zip(robots, self.team.masses, self.team.inertias, strict=True):
            gyroscopic = ca.cross(w[i], ca.DM(inertia) * w[i])
            force.append(wrench[i] + ca.vertcat(m * ca.DM(GRAVITY), -gyroscopic))
        f = ca.vertcat(*force)
        jacobians, drifts = [], []
        for bar, payload in zip(self.team.bars, self.payloads, strict=True):
            J, gamma = self._rows_of(bar, motions)
            jacobians.append(J)
            drifts.append(gamma)
            if payload.mass > 0:
                Jc, drift = self._point_on(bar, payload.place, motions)
                mass = mass + payload.mass * Jc.T @ Jc
                f = f + payload.mass * Jc.T @ (ca.DM(GRAVITY) - drift)
        J = ca.vertcat(*jacobians) if jacobians else ca.SX(0, self._size)
        gamma = ca.vertcat(*drifts) if drifts else ca.SX(0, 1)
        flat = ca.vertcat(ca.vec(ca.densify(mass)), f, ca.vec(ca.densify(J)), gamma)
        arguments = ca.vertcat(*r, *(ca.vec(x) for x in R), *v, *w, *wrench)
        return ca.Function("plant", [arguments], [flat], {"cse": True})

    def _rows_of(self, bar: Bar, motions: list[Motion]) -> tuple[ca.SX, ca.SX]:
        """A bar's Jacobian [rows, 6 M] and the part of psi'' that has no accelerations, [rows]."""
        holonomic = Holonomic(bar.value, 2, ca.SX(bar.constants()))
        ends = [motions[i] for i in bar.robots]
        J = ca.SX(bar.rows, self._size)
        for i, (linear, angular) in zip(bar.robots, holonomic.jacobians(ends), strict=True):
            J[:, 6 * i : 6 * i + 6] = ca.horzcat(linear, angular)
        zero = [ca.SX.zeros(3)] * 2
        return J, holonomic.acceleration(ends, zero, zero)

    def _point_on(self, bar: Bar, place: float, motions: list[Motion]) -> tuple[ca.SX, ca.SX]:
        """Jacobian [3, 6 M] of a point on a bar, and its acceleration at no accelerations."""
        J, drift = ca.SX(3, self._size), ca.SX.zeros(3)
        for i, d, share in zip(bar.robots, bar.attach, (1 - place, place), strict=True):
            arm, R, w = ca.SX(np.asarray(d)), motions[i].rotation, motions[i].angular_velocity
            J[:, 6 * i : 6 * i + 6] = share * ca.horzcat(ca.DM.eye(3), -R @ hat(arm))
            drift += share * R @ ca.cross(w, ca.cross(w, arm))
        return J, drift


def _at(start: RobotStates, y: np.ndarray) -> RobotStates:
    return replace(
        start,
        position=y[:, 0:3],
        velocity=y[:, 3:6],
        rotation=start.rotation @ rotations.exp(y[:, 6:9]),
        angular_velocity=y[:, 9:12],
    )
