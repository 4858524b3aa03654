"""Fuzzes the texts that describe a run of bar carriers, as `palanquin demo bar` takes them."""

import json
from pathlib import Path

from fuzz.harness import SCRATCH, fuzz

from palanquin.problems.planning import Velocity
from palanquin.sim.scenarios import bar_texts as texts
from palanquin.sim.scenarios.bar_team import BarTeam
from palanquin.sim.scenarios.bars import BarScenario

SEED = {
    "payload": "5@0.3",
    "terrain": "rough:0.05",
    "velocity": "0.3,0,0.1/0.1/0",
    "forces": ["sin:20", "opposed:30", "push:0,60,0@3,3.5:1", "pull:0,-0.25@4,7"],
}
ROBOTS = 3


def read(path: Path) -> None:
    try:
        data = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        return
    if not isinstance(data, dict):
        return
    told = {key: data.get(key, value) for key, value in SEED.items()}
    mass, place = texts.parse_payload(str(told["payload"]))
    forces = told["forces"] if isinstance(told["forces"], list) else [told["forces"]]
    BarScenario(
        team=BarTeam(ROBOTS, payload=mass, payload_at=place),
        ground=texts.parse_ground(str(told["terrain"]), seed=1),
        velocity=Velocity(),
        velocities=texts.parse_velocities(str(told["velocity"])),
        forces=tuple(f for text in forces for f in texts.parse_force(str(text), ROBOTS)),
    )


if __name__ == "__main__":
    SCRATCH.mkdir(parents=True, exist_ok=True)
    seed = SCRATCH / "bar-seed.json"
    seed.write_text(json.dumps(SEED))
    watch = ("palanquin.sim.scenarios",)
    fuzz(read, [seed], ".json", json.loads, lambda data: json.dumps(data).encode(), watch)
