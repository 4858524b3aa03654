"""What a team's planner is given, and what it answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from palanquin.events import Event
from palanquin.plan import SQP_PHASES, Plan
from palanquin.problems.clm.columns import Columns
from palanquin.problems.clm.references import References


@dataclass(frozen=True)
class TeamState:
    """What is measured: `bodies` [R+1, 13] (payload, then robots; position m, orientation wxyz body
    to world, velocity world m/s, angular velocity body rad/s) and `feet` [R, 4, 3] (world, m).
    """

    bodies: np.ndarray
    feet: np.ndarray


PHASES = ("inputs", *SQP_PHASES)
"""Where the time of a plan goes: references, parameters and warm start, then the solver's work."""


@dataclass(frozen=True)
class TeamPlan:
    """A plan of one period, with what it was planned for; as of `planning.Plan`.

    Attributes:
        plan: the solver's outcome.
        references: the reference motion over the horizon.
        contacts: flags [N+1, R, 4] at the knots.
        solve_ms: wall time from measurement to plan, references and warm start included; the
            solver's own is in `plan.timings_ms`.
        columns: where the team stands in the plan's knot vectors.
        events: what went otherwise than by full steps.
        time: of the first knot, s.
        observed: by a planner that observes, "observed_wrench" [R+1, 6], unknown force (N) and
            torque (N m) on each body, world, and "apparent_payload_mass", kg.
    """

    plan: Plan
    references: References
    contacts: np.ndarray
    solve_ms: float
    columns: Columns = field(repr=False)
    events: tuple[Event, ...] = ()
    time: float = 0.0
    observed: Mapping[str, np.ndarray] = field(default_factory=dict)

    @property
    def bodies(self) -> np.ndarray:
        """Planned states [N+1, R+1, 13]."""
        return self.plan.xs[:, self.columns.bodies]

    @property
    def feet(self) -> np.ndarray:
        """Planned feet in the world [N, R, 4, 3], m."""
        return self.plan.xs[:-1, self.columns.feet]

    @property
    def forces(self) -> np.ndarray:
        """Planned ground reaction forces in the world [N, R, 4, 3], N."""
        return self.plan.xs[:-1, self.columns.forces]

    @property
    def hand_wrenches(self) -> np.ndarray:
        """Planned force and torque of the payload on each hand, world, [N, R, 6], N and N m."""
        return self.plan.xs[:-1, self.columns.wrenches]

    @property
    def reference(self) -> np.ndarray:
        """Reference states of all bodies at the first knot, [R+1, 13]."""
        return self.references.bodies[0]

    @property
    def phases(self) -> Mapping[str, float]:
        """Parts of `solve_ms` by the names of `PHASES`, ms."""
        times = self.plan.timings_ms
        parts = (self.solve_ms - times["total"], *(times[name] for name in SQP_PHASES))
        return dict(zip(PHASES, parts, strict=True))

    @property
    def status(self) -> str:
        """Why the solver stopped."""
        return self.plan.status.name.lower()

    @property
    def is_usable(self) -> bool:
        """Whether it may be executed; if not, it is the last one followed on."""
        return self.plan.is_usable

    @property
    def iterations(self) -> int:
        """Of the SQP."""
        return self.plan.iteration_count

    @property
    def cost(self) -> float:
        """Of the problem's objective, penalties included."""
        return self.plan.cost

    @property
    def equality_violation(self) -> float:
        """The worst one."""
        return self.plan.equality_violation

    @property
    def violation(self) -> Mapping[str, float]:
        """The worst violation of each family of inequalities, in its unit."""
        return self.plan.violation

    @property
    def more(self) -> Mapping[str, np.ndarray]:
        """What hands bear at the first knot, and what was observed."""
        return {"hand_wrench": self.hand_wrenches[0], **self.observed}
