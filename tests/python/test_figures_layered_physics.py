"""The layered paper's figures from full physics: which runs they draw, and what of them."""

from dataclasses import fields, replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from palanquin.benchmarks.layered import physics
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios.bars import BarScenario

SET = ("blocks", "slippery", "pulled")
HELD = ("pitch-yaw", "roll-yaw", "roll-pitch", "roll-pitch-yaw")


def by(planner, *names):
    return [(name, planner) for name in names]


# The runs that each axes of a figure draws, row by row.
DRAWN = {
    "figure-10": 2 * [by("centralized", "rough"), by("distributed", "rough")],
    "figure-12": 2 * [by("centralized", "flat")],
    "figure-13": [by("centralized", "flat")],
    "figure-14": 2 * [by("centralized", name) for name in SET],
    "figure-15": [by("centralized", name) for name in SET],
    "figure-16": 2 * [by("centralized", *SET)] + 2 * [by("distributed", *SET)],
    "figure-17": 2 * [by("distributed", name) for name in SET],
    "figure-18": [by("distributed", name) for name in SET],
    "figure-20": [
        by("distributed", "gravel"),
        by("centralized", "lawn"),
        by("distributed", "mulch"),
        by("centralized", "grass"),
    ],
    "figure-24": [by("centralized", "blocks")],
    "figure-25": 2 * [by("centralized", *HELD)] + 2 * [by("distributed", *HELD)],
}
RUNS = sorted({key for axes in DRAWN.values() for keys in axes for key in keys})


def first(record, ticks):
    """The record's first ticks."""
    arrays = {
        f.name: getattr(record, f.name)[:ticks]
        for f in fields(Record)
        if isinstance(getattr(record, f.name), np.ndarray) and f.name != "plan_time"
    }
    more = {name: values[:ticks] for name, values in record.more.items()}
    violation = {name: values[:ticks] for name, values in record.violation.items()}
    return replace(record, **arrays, more=more, violation=violation)


@pytest.fixture(scope="module")
def reproduced(tmp_path_factory):
    """All figures of runs that are one short one, cut to another length for each scenario and
    planner; the figures by name, the runs, and what the reproduction returned and said.
    """
    folder = tmp_path_factory.mktemp("figures")
    short = BarScenario(duration=0.3)
    walked = run_scenario(short)
    runs, told, figures, done = {}, {}, {}, []

    def cut(scenario):
        key = scenario.name, scenario.planner
        assert key not in runs, "made twice"
        length = 10 + RUNS.index(key)
        told[key], runs[key] = scenario, first(walked, length)
        return runs[key]

    def save(figure, path, **options):
        figures[path.stem] = figure
        original(figure, path, **options)

    original = Figure.savefig
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(physics, "run_scenario", cut)
        patch.setattr(Figure, "savefig", save)
        rows, files = physics.reproduce_physics(
            folder, duration=0.3, progress=lambda *part: done.append(part)
        )
    assert all(scenario.duration == 0.3 for scenario in told.values())
    return folder, figures, runs, rows, files, done


def curves(axes):
    """Values [T] of each curve."""
    return [np.asarray(line.get_ydata()) for line in axes.get_lines()]


@pytest.mark.parametrize("name", DRAWN)
def test_a_figure_draws_its_runs(reproduced, name):
    _, figures, *_ = reproduced
    drawn = []
    for axes in figures[name].axes:
        lengths = {len(values) for values in curves(axes)}
        drawn.append([key for key in RUNS if 10 + RUNS.index(key) in lengths])
    assert drawn == [sorted(keys) for keys in DRAWN[name]]


def has(axes, values):
    return any(curve.shape == values.shape and (curve == values).all() for curve in curves(axes))


def test_velocities_are_desired_planned_and_actual(reproduced):
    _, figures, runs, *_ = reproduced
    for name in ("figure-10", "figure-12", "figure-14", "figure-17"):
        panels = list(zip(figures[name].axes, DRAWN[name], strict=True))
        for index, (axes, (key,)) in enumerate(panels):
            component = 7 if index < len(panels) / 2 else 8
            ticks = runs[key]
            assert has(axes, ticks.references[:, 0, component])
            for robot in range(2):
                assert has(axes, ticks.bodies[:, robot, component])
                assert has(axes, ticks.planned[:, 1, robot, component])


def test_forces_constraints_and_heights_are_those_of_the_runs(reproduced):
    _, figures, runs, *_ = reproduced
    for name in ("figure-13", "figure-15", "figure-18"):
        for axes, (key,) in zip(figures[name].axes, DRAWN[name], strict=True):
            for robot in range(2):
                assert has(axes, runs[key].force[:, robot, 0, 2])
    for axes, (key,) in zip(figures["figure-20"].axes, DRAWN["figure-20"], strict=True):
        for column in (0, 1, 3, 4):
            assert has(axes, runs[key].more["output_error"][:, 0, column])
    for robot in range(2):
        height = 100 * runs["blocks", "centralized"].feet[:, robot, 1, 2]
        assert has(figures["figure-24"].axes[0], height)


def test_phase_portraits_have_rates_over_angles(reproduced):
    _, figures, runs, *_ = reproduced
    for name in ("figure-16", "figure-25"):
        for index, (axes, keys) in enumerate(zip(figures[name].axes, DRAWN[name], strict=True)):
            for key in keys:
                assert has(axes, runs[key].bodies[:, 0, 10 + index % 2])


def test_everything_is_written_and_told(reproduced):
    folder, figures, runs, rows, files, done = reproduced
    assert set(figures) == set(DRAWN)
    pictures = [file for file in files if file.suffix == ".png"]
    assert {file.stem for file in pictures} == set(DRAWN)
    assert all(file.stat().st_size > 5_000 for file in pictures)
    assert sorted(runs) == RUNS
    assert len(RUNS) == physics.NUMBER_OF_RUNS
    assert done == [("physics", count, len(RUNS)) for count in range(1, len(RUNS) + 1)]
    assert {(row["scenario"], row["planner"]) for row in rows} == set(RUNS)
    table = (folder / "physics.md").read_text()
    assert "| blocks | centralized |" in table
    assert "![figure-25](figure-25.png)" in table
