"""Stones, stairs, planks and the turn over seeds: `python -m palanquin.benchmarks.courses`.

One should see every run completed, no foothold outside its area by more than 1 mm, and distances
from everything that stay positive. Seeds move the start; those of the stones draw another field
each.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np

from palanquin.problems.foothold_areas import FootholdAreas, nearest_in_polygons
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import Scenario, open_scenario
from palanquin.sim.show.clearance import clearance_figures
from palanquin.sim.show.kinematic import track

COURSES = ("stones", "stairs", "walkway", "turn")


def variant(name: str, seed: int) -> Scenario:
    """A course as its seed has it."""
    scenario = open_scenario(name)
    if name == "stones":
        return scenario.changed(seed=seed, terrain={**scenario.terrain.model_dump(), "seed": seed})
    return scenario.changed(seed=seed)


def run_course(scenario: Scenario) -> dict[str, Any]:
    """Plans a course in closed loop and measures it, apart from what the planner says.

    `outside_m`: the worst distance of a foothold from the areas, edges without margin; on a ground
    without areas it is missing. `clearance`: as of `clearance_figures`; missing without obstacles.
    """
    rollout, ground = run_scenario(scenario), scenario.ground
    figures = outcome(rollout)
    if isinstance(ground, FootholdAreas):
        figures["outside_m"] = outside(ground, rollout)
    if scenario.obstacles:
        figures["clearance"] = clearance_figures(track(rollout))
    return figures


def outside(terrain: FootholdAreas, rollout: Record) -> float:
    """The worst distance of a standing foot from the nearest point of any area, m."""
    feet = np.unique(rollout.feet[rollout.contact > 0.5].round(9), axis=0)
    distance = np.full(len(feet), np.inf)
    for area in terrain.areas:
        corners = np.broadcast_to(area.corners, (len(feet), *area.corners.shape))
        xy = nearest_in_polygons(corners, feet[:, :2])
        z = area.plane[0] + xy @ area.plane[1:]
        nearest = np.column_stack([xy, z])
        distance = np.minimum(distance, np.linalg.norm(nearest - feet, axis=1))
    return float(distance.max())


def run_all(names: tuple[str, ...], seeds: int) -> Iterator[tuple[str, int, dict[str, Any]]]:
    """Name, seed and figures of every run, as they come."""
    for name in names:
        for seed in range(seeds):
            yield name, seed, run_course(variant(name, seed))


def main() -> None:
    """Runs the courses and prints a line for each run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help=f"{', '.join(COURSES)}; all unless told")
    parser.add_argument("--seeds", type=int, default=20, help="so many from 0 on")
    arguments = parser.parse_args()
    for name, seed, figures in run_all(tuple(arguments.names or COURSES), arguments.seeds):
        worst = {k: f"{v:.2g}" for k, v in figures["violation"].items() if v > 0}
        kept = figures.get("clearance", {})
        distances = {f"from {kind}": least["distance_m"] for kind, least in kept.items()}
        if "outside_m" in figures:
            distances["outside"] = figures["outside_m"]
        measured = ", ".join(f"{name} {1e3 * value:.1f} mm" for name, value in distances.items())
        print(
            f"{name} {seed}: {'completed' if figures['completed'] else 'FAILED'}, {measured}, "
            f"payload rms {1e3 * figures['payload_position_error_m']['rms']:.2f} mm, "
            f"fallbacks {figures['fallbacks']}, violated {worst or 'nothing'}, "
            f"plan p50 {figures['solve_ms']['p50']:.2f} ms",
            flush=True,
        )


if __name__ == "__main__":
    main()
