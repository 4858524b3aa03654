"""Observers of wrenches that a planner was not told of: settings of the engine's."""

from __future__ import annotations

from dataclasses import dataclass

from palanquin import _core
from palanquin.errors import ProblemError


@dataclass(frozen=True)
class Observer:
    """Of one body: gains of force and torque (1/s; 0: not observed), and the largest ones believed
    (N, N m). The estimate follows the true wrench with a time constant of 1/gain.
    """

    force: float = 0.0
    most_force: float = 0.0
    torque: float = 0.0
    most_torque: float = 0.0

    @property
    def core(self) -> _core.ObserverGains:
        """As the engine has it."""
        return _core.ObserverGains(self.force, self.most_force, self.torque, self.most_torque)


@dataclass(frozen=True)
class Observers:
    """Of each robot and of the payload; C++ `wrench_observer.hpp` says how they observe."""

    robots: Observer = Observer()
    payload: Observer = Observer()

    @property
    def core(self) -> _core.ObserverSettings:
        """As the engine has them; raises ProblemError for a value that breaks its rule."""
        try:
            return _core.ObserverSettings(self.robots.core, self.payload.core)
        except ValueError as error:
            raise ProblemError(str(error)) from error
