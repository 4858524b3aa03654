"""From a case to the CLM problem: team, parameters, measurement and starting point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palanquin.policies import Penalty
from palanquin.problem import Problem
from palanquin.problems import quaternions
from palanquin.problems.clm.build import build_clm, paper_policy
from palanquin.problems.clm.case import Case
from palanquin.problems.clm.guess import fill_guess, fill_measured, footholds
from palanquin.problems.clm.parameters import (
    Arrays,
    set_contacts,
    set_masses,
    set_references,
    set_terrain,
    set_weights,
)
from palanquin.problems.clm.references import ORIENTATION, STATE, References
from palanquin.problems.clm.starts import foothold_starts
from palanquin.problems.clm.team import Carrier, Payload, Team
from palanquin.problems.modules.ditches import padded_lines
from palanquin.problems.modules.weights import Weights
from palanquin.problems.robots import SingleRigidBody

# Problems hold ditches in such steps, so that cases share compiled code.
_DITCH_STEP = 12


@dataclass(frozen=True)
class CaseProblem:
    """A case in our terms.

    Attributes:
        case: the file's contents.
        team: its payload and robots ("robot1", ...).
        references: its reference motion.
        contacts: flags [N+1, R, 4] at knots 0..N; the file has none for the last, which needs none.
        before: flags of the knot before the horizon, [R, 4].
    """

    case: Case
    team: Team
    references: References
    contacts: np.ndarray
    before: np.ndarray

    @staticmethod
    def of(case: Case) -> CaseProblem:
        """Converts a case."""
        r = len(case.robots)
        bodies = np.array(case.xref.reshape(-1, r + 1, STATE))
        measured = case.x0.reshape(-1, STATE)
        # The cost takes either sign of a reference, the guess made from it does not.
        bodies[..., ORIENTATION] = quaternions.continuous(
            bodies[..., ORIENTATION], measured[..., ORIENTATION]
        )
        return CaseProblem(
            case=case,
            team=_team(case),
            references=References(
                bodies=bodies,
                footholds=np.concatenate([case.rref, case.rref[-1:]]),
            ),
            contacts=np.concatenate([case.s[1:], case.s[-1:]]),
            before=case.s[0],
        )

    def build(self) -> Problem:
        """The symbolic problem; cases with as many robots share its compiled code."""
        case = self.case
        steps = -(-len(case.ditches) // _DITCH_STEP)
        terrain = case.terrain.shape()
        return build_clm(self.team, case.N, case.dt, terrain, ditches=steps * _DITCH_STEP)

    def fill_parameters(self, params: Arrays) -> None:
        """Writes every number of the case."""
        case, team, w = self.case, self.team, self.case.weights
        params["dt"][:] = case.dt
        set_masses(params, team)
        set_terrain(params, case.terrain.shape(), case.mu)
        set_references(params, team, self.references)
        set_contacts(params, team, self.contacts, self.before)
        set_weights(
            params,
            team,
            Weights(
                position=w.Wp.tolist(),
                orientation=w.wq,
                velocity=w.Wv.tolist(),
                angular_velocity=w.WO.tolist(),
                foothold=w.Wr.tolist(),
                force=w.Wf.tolist(),
                torque=w.Wt.tolist(),
                payload=w.w0,
                terminal=w.wN,
            ),
        )
        if case.ditches:
            params["ditches"][:] = padded_lines(self._ditch_lines(), params["ditches"].shape[1])

    def fill_measured(self, knot: Arrays) -> None:
        """Writes the measured state and feet."""
        bodies = self.case.x0.reshape(-1, STATE)
        fill_measured(knot, self.team, bodies, self.case.feet0)

    def starts(self, at_most: int = 1) -> list[np.ndarray]:
        """Foot trajectories [N+1, R, 4, 3] to start from, the references' own first.

        More than one only where reference footholds lie in ditches; see `foothold_starts`.
        """
        lines = np.array(self._ditch_lines()).reshape(-1, 4)
        terrain, wanted = self.case.terrain.shape(), self.references.feet()
        moved = foothold_starts(wanted, self.contacts, self.before, terrain, lines, at_most)
        starts = [wanted, *(start for start in moved if (start != wanted).any())][:at_most]
        return [footholds(start, self.contacts, self.before, self.case.feet0) for start in starts]

    def fill_guess(self, trajectory: Arrays, feet: np.ndarray | None = None) -> None:
        """Writes a trajectory to start from, with `feet` of `starts`, the first unless told."""
        feet = self.starts()[0] if feet is None else feet
        fill_guess(trajectory, self.team, self.references, self.contacts, feet)

    def policies(self) -> dict[str, Penalty]:
        """The case's penalty by constraint family, in units of our rows."""
        penalty = self.case.penalty
        families = ["leg", "arm", "normal", "friction", *(["ditch"] if self.case.ditches else [])]
        return {f: paper_policy(f, penalty.K, penalty.eps) for f in families}

    def _ditch_lines(self) -> list[list[float]]:
        return [[d.a, d.b, d.c, d.d] for d in self.case.ditches]


def _team(case: Case) -> Team:
    payload = Payload(case.payload.m, tuple(case.payload.I), case.payload.h)
    carriers = []
    for i, robot in enumerate(case.robots, start=1):
        model = SingleRigidBody(
            mass=robot.m,
            inertia=tuple(robot.I),
            leg_length=robot.lf,
            arm_length=robot.lh,
            hips=tuple(map(tuple, robot.hips)),
            arm=tuple(robot.arm),
            hand=tuple(robot.hand),
            standing_height=case.payload.h + robot.attach[2] - robot.hand[2],
        )
        carriers.append(Carrier(f"robot{i}", tuple(robot.attach), model, robot.yaw_off))
    return Team(payload, tuple(carriers))
