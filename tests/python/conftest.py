"""Lowered small problems, compiled once a session in a cache of its own."""

import pytest
from support.small_problems import LIBRARY

import palanquin as pq


@pytest.fixture(scope="session")
def session_cache(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="session")
def lowered_once(session_cache):
    """Lowers a problem of the library by name, once."""
    kept: dict[str, pq.Lowered] = {}

    def lower(name: str) -> pq.Lowered:
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("PALANQUIN_CACHE", str(session_cache))
            if name not in kept:
                kept[name] = LIBRARY[name].build().lower()
            return kept[name]

    return lower


@pytest.fixture
def lowered(lowered_once, session_cache, monkeypatch):
    """The same, with further libraries of the problem going to the session's cache too."""
    monkeypatch.setenv("PALANQUIN_CACHE", str(session_cache))
    return lowered_once
