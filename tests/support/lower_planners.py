"""lower_planners.py FOLDER: saves a team's planners for the C++ tests.

Leaves in FOLDER the saved planners "planner" (two robots trot on flat ground with room for two
ditches), "planner-observing" (with observers of wrenches) and "planner-candidates" (of three
choices of footholds, beside ditches).
"""

import os
import sys
from pathlib import Path

from palanquin.problems import clm


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


if __name__ == "__main__":
    main()
