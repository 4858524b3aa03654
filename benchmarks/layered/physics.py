"""Figures 10, 12 to 18, 20, 24 and 25 of Kim et al., from full physics instead of experiments.

What a simulation has no counterpart for is chosen as near as it gets: a person's pushes and pulls
are a push and a rope, gravel and mulch are rough and soft ground.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palanquin.benchmarks.layered.runs import PHYSICS
from palanquin.problems.robots import FEET
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenes.palette import robot_colour
from palanquin.sim.show import plots

_SET = ("blocks", "slippery", "pulled")
_RESTRICTED = ("pitch-yaw", "roll-yaw", "roll-pitch", "roll-pitch-yaw")
_OUTDOOR = (
    ("gravel", "distributed"),
    ("lawn", "centralized"),
    ("mulch", "distributed"),
    ("grass", "centralized"),
)
_BOTH = ("centralized", "distributed")

Key = tuple[str, str]
Progress = Callable[[str, int, int], None]


@dataclass
class Runs:
    """Runs by scenario and planner, each made once, when it is asked for first."""

    duration: float
    progress: Progress
    done: dict[Key, Record]

    def __call__(self, name: str, planner: str) -> Record:
        """The run of scenario `name` with `planner`."""
        if (name, planner) not in self.done:
            scenario = PHYSICS[name].changed(planner=planner, duration=self.duration)
            self.done[name, planner] = run_scenario(scenario)
            self.progress("physics", len(self.done), NUMBER_OF_RUNS)
        return self.done[name, planner]


def reproduce_physics(
    folder: Path, duration: float = 10.0, progress: Progress = lambda name, done, total: None
) -> tuple[list[dict[str, Any]], list[Path]]:
    """Runs everything for `duration` (s) and writes a picture a figure into `folder`.

    Returns each run's figures with its name and planner, and the files, a report among them.
    `progress` is told the name of the part, how many runs are done, and of how many.
    """
    runs = Runs(duration, progress, {})
    files = []
    for name, draw in _FIGURES.items():
        figure = draw(runs)
        path = folder / f"{name}.png"
        figure.savefig(path, dpi=120)
        files.append(path)
    rows = [
        {"scenario": name, "planner": planner, **outcome(result)}
        for (name, planner), result in runs.done.items()
    ]
    report = folder / "physics.md"
    pictures = "\n".join(f"![{path.stem}]({path.name})" for path in files)
    report.write_text(f"# Full physics\n\n{physics_table(rows)}\n\n{pictures}\n", "utf-8")
    return rows, [*files, report]


def physics_table(rows: list[dict[str, Any]]) -> str:
    """Markdown: what each run in full physics came to."""
    lines = [
        "| ground, load | planner | walked | velocity error | bar's error | torque |",
        "|---" * 6 + "|",
    ]
    for row in rows:
        error = row["velocity_error_m_s"]
        cells = [
            row["scenario"],
            row["planner"],
            f"fell after {row['duration_s']:.1f} s"
            if row["fell"]
            else f"{row['distance_m']:.1f} m",
            f"{error['rms']:.3f} m/s" if error else "",
            f"{1e3 * row['bar_length_error_m']:.2g} mm",
            f"{100 * row['torque_fraction_max']:.0f} %",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _grid(rows: int, columns: int, width: float = 4.6, height: float = 2.3) -> tuple[Figure, Any]:
    figure = Figure(figsize=(width * columns, height * rows), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False)


def _end(axes: Axes, title: str) -> None:
    axes.set_title(title, fontsize="medium", pad=18)
    plots.finish(axes)


def _velocities(runs: Runs, keys: list[Key]) -> Figure:
    """Velocities along x and y, a column a run."""
    figure, grid = _grid(2, len(keys))
    for column, key in enumerate(keys):
        for axis in (0, 1):
            plots.plot_velocity(grid[axis][column], runs(*key), axis)
            _end(grid[axis][column], f"{key[0]}, {key[1]}" if axis == 0 else "")
        grid[1][column].set_xlabel("time (s)")
    return figure


def _forces(runs: Runs, keys: list[Key]) -> Figure:
    """Planned vertical forces of the left front legs, a column a run."""
    figure, grid = _grid(1, len(keys))
    for column, key in enumerate(keys):
        plots.plot_vertical_force(grid[0][column], runs(*key))
        _end(grid[0][column], f"{key[0]}, {key[1]}")
        grid[0][column].set_xlabel("time (s)")
    return figure


def _phases(runs: Runs, names: tuple[str, ...]) -> Figure:
    """Roll and pitch of the first robot: a row a planner, all scenarios in one."""
    figure, grid = _grid(2, 2, height=3.0)
    for row, planner in enumerate(_BOTH):
        for axis in (0, 1):
            for name in names:
                plots.plot_phase(grid[row][axis], runs(name, planner), axis, name)
            _end(grid[row][axis], planner)
    return figure


def _virtual_constraints(runs: Runs) -> Figure:
    figure, grid = _grid(2, 2)
    for index, key in enumerate(_OUTDOOR):
        axes = grid[index // 2][index % 2]
        plots.plot_virtual_constraints(axes, runs(*key))
        axes.set_xlabel("time (s)")
        _end(axes, f"{key[0]}, {key[1]}")
    return figure


def _foot_heights(runs: Runs) -> Figure:
    """Heights of both right front feet, from flat ground onto the blocks."""
    figure, grid = _grid(1, 1, width=9.0, height=3.0)
    result, axes = runs("blocks", "centralized"), grid[0][0]
    foot = FEET.index("RF")
    for i, name in enumerate(result.team.names):
        height = 100 * result.feet[:, i, foot, 2]
        axes.plot(result.time, height, color=robot_colour(i), label=name, linewidth=1.0)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("height of RF (cm)")
    _end(axes, "")
    return figure


_FIGURES: dict[str, Callable[[Runs], Figure]] = {
    "figure-10": lambda runs: _velocities(runs, [("rough", planner) for planner in _BOTH]),
    "figure-12": lambda runs: _velocities(runs, [("flat", "centralized")]),
    "figure-13": lambda runs: _forces(runs, [("flat", "centralized")]),
    "figure-14": lambda runs: _velocities(runs, [(name, "centralized") for name in _SET]),
    "figure-15": lambda runs: _forces(runs, [(name, "centralized") for name in _SET]),
    "figure-16": lambda runs: _phases(runs, _SET),
    "figure-17": lambda runs: _velocities(runs, [(name, "distributed") for name in _SET]),
    "figure-18": lambda runs: _forces(runs, [(name, "distributed") for name in _SET]),
    "figure-20": _virtual_constraints,
    "figure-24": _foot_heights,
    "figure-25": lambda runs: _phases(runs, _RESTRICTED),
}

NUMBER_OF_RUNS = 2 + 1 + 2 * len(_SET) + len(_OUTDOOR) + 2 * len(_RESTRICTED)
"""That all figures take."""
