"""Lowered small problems, compiled once a session in a cache of its own; programs of users."""

import os
import sys
import sysconfig
from pathlib import Path

import pytest
from support.programs import run
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


@pytest.fixture(scope="session")
def consumer(tmp_path_factory):
    """The executable of the CMake project in consumer/, built against the installed package; the
    project's other programs lie beside it.
    """
    build = tmp_path_factory.mktemp("consumer")
    tools = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    source = Path(__file__).with_name("consumer")
    installed = Path(sysconfig.get_path("platlib")) / "palanquin"
    run("cmake", "-S", source, "-B", build, f"-Dpalanquin_ROOT={installed}", env=tools)
    run("cmake", "--build", build, env=tools)
    return build / "consumer"
