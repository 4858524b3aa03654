"""Stairs, stones, planks and height maps in scenarios: shown, walked on, refused with reasons."""

import json

import numpy as np
import pytest

from palanquin.benchmarks import courses
from palanquin.problems.foothold_areas import FootholdArea, FootholdAreas
from palanquin.sim.errors import InputError
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import open_scenario
from palanquin.sim.scenarios.ground import kind_of
from palanquin.sim.scenes.area_prisms import prism
from palanquin.sim.scenes.scene import build_scene


def test_a_prism_is_closed_and_faces_outwards():
    corners, triangles = prism(FootholdArea.rectangle((1, 2), (0.4, 0.2), 0.3, 0.5, 0.1), -0.2)
    a, b, c = (corners[triangles[:, i]] for i in range(3))
    signed_volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    assert signed_volumes.sum() == pytest.approx(0.4 * 0.2 * 0.5)  # wrong if any faced inwards
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    assert {tuple(e) for e in edges} == {tuple(e[::-1]) for e in edges}


@pytest.mark.parametrize("name", ["stones", "stairs", "walkway"])
def test_shipped_scenarios_start_and_are_shown(name):
    scenario = open_scenario(name).changed(duration=0.5)
    scene = build_scene(scenario.scene)
    geoms = [scene.model.geom(i).name for i in range(scene.model.ngeom)]
    assert sum(geom.startswith("ground/") for geom in geoms) == len(scenario.ground.areas)
    rollout = run_scenario(scenario)
    assert rollout.violation["area"].max() < 1e-3
    assert json.loads(scenario.scene.to_json())["terrain"]["type"] in (name, "stones")


def test_courses_measure_how_far_feet_are_outside():
    scenario = courses.variant("stones", 3).changed(duration=0.4)
    assert scenario.terrain.seed == 3
    assert courses.run_course(scenario)["outside_m"] < 1e-3
    rollout = run_scenario(scenario)
    island = FootholdAreas((FootholdArea.rectangle((10.0, 0.0), (1.0, 9.0)),))
    farthest = 9.5 - rollout.feet[rollout.contact > 0.5][:, 0].min()
    assert courses.outside(island, rollout) == pytest.approx(farthest, abs=1e-6)


def test_a_height_map_from_a_file_is_a_ground(tmp_path):
    path = tmp_path / "map.npy"
    samples = np.random.default_rng(0).uniform(-0.03, 0.03, (40, 60))
    np.save(path, samples)
    terrain = {"type": "height_map", "file": str(path), "origin": [-2.0, -2.0], "spacing": 0.1}
    ground = kind_of(terrain).shape()
    assert ground.height(-2.0, -1.8) == pytest.approx(samples[2, 0])
    scene = build_scene(open_scenario("trot").changed(terrain=terrain).scene)
    assert scene.model.nhfield == 1


@pytest.mark.parametrize(
    ("terrain", "message"),
    [
        ({"type": "stairs", "steps": 0}, "terrain.steps"),
        ({"type": "stairs", "treads": 1}, "unknown key 'treads'"),
        ({"type": "stones", "size": 0.3}, "less than the pitch"),
        ({"type": "walkway", "lanes": []}, "lanes is empty"),
        ({"type": "areas", "areas": [{"corners": [[0, 0], [1, 0]]}]}, "areas"),
        ({"type": "areas", "areas": [{"corners": [[0, 0], [1, 0], [2, 0]]}]}, "convex"),
        ({"type": "height_map"}, "either a file or heights"),
        ({"type": "height_map", "file": "map.tif"}, "must be one of"),
        ({"type": "height_map", "heights": [[0.0, 1.0], [0.0]]}, "all need as many"),
        (
            {"type": "height_map", "heights": [[0.0, 1.0], [0.0, float("nan")]]},
            "row 1, column 1 is nan",
        ),
        ({"type": "swamp"}, "swamp"),
    ],
)
def test_bad_grounds_say_what_is_wrong(terrain, message):
    with pytest.raises(InputError, match=message):
        kind_of(terrain)
