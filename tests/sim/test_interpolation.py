"""Interpolated states: the ticks themselves, the manifold, the shorter way round."""

import numpy as np

from palanquin.problems.quaternions import rotate
from palanquin.sim.show.interpolation import interpolate_poses, slerp


def about_z(angle):
    return np.array([np.cos(angle / 2), 0, 0, np.sin(angle / 2)])


def states(angles, positions):
    return np.array(
        [[*p, *about_z(a), *np.zeros(6)] for a, p in zip(angles, positions, strict=True)]
    )


def test_ticks_are_met_and_times_outside_are_clamped():
    time = np.array([0.0, 0.1, 0.3])
    x = states([0.0, 0.5, -0.2], [(0, 0, 0), (1, 2, 3), (2, 0, 0)])
    position, quaternion = interpolate_poses(time, x, np.array([-1.0, 0.0, 0.1, 0.3, 9.0]))
    ticks = [0, 0, 1, 2, 2]
    np.testing.assert_allclose(position[:, 0], x[ticks, :3], atol=1e-12)
    np.testing.assert_allclose(quaternion[:, 0], x[ticks, 3:7], atol=1e-12)


def test_a_rotation_is_at_constant_speed():
    share = np.linspace(0, 1, 11)
    turned = slerp(np.tile(about_z(0.2), (11, 1)), np.tile(about_z(1.4), (11, 1)), share)
    np.testing.assert_allclose(turned, [about_z(0.2 + 1.2 * s) for s in share], atol=1e-12)


def test_sign_of_a_quaternion_does_not_matter():
    share = np.array([0.5])
    same = slerp(about_z(0.2)[None], -about_z(1.4)[None], share)
    np.testing.assert_allclose(same[0], about_z(0.8), atol=1e-12)


def test_nearly_equal_orientations_stay_finite_and_unit():
    result = slerp(about_z(0.3)[None], about_z(0.3 + 1e-12)[None], np.array([0.5]))
    np.testing.assert_allclose(result[0], about_z(0.3), atol=1e-12)
    assert np.linalg.norm(result) == np.float64(1.0)


def test_single_tick_is_held():
    x = states([0.4], [(1, 2, 3)])
    position, quaternion = interpolate_poses(np.array([0.0]), x, np.array([0.0, 1.0]))
    np.testing.assert_allclose(position[:, 0], [(1, 2, 3)] * 2)
    np.testing.assert_allclose(quaternion[:, 0], [about_z(0.4)] * 2)


def test_rotate_turns_body_axes_to_world():
    np.testing.assert_allclose(
        rotate(about_z(np.pi / 2), np.array([1.0, 0, 0])), [0, 1, 0], atol=1e-15
    )
