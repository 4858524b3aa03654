"""Height maps: values, slopes, normals."""

import casadi as ca
import numpy as np
import pytest

from palanquin.errors import ProblemError
from palanquin.problems import terrains

SHAPES = [
    terrains.Flat(0.2),
    terrains.Plane(0.1, 0.3, -0.2),
    terrains.Ramp(height=1.6, slope=0.8, x=3.0),
    terrains.Formula(lambda x, y: 0.05 * ca.sin(3 * x) * y),
    terrains.Formula(lambda x, y, top: top * ca.exp(-(x**2) - y**2), {"top": np.array([0.3])}),
]


@pytest.mark.parametrize("shape", SHAPES)
def test_gradient_and_normal_against_differences(shape):
    x, y = np.meshgrid(np.linspace(-1, 4, 7), np.linspace(-1, 1, 5))
    step = 1e-6
    slope_x = (shape.height(x + step, y) - shape.height(x - step, y)) / (2 * step)
    slope_y = (shape.height(x, y + step) - shape.height(x, y - step)) / (2 * step)
    gradient = shape.gradient(x, y)
    assert gradient.shape == (5, 7, 2)
    np.testing.assert_allclose(gradient, np.stack([slope_x, slope_y], -1), atol=1e-8)
    normal = shape.normal(x, y)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=-1), 1.0)
    np.testing.assert_allclose(normal[..., 0] + normal[..., 2] * gradient[..., 0], 0, atol=1e-14)


def test_ramp_is_the_papers_logistic():
    x = np.linspace(-3, 9, 50)
    expected = 1.6 / (1 + np.exp(-4 / 1.6 * 0.8 * (x - 3.0)))
    ramp = terrains.Ramp(height=1.6, slope=0.8, x=3.0)
    np.testing.assert_allclose(ramp.height(x, 0.0), expected, atol=1e-12)
    assert ramp.gradient(3.0, 0.0)[0] == pytest.approx(0.8)


def test_ramp_is_finite_far_away():
    ramp = terrains.Ramp(height=0.1, slope=5.0, x=0.0)
    x = np.array([-1e4, 1e4])
    np.testing.assert_allclose(ramp.height(x, 0.0), [0.0, 0.1])
    np.testing.assert_array_equal(ramp.gradient(x, 0.0), 0.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: terrains.Flat(float("nan")), r"terrain: z0, ax, ay\[0\] is nan"),
        (lambda: terrains.Plane(0, float("inf")), r"terrain: z0, ax, ay\[1\] is inf"),
        (lambda: terrains.Ramp(0.0, 0.8, 3.0), "terrain.height is 0.0; it must be positive"),
        (lambda: terrains.Ramp("high", 0.8, 3.0), "terrain.height is 'high'; a number is needed"),
    ],
)
def test_invalid_terrains_are_refused(make, message):
    with pytest.raises(ProblemError, match=message):
        make()
