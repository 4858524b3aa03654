"""Appendix A's comparison runs, and shows what it is for."""

from palanquin.benchmarks import ditch_formulations


def test_distance_is_feasible_where_squares_are_not(tmp_path):
    outcomes = ditch_formulations.compare(seeds=4, stiffnesses=(10.0, 1e3, 1e5))
    assert [o.formulation for o in outcomes] == ["distance"] * 3 + ["squared"] * 3
    near, far = outcomes[:3], outcomes[3:]
    assert all(o.solved == 1.0 for o in near)
    assert near[2].feasible == 1.0
    for one, other in zip(near[:2], far[:2], strict=True):
        assert one.depth_mm < other.depth_mm
    assert near[1].iterations <= far[1].iterations
    picture = tmp_path / "ditches.png"
    ditch_formulations.plot(outcomes, picture)
    assert picture.stat().st_size > 10_000
    assert ditch_formulations.to_rows(outcomes)[0]["stiffness"] == 10.0
