"""The layered paper's figures from full physics, each drawn from one short run on flat ground."""

from palanquin.benchmarks.layered import physics
from palanquin.sim.bar.planners import build_planner
from palanquin.sim.bar.run import run
from palanquin.sim.bar.scenario import BarScenario


def test_every_figure_is_drawn(tmp_path, monkeypatch):
    short = BarScenario(duration=0.3)
    result = run(short, build_planner(short))
    monkeypatch.setattr(physics, "build_planner", lambda scenario: None)
    monkeypatch.setattr(physics, "run", lambda scenario, planner: result)
    done = []
    rows, files = physics.reproduce_physics(
        tmp_path, progress=lambda part, count, total: done.append((part, count, total))
    )
    pictures = [file for file in files if file.suffix == ".png"]
    assert {file.stem for file in pictures} == {
        f"figure-{number}" for number in (10, 12, 13, 14, 15, 16, 17, 18, 20, 24, 25)
    }
    assert all(file.stat().st_size > 5_000 for file in pictures)
    total = physics.NUMBER_OF_RUNS
    assert done == [("physics", count, total) for count in range(1, total + 1)]
    assert {row["scenario"] for row in rows} == set(physics.SCENARIOS)
    table = (tmp_path / "physics.md").read_text()
    assert "| blocks | centralized |" in table
    assert "![figure-25](figure-25.png)" in table
