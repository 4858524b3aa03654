"""Reference optima by Ipopt, kept in a file beside this module."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from palanquin.benchmarks.suites.certificate import kkt_error
from palanquin.benchmarks.suites.stated_program import StatedProgram
from palanquin.benchmarks.suites.verdict import Verdict, judge
from palanquin.plan import Ipopt
from palanquin.problems.collection import COLLECTION, Ocp

FILE = Path(__file__).with_name("references.json")
COMMAND = "palanquin bench suites --references"
RANDOM_STARTS = 5

References = dict[str, dict[str, float]]
"""By problem: the best cost found under "best", and that of each start from which it converged."""


def load_references() -> References:
    """The file's costs."""
    costs: References = json.loads(FILE.read_text(encoding="utf-8"))["costs"]
    return costs


def make_references(ocps: list[Ocp], announce: Callable[[str], None]) -> References:
    """Solves problems by Ipopt from rest, the line and random starts, and writes their costs.

    Penalties enter as stated, hard rows hard. Only certified optima are kept; what the file says of
    other problems stays.
    """
    made: References = {}
    for ocp in ocps:
        announce(ocp.name)
        made[ocp.name] = _costs(ocp)
    known = (load_references() if FILE.exists() else {}) | made
    costs = {name: known[name] for name in COLLECTION if name in known}
    content: dict[str, Any] = {"command": COMMAND, "solver": "Ipopt, tol 1e-9", "costs": costs}
    FILE.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return costs


def _costs(ocp: Ocp) -> dict[str, float]:
    lowered, problem = ocp.build().lower(), ocp.build()
    solver = Ipopt(lowered, penalize=True, max_iterations=2000)
    found: dict[str, float] = {}
    for start, inputs in ocp.starts(lowered, random=RANDOM_STARTS).items():
        plan = solver.solve(*inputs)
        at = StatedProgram(problem, inputs.parameters, inputs.measured).expand(plan.xs)
        status = plan.status.name.lower()
        if judge(status, kkt_error(at), at.cost, None) is Verdict.OPTIMAL:
            found[start] = round(at.cost, 10)
    return {"best": min(found.values()), **found} if found else {}
