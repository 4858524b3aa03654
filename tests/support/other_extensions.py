"""A pytest plugin: the C++ extensions out of the folder $PALANQUIN_EXTENSIONS instead of those that
are installed, say such as were built with sanitizers.
"""

import os
import sys
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import spec_from_file_location
from pathlib import Path

import pytest


class OtherExtensions(MetaPathFinder):
    """Finds palanquin._core and palanquin._sim in `folder`, which must have both."""

    def __init__(self, folder: Path) -> None:
        self.files = {}
        for name in ("_core", "_sim"):
            (self.files[f"palanquin.{name}"],) = folder.glob(f"{name}.*.so")

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        file = self.files.get(fullname)
        return None if file is None else spec_from_file_location(fullname, file)


def pytest_configure(config: pytest.Config) -> None:
    finder = OtherExtensions(Path(os.environ["PALANQUIN_EXTENSIONS"]).resolve())
    sys.meta_path.insert(0, finder)
    from palanquin import _core, _sim

    assert {_core.__file__, _sim.__file__} == set(map(str, finder.files.values()))
