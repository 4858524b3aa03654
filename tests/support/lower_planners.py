"""lower_planners.py FOLDER: saves teams' planners for the C++ tests.

Leaves in FOLDER the saved planners "planner" (two robots trot on flat ground with room for two
ditches), "planner-observing" (with observers of wrenches) and "planner-candidates" (of three
choices of footholds, beside ditches); of two robots on a bar "bar-centralized" and
"bar-distributed".
"""

import os
import sys
from pathlib import Path

from palanquin.problems import clm
from palanquin.problems.layered import CentralizedPlanner, DistributedPlanner, LinkSettings
from palanquin.problems.layered.bar_planner import BarPlanner
from palanquin.problems.layered.reference import within_circle


def main() -> None:
    folder = Path(sys.argv[1])
    os.environ["PALANQUIN_CACHE"] = str(folder / "cache")
    team = clm.Team(
        clm.Payload(), (clm.Carrier("left", (0, 0.6, 0)), clm.Carrier("right", (0, -0.6, 0)))
    )
    problem = clm.build_clm(team, horizon=8, ditches=2)
    clm.Planner(problem).save(folder / "planner")
    observers = clm.Observers(clm.Observer(10.0, 150.0), clm.Observer(3.0, 90.0))
    clm.Planner(problem, observers=observers).save(folder / "planner-observing")
    lines = [[1.0, 0.0, -0.9, 0.15], [1.0, 0.0, -1.6, 0.2]]
    planner = clm.Planner(problem, ditches=lines, candidates=3)
    planner.save(folder / "planner-candidates")
    clocks, leash = [], within_circle(0.15)  # nobody moves feet
    BarPlanner(CentralizedPlanner(), clocks, leash).save(folder / "bar-centralized")
    links = {(0, 1): LinkSettings(delay=2, bias=5.0, bias_from=3)}
    distributed = DistributedPlanner(links=links)
    BarPlanner(distributed, clocks, leash).save(folder / "bar-distributed")


if __name__ == "__main__":
    main()
