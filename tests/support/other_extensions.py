"""A pytest plugin: the C++ extensions out of the folder $PALANQUIN_EXTENSIONS instead of those that
are installed, say such as were built with sanitizers.
"""

import importlib
import os
import sys
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import spec_from_file_location
from pathlib import Path

import pytest


class OtherExtensions(MetaPathFinder):
    """Finds palanquin._core and palanquin._sim in `folder`, which may lack the second."""

    def __init__(self, folder: Path) -> None:
        self.files = {}
        for name in ("_core", "_sim"):
            for file in folder.glob(f"{name}.*.so"):
                self.files[f"palanquin.{name}"] = file

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        file = self.files.get(fullname)
        return None if file is None else spec_from_file_location(fullname, file)


def pytest_configure(config: pytest.Config) -> None:
    finder = OtherExtensions(Path(os.environ["PALANQUIN_EXTENSIONS"]).resolve())
    sys.meta_path.insert(0, finder)
    assert "palanquin._core" in finder.files
    for name, file in finder.files.items():
        assert importlib.import_module(name).__file__ == str(file)
