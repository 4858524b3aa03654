"""What is measured: one solver, set up in one way, on one problem."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

from palanquin import _core
from palanquin.errors import ProblemError

Form = Literal["reduced", "paper"]
Start = Literal["warm", "cold"]

# OSQP at its fastest: loose enough to stop early, tight enough that the closed loop's cost stays
# within 1e-4 of what exact QPs give. To converge from cold it needs our tighter defaults.
OSQP_STEP = {"absolute_tolerance": 1e-3, "relative_tolerance": 1e-3, "scaling_iterations": 4}

MAX_ROBOTS = 16
EXACT_QPS = 3  # QPs per SQP iteration that solve its penalty subproblem in nearly all steps


@dataclass(frozen=True)
class Task:
    """The problem: a team of `robots` that trots, planned over `horizon` intervals of 1/30 s.

    `ditches` is how many lie in the way, each of which adds a row per foot and knot.
    """

    robots: int
    horizon: int
    ditches: int = 0

    def __post_init__(self) -> None:
        if not 1 <= self.robots <= MAX_ROBOTS:
            raise ProblemError(
                f"--robots {self.robots}: teams of 1 to {MAX_ROBOTS} can be measured"
            )


@dataclass(frozen=True)
class Solver:
    """A QP back end and what it is given.

    Attributes:
        qp: the back end.
        form: of the QP, without the variables that roles make known or with all of them ("paper").
        max_qps: at most so many QPs per SQP iteration: 1 is the paper's method, which takes each
            penalty's curvature at the iterate, more is semismooth Newton on the penalties.
    """

    qp: str
    form: Form
    max_qps: int = EXACT_QPS

    @property
    def label(self) -> str:
        """What tables and plots call it."""
        form = "" if self.qp == "structured" else f" {self.form}"
        return f"{self.qp}{form}, 1 QP" if self.max_qps == 1 else f"{self.qp}{form}"


# What the others are compared with: the method and the form of the paper.
PAPER_SOLVER = Solver("osqp", "paper", max_qps=1)

# The structured solver takes no rows over two knots, so it has no unreduced form.
SOLVERS = (
    Solver("structured", "reduced"),
    Solver("structured", "reduced", max_qps=1),
    Solver("ldl", "reduced"),
    Solver("ldl", "paper"),
    Solver("osqp", "reduced"),
    Solver("osqp", "paper"),
    PAPER_SOLVER,
)


@dataclass(frozen=True)
class Variant:
    """One way to plan for a task.

    Attributes:
        task: the problem.
        by: who solves the QPs.
        start: "warm" is a real-time iteration from the shifted plan; "cold" an SQP from the
            references to convergence.
        threads: for linearising and evaluating knots.
    """

    task: Task
    by: Solver
    start: Start = "warm"
    threads: int = 1

    @property
    def solver(self) -> str:
        """The method, in the words of `palanquin solve`."""
        return "rti" if self.start == "warm" else "sqp"

    @property
    def key(self) -> str:
        """Tells variants apart, also between two runs."""
        return "-".join(str(value) for value in self.columns().values())

    def columns(self) -> dict[str, Any]:
        """The columns of a result row that identify it."""
        return {
            **asdict(self.task),
            "solver": self.solver,
            **asdict(self.by),
            "start": self.start,
            "threads": self.threads,
        }

    def options(self) -> dict[str, Any]:
        """Fields of `SqpSettings` that it stands for."""
        options: dict[str, Any] = {
            "qp": self.by.qp,
            "form": self.by.form,
            "subproblem": {"max_inner_iterations": self.by.max_qps},
            "threads": self.threads,
        }
        if self.start == "warm":
            options["qp_settings"] = {"osqp": OSQP_STEP}
        return options


def chosen_solvers(names: list[str]) -> list[Solver]:
    """All of `SOLVERS`, or those whose back end is named; ProblemError for an unknown name."""
    known = _core.qp_solver_names()
    for name in names:
        if name not in known:
            raise ProblemError(f"--qp {name!r} is unknown; there are {', '.join(known)}")
    return [solver for solver in SOLVERS if not names or solver.qp in names]
