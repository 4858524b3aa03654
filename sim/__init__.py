"""Scenes, kinematic tracking, recordings and pictures of a planned team."""
