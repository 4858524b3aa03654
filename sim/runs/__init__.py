"""Runs: one loop of plant and planner, one record, one outcome."""
