"""Weights of the costs (12) and (13) of De Vincenti and Coros, with the values of their Table I."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

Vector = Sequence[float]


@dataclass(frozen=True)
class Weights:
    """Weights of squared errors; no factor 1/2 anywhere.

    Attributes:
        position: W_p, 1/m^2, world axes.
        orientation: w_q, of |q - (+-q*)|^2.
        velocity: W_v, s^2/m^2, world axes.
        angular_velocity: W_Omega, s^2/rad^2, body axes.
        foothold: W_r, 1/m^2, world axes.
        force: W_f, 1/N^2, of ground reaction and hand forces, world axes.
        torque: W_tau, 1/(N m)^2, of hand torques, world axes.
        payload: w^0, importance of the payload's tracking cost relative to a robot's.
        terminal: w_N, factor of the tracking cost at the last knot.
    """

    position: Vector = (10.0, 10.0, 42.0)
    orientation: float = 36.0
    velocity: Vector = (1.0, 1.0, 1.0)
    angular_velocity: Vector = (1.0, 1.0, 1.0)
    foothold: Vector = (10.0, 10.0, 10.0)
    force: Vector = (1e-8, 1e-8, 1e-8)
    torque: Vector = (1e-8, 1e-8, 1e-8)
    payload: float = 10.0
    terminal: float = 10.0


TABLE_I = Weights()
