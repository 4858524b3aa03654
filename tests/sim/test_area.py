"""The part of the ground that is drawn, and the ditches on it."""

import numpy as np
import pytest

from palanquin.sim.scenarios.team import Ditch, Member, Team
from palanquin.sim.scenes.area import Area
from palanquin.sim.scenes.ditch_strips import ditch_strips

AREA = Area(-2.0, 3.0, -1.0, 1.5)


@pytest.mark.parametrize("line", [(1, 0, -0.5), (0, 2, 0.5), (1, 0.2, -0.6), (-1, 1, 0.3)])
def test_segment_lies_on_the_line_and_ends_at_the_border(line):
    a, b, c = line
    for end in AREA.segment(a, b, c):
        assert a * end[0] + b * end[1] + c == pytest.approx(0, abs=1e-12)
        to_sides = [end[0] - AREA.x_min, AREA.x_max - end[0]]
        to_sides += [end[1] - AREA.y_min, AREA.y_max - end[1]]
        assert min(to_sides) == pytest.approx(0, abs=1e-12)


def test_line_beside_the_area_has_no_segment():
    assert AREA.segment(1, 0, 5) is None
    assert AREA.segment(0, 1, 5) is None
    assert AREA.segment(1, 1, 50) is None


def team(terrain):
    robot = Member("left", "laikago", (0.0, 0.0, 0.0))
    return Team((robot,), terrain=terrain, ditches=(Ditch(1, 0.2, -0.6, 0.25),))


def test_strip_has_the_ditch_width_on_flat_ground():
    strips = ditch_strips(team({"type": "flat", "z0": 0.3}), AREA)
    assert len(strips) == 3
    dark = strips[0]
    assert 2 * dark.half_size[1] == pytest.approx(0.25)
    assert dark.centre[2] + dark.half_size[2] == pytest.approx(0.301)


def test_pieces_follow_a_ramp():
    terrain = {"type": "ramp", "H": 1.0, "kappa": 0.5, "xg": 0.5}
    described = team(terrain)
    strips = ditch_strips(described, AREA)
    assert len(strips) > 60
    for strip in strips:
        height = described.ground.height(*strip.centre[:2])
        assert abs(strip.centre[2] - height) < 0.005


def test_surface_covers_the_area():
    ground = team({"type": "plane", "z0": 0.1, "ax": 0.2, "ay": 0.0}).ground
    surface = AREA.surface(ground, 0.5)
    assert surface.shape == (6, 11, 3)
    np.testing.assert_allclose(surface[0, 0], (-2.0, -1.0, -0.3))
    np.testing.assert_allclose(surface[-1, -1], (3.0, 1.5, 0.7))
