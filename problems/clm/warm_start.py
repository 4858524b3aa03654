"""Where a solve starts: the last plan, shifted, or the references; and other footholds to try."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from palanquin.lowered import Lowered
from palanquin.named_array import NamedArray
from palanquin.problems.clm.columns import Columns
from palanquin.problems.clm.guess import carrying_forces, fill_guess, footholds
from palanquin.problems.clm.landing import landings, mid_stance_feet
from palanquin.problems.clm.references import References
from palanquin.problems.clm.standing_ground import StandingGround
from palanquin.problems.clm.starts import foothold_starts
from palanquin.problems.clm.team import Team
from palanquin.problems.clm.team_plan import TeamPlan

# Feet in the air push with less than this, N: in the paper's unreduced form their forces are
# variables, which the solver leaves at some rounding error.
_NO_FORCE = 1e-3


@dataclass(frozen=True)
class Instant:
    """What is known before a solve.

    Attributes:
        time: of the first knot, s.
        references: reference motion over the horizon.
        contacts: flags [N+1, R, 4] at the knots.
        before: flags just before the first knot, [R, 4].
        feet: measured, [R, 4, 3].
    """

    time: float
    references: References
    contacts: np.ndarray
    before: np.ndarray
    feet: np.ndarray

    def carried(self, wanted: np.ndarray) -> np.ndarray:
        """`wanted` feet [N+1, R, 4, 3], but those that stand stay."""
        return footholds(wanted, self.contacts, self.before, self.feet)


class WarmStart:
    """Makes trajectories to start from.

    Args:
        lowered: the problem.
        team: what it was built for.
        columns: where the team stands in its knot vectors.
        spacing: parameters whose "dt" holds the knots' distances, s.
        ground: where feet may stand.
        stance: how long each foot stands in its robot's gait at a time (s), [R, 4], s; 0 for one
            whose reference footholds are those of the whole stance already.
    """

    def __init__(
        self,
        lowered: Lowered,
        team: Team,
        columns: Columns,
        spacing: NamedArray,
        ground: StandingGround,
        stance: Callable[[float], np.ndarray],
    ) -> None:
        self.ground = ground
        self._stance = stance
        self._lowered, self._team, self._columns = lowered, team, columns
        self._spacing = spacing

    def guess(self, now: Instant, last: TeamPlan | None, elapsed: float) -> NamedArray:
        """The last plan as seen `elapsed` seconds later; without one, the references.

        Where feet may not stand everywhere, those that no plan has placed on the ground yet start
        where they may: one that was in the air at the last plan's end would otherwise keep to the
        near side of a ditch, step after step, long after the reference has crossed.
        """
        if last is None:
            guess = self._from_references(now)
        else:
            guess = self.shifted(last, now.contacts, elapsed)
            self._lift_feet(guess, now, last, elapsed)
        if not self.ground.is_whole:
            clear = self.ground.nearest(self._aims(now), landings(now.contacts, now.before))
            kept = now.contacts & (self._planned(elapsed) & (last is not None))[:, None, None]
            feet = np.where(kept[..., None], guess.values[:, self._columns.feet], clear)
            guess.values[:, self._columns.feet] = now.carried(feet)
        return guess

    def choices(self, now: Instant, guess: NamedArray, at_most: int) -> list[NamedArray]:
        """The guess, and copies of it whose feet land elsewhere; together at most so many."""
        starts = foothold_starts(
            self._aims(now), now.contacts, now.before, self.ground.options, at_most - 1
        )
        guesses = [guess]
        for start in starts:
            other = guess.copy()
            other.values[:, self._columns.feet] = now.carried(start)
            guesses.append(other)
        return guesses

    def shifted(self, last: TeamPlan, contacts: np.ndarray, elapsed: float) -> NamedArray:
        """The last plan as seen `elapsed` seconds later, for contact flags [N+1, R, 4].

        Where a foot stands that the last plan had in the air, it starts with its share of the
        weight: at zero force all its friction rows are at their kinks, from which the subproblem
        frees itself in steps of the penalties' smoothing width.
        """
        guess = self._lowered.shift(last.plan.trajectory, self._spacing, elapsed)
        forces = guess.values[:, self._columns.forces]
        idle = contacts & (np.abs(forces).max(axis=-1) < _NO_FORCE)
        if idle.any():
            shares = carrying_forces(self._team, contacts)
            guess.values[:, self._columns.forces] = np.where(idle[..., None], shares, forces)
        return guess

    def _from_references(self, now: Instant) -> NamedArray:
        guess = self._lowered.trajectory()
        feet = now.carried(now.references.feet())
        fill_guess(guess, self._team, now.references, now.contacts, feet)
        return guess

    def _lift_feet(self, guess: NamedArray, now: Instant, last: TeamPlan, elapsed: float) -> None:
        """Starts feet from their references where they swing and the last plan had them stand.

        Stretched as they stood, they would start on their reach's limit, and a step would slide
        them along its tangent: 4 cm too far in one case.
        """
        times = self._times()
        late = 1e-6 * self._spacing["dt"][0]
        # The last knot has no feet of its own: it is given those of the one before.
        times_with_feet = times[:-1]
        before = np.searchsorted(times_with_feet, elapsed + times + late, side="right") - 1
        lifted = last.contacts[before] & ~now.contacts
        if not lifted.any():
            return
        feet = guess.values[:, self._columns.feet]
        wanted = now.references.feet()
        guess.values[:, self._columns.feet] = np.where(lifted[..., None], wanted, feet)

    def _planned(self, elapsed: float) -> np.ndarray:
        """Which knots [N+1] the last plan, `elapsed` seconds old, had reached with its feet."""
        times = self._times()
        return elapsed + times < times[-1] - self._spacing["dt"][-1] / 2

    def _times(self) -> np.ndarray:
        """When the knots are, from the first one on, s, [N+1]."""
        return np.concatenate([[0.0], np.cumsum(self._spacing["dt"][:-1])])

    def _aims(self, now: Instant) -> np.ndarray:
        """Where feet should land, whatever the ground there, [N+1, R, 4, 3], world, m."""
        landing = landings(now.contacts, now.before)
        return mid_stance_feet(now.references, landing, self._stance(now.time), self.ground.terrain)
