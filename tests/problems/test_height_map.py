"""Height maps: through the samples, smooth between them, and clear about bad ones."""

import casadi as ca
import matplotlib.image
import numpy as np
import pytest

from palanquin.errors import ProblemError
from palanquin.problems import clm
from palanquin.problems.height_map import HeightMap
from palanquin.problems.height_map_files import read_heights

RANDOM = np.random.default_rng(0)
SAMPLES = RANDOM.uniform(-0.1, 0.1, (9, 12))
MAP = HeightMap(SAMPLES, origin=(-1.0, 2.0), spacing=0.1)
STEP = 1e-6


def points(count, beyond=0.5):
    return RANDOM.uniform([-1 - beyond, 2 - beyond], [0.1 + beyond, 2.8 + beyond], (count, 2))


def test_it_passes_through_all_samples():
    x, y = np.meshgrid(-1 + 0.1 * np.arange(12), 2 + 0.1 * np.arange(9))
    np.testing.assert_allclose(MAP.height(x, y), SAMPLES, atol=1e-14)


def test_gradient_is_that_of_the_height():
    x, y = points(200).T
    differences = np.stack(
        [
            MAP.height(x + STEP, y) - MAP.height(x - STEP, y),
            MAP.height(x, y + STEP) - MAP.height(x, y - STEP),
        ],
        axis=-1,
    ) / (2 * STEP)
    np.testing.assert_allclose(MAP.gradient(x, y), differences, atol=1e-8)
    for xy in points(5):
        np.testing.assert_allclose(MAP.slope(*xy), MAP.gradient(*xy), atol=1e-14)


def test_slope_and_curvature_are_continuous_across_cells():
    """On both sides of every line of the grid, and at the edges of the map."""
    lines = -1 + 0.1 * np.arange(-9, 21)
    for y in RANDOM.uniform(1.8, 3.0, 5):
        middle = np.stack([lines, np.full_like(lines, y), 0 * lines], axis=-1)
        sides = [middle + side * np.array([1e-9, 0, 0]) for side in (-1, 1)]
        left, right = (MAP.around(side)["surface"] for side in sides)
        np.testing.assert_allclose(left, right, atol=1e-5)


def test_far_beyond_its_edges_it_goes_on_as_it_ends_there():
    assert MAP.gradient(-30.0, 2.4)[0] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(MAP.gradient(-30.0, -30.0), 0.0, atol=1e-12)
    assert MAP.height(-30.0, 0.0) == pytest.approx(MAP.height(-9.0, -7.0), abs=1e-12)
    assert np.isfinite(MAP.height(1e6, -1e6))


def test_expression_has_height_slope_and_curvature_of_the_map():
    xy = ca.SX.sym("xy", 2)
    for x, y in points(10):
        values = {name: ca.DM(v) for name, v in MAP.around(np.array([x, y, 0.0])).items()}
        z = MAP.expression(xy[0], xy[1], values)
        expanded = ca.Function("z", [xy], [z, ca.gradient(z, xy), ca.hessian(z, xy)[0]])
        height, slope, curvature = (np.array(v).squeeze() for v in expanded([x, y]))
        assert height == pytest.approx(MAP.height(x, y), abs=1e-14)
        np.testing.assert_allclose(slope, MAP.gradient(x, y), atol=1e-12)
        gradient = [
            (MAP.gradient(x + dx, y + dy) - MAP.gradient(x - dx, y - dy)) / (2 * STEP)
            for dx, dy in ((STEP, 0.0), (0.0, STEP))
        ]
        np.testing.assert_allclose(curvature, gradient, atol=1e-5)


def test_trend_is_flatter_and_its_own_trend():
    trend = MAP.trend
    assert np.ptp(trend.heights) < 0.5 * np.ptp(SAMPLES)
    assert trend.trend is trend
    plane = HeightMap(np.tile(np.arange(40.0), (40, 1)), spacing=0.1).trend
    np.testing.assert_allclose(plane.heights[20, 10:30], np.arange(10.0, 30.0), atol=1e-9)


def with_hole(value, row=3, column=5):
    samples = SAMPLES.copy()
    samples[row, column] = value
    return samples


@pytest.mark.parametrize(
    ("heights", "options", "message"),
    [
        (with_hole(np.nan), {}, "row 3, column 5 is nan"),
        (with_hole(np.inf), {}, "row 3, column 5 is inf"),
        (np.full((2, 2), np.nan), {}, "row 0, column 0 is nan, and 3 more"),
        (np.zeros((1, 5)), {}, r"shape \(1, 5\)"),
        (np.zeros(5), {}, r"shape \(5,\)"),
        ([["a", "b"], ["c", "d"]], {}, "not an array of numbers"),
        (SAMPLES, {"spacing": 0.0}, "spacing is 0.0"),
        (SAMPLES, {"origin": (0.0, np.nan)}, "origin"),
    ],
)
def test_bad_maps_say_what_is_wrong(heights, options, message):
    with pytest.raises(ProblemError, match=message):
        HeightMap(heights, **options)


def test_files_of_all_kinds(tmp_path):
    np.save(tmp_path / "map.npy", SAMPLES)
    np.savez(tmp_path / "map.npz", heights=SAMPLES)
    np.savetxt(tmp_path / "map.csv", SAMPLES, delimiter=",", fmt="%.17g")
    for suffix in ("npy", "npz", "csv"):
        np.testing.assert_array_equal(read_heights(tmp_path / f"map.{suffix}"), SAMPLES)
    grey = np.linspace(0, 1, 12).reshape(3, 4)
    matplotlib.image.imsave(tmp_path / "map.png", grey[::-1], cmap="gray", vmin=0, vmax=1)
    heights = read_heights(tmp_path / "map.png", black=-0.2, white=0.3)
    np.testing.assert_allclose(heights, -0.2 + 0.5 * grey, atol=0.5 / 255)


def test_files_that_are_none(tmp_path):
    (tmp_path / "map.csv").write_text("1,2\n3,\n")
    with pytest.raises(ProblemError, match="row 1, column 1 is nan"):
        HeightMap(read_heights(tmp_path / "map.csv"))
    (tmp_path / "ragged.csv").write_text("1,2\n3\n")
    (tmp_path / "map.png").write_bytes(b"no picture")
    (tmp_path / "map.npy").write_bytes(b"\x93NUMPY cut off")
    np.savez(tmp_path / "other.npz", altitude=SAMPLES)
    for name in ("ragged.csv", "map.png", "map.npy", "other.npz", "missing.npy"):
        with pytest.raises(ProblemError, match=f"{name}: not a height map"):
            read_heights(tmp_path / name)
    matplotlib.image.imsave(tmp_path / "colour.png", SAMPLES, cmap="viridis")
    with pytest.raises(ProblemError, match="colours"):
        read_heights(tmp_path / "colour.png")
    with pytest.raises(ProblemError, match=r"map.tif: .*\.npy, \.npz, \.csv, \.png"):
        read_heights(tmp_path / "map.tif")


def test_maps_of_other_sizes_share_the_compiled_code(team):
    lowered = clm.build_clm(team, terrain=MAP).lower()
    other = HeightMap(RANDOM.uniform(size=(30, 5)), origin=(3.0, 4.0), spacing=0.02)
    again = clm.build_clm(team, terrain=other).lower()
    assert again.report.cache_hit
    assert again.report.path == lowered.report.path


def test_planned_footholds_are_on_the_map(team):
    planner = clm.Planner(clm.build_clm(team, terrain=MAP), MAP)
    state = planner.nominal_state()
    plan = planner.settle(0.0, state, clm.Velocity(0.3))
    feet = plan.feet[plan.contacts[:-1]]
    np.testing.assert_allclose(feet[:, 2], MAP.height(feet[:, 0], feet[:, 1]), atol=1e-5)


def test_a_planner_refuses_a_terrain_of_another_kind(problem):
    with pytest.raises(ProblemError, match="no local parameter 'centre'"):
        clm.Planner(problem, MAP)
