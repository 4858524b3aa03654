"""Scenes: robots, payloads and ground as MuJoCo models, and joints that put them in place."""
