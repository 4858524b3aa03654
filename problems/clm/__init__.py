"""Collaborative loco-manipulation: R armed quadrupeds carry one payload (see README.md)."""

from palanquin.problems.case_files import CaseError
from palanquin.problems.clm.build import build_clm, paper_policy
from palanquin.problems.clm.case import Case, load_case, parse_case
from palanquin.problems.clm.case_problem import CaseProblem
from palanquin.problems.clm.guess import fill_guess, fill_measured
from palanquin.problems.clm.layout import from_case_layout, to_case_layout
from palanquin.problems.clm.observers import Observer, Observers
from palanquin.problems.clm.parameters import set_contacts, set_references, set_terrain
from palanquin.problems.clm.planner import Planner
from palanquin.problems.clm.references import References, make_references, nominal_state
from palanquin.problems.clm.team import Carrier, Payload, Team
from palanquin.problems.clm.team_plan import TeamPlan, TeamState
from palanquin.problems.planning import Velocity

__all__ = [
    "Carrier",
    "Case",
    "CaseError",
    "CaseProblem",
    "Observer",
    "Observers",
    "Payload",
    "Planner",
    "References",
    "Team",
    "TeamPlan",
    "TeamState",
    "Velocity",
    "build_clm",
    "fill_guess",
    "fill_measured",
    "from_case_layout",
    "load_case",
    "make_references",
    "nominal_state",
    "paper_policy",
    "parse_case",
    "set_contacts",
    "set_references",
    "set_terrain",
    "to_case_layout",
]
