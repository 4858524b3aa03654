"""Palanquin: SQP trajectory optimization for loco-manipulation.

State an optimal control problem with `Problem`, compile it with `Problem.lower`, solve it with
`Sqp` or `Ipopt`.
"""

from __future__ import annotations

import os

# Ipopt's linear algebra is small here: a team of OpenBLAS threads slows it down.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from palanquin.candidates import Candidates, Choice
from palanquin.dump import Dump, read_dump
from palanquin.errors import LoweringError, PalanquinError, ProblemError
from palanquin.evaluation import Evaluation
from palanquin.lowered import Lowered, LoweringReport, load, lower
from palanquin.named_array import NamedArray
from palanquin.plan import Ipopt, Plan, Sqp, Status
from palanquin.policies import Hard, Penalty, Policy, RelaxedBarrier, Slack, SquaredHinge
from palanquin.problem import Chart, Problem, Role
from palanquin.settings import configure

__all__ = [
    "Candidates",
    "Chart",
    "Choice",
    "Dump",
    "Evaluation",
    "Hard",
    "Ipopt",
    "Lowered",
    "LoweringError",
    "LoweringReport",
    "NamedArray",
    "PalanquinError",
    "Penalty",
    "Plan",
    "Policy",
    "Problem",
    "ProblemError",
    "RelaxedBarrier",
    "Role",
    "Slack",
    "Sqp",
    "SquaredHinge",
    "Status",
    "configure",
    "load",
    "lower",
    "read_dump",
]
