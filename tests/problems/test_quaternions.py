"""Array quaternions against rotation matrices and against the CasADi ones."""

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palanquin import quaternion
from palanquin.problems import quaternions


@pytest.fixture
def random_pair():
    rng = np.random.default_rng(3)
    q = rng.normal(size=(5, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True), rng.normal(size=(5, 3))


def scipy_rotation(q):
    return Rotation.from_quat(np.roll(q, -1, axis=-1))


def test_rotation_agrees_with_matrices(random_pair):
    q, v = random_pair
    np.testing.assert_allclose(quaternions.rotate(q, v), scipy_rotation(q).apply(v), atol=1e-14)
    np.testing.assert_allclose(
        quaternions.rotate_inverse(q, v), scipy_rotation(q).inv().apply(v), atol=1e-14
    )


def test_product_composes_rotations(random_pair):
    q, v = random_pair
    product = quaternions.multiply(q, q[::-1])
    twice = quaternions.rotate(q, quaternions.rotate(q[::-1], v))
    np.testing.assert_allclose(quaternions.rotate(product, v), twice, atol=1e-14)


def test_symbolic_and_array_versions_agree(random_pair):
    q, v = random_pair
    for qi, vi in zip(q, v, strict=True):
        symbolic = ca.DM(quaternion.rotate(ca.DM(qi), ca.DM(vi)))
        np.testing.assert_allclose(quaternions.rotate(qi, vi), np.array(symbolic)[:, 0], atol=1e-14)


@pytest.mark.parametrize("scale", [0.0, 1e-9, 1.0, 3.0])
def test_exponential(scale):
    v = scale * np.array([0.36, -0.48, 0.8])
    expected = np.roll(Rotation.from_rotvec(v).as_quat(), 1)
    np.testing.assert_allclose(quaternions.from_rotation_vector(v), expected, atol=1e-14)


def test_products_agree_with_matrices(random_pair):
    q, _ = random_pair
    product = scipy_rotation(quaternions.multiply(q[:-1], q[1:])).as_matrix()
    np.testing.assert_allclose(
        product, quaternions.matrix(q[:-1]) @ quaternions.matrix(q[1:]), atol=1e-14
    )
    np.testing.assert_allclose(quaternions.matrix(q), scipy_rotation(q).as_matrix(), atol=1e-14)


@pytest.mark.parametrize("scale", [0.0, 1e-9, 1.0, 3.0])
def test_rotation_vectors_are_recovered(scale):
    v = scale * np.array([0.36, -0.48, 0.8])
    q = quaternions.from_rotation_vector(v)
    np.testing.assert_allclose(quaternions.rotation_vector(q), v, atol=1e-14)
    np.testing.assert_allclose(quaternions.rotation_vector(-q), v, atol=1e-14)


def test_headings_lie_on_the_slope_by_the_smallest_tilt():
    slope, yaw = np.array([[0.3, -0.2], [0.0, 0.0], [-1.0, 2.0]]), np.array([0.0, 2.0, -1.5])
    normal = np.column_stack([-slope, np.ones(3)])
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    tilt = quaternions.on_slope(slope, np.zeros(3))
    np.testing.assert_allclose(quaternions.rotate(tilt, [0, 0, 1]), normal, atol=1e-14)
    np.testing.assert_array_equal(tilt[:, 3], 0)  # no turn about z
    np.testing.assert_allclose(2 * np.arccos(tilt[:, 0]), np.arccos(normal[:, 2]), atol=1e-14)
    turned = quaternions.multiply(tilt, quaternions.from_yaw(yaw))
    np.testing.assert_allclose(quaternions.on_slope(slope, yaw), turned, atol=1e-14)


def test_yaw_is_recovered():
    np.testing.assert_allclose(quaternions.yaw_of(quaternions.from_yaw([-2.0, 0.3])), [-2.0, 0.3])


def test_continuous_chooses_signs_that_do_not_jump():
    angle = np.linspace(0, 3 * np.pi, 40)
    smooth = quaternions.from_rotation_vector(angle[:, None] * np.array([0.6, 0.0, 0.8]))
    signs = np.where(np.arange(40) % 3 == 0, -1.0, 1.0)[:, None]
    np.testing.assert_array_equal(quaternions.continuous(signs * smooth, smooth[0]), smooth)
    np.testing.assert_array_equal(quaternions.continuous(signs * smooth, -smooth[0]), -smooth)
