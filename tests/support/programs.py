"""Programs that tests run."""

import subprocess
from pathlib import Path


def run(*command: str | Path, **options) -> str:
    """Run a command and return what it prints; fail with all of its output."""
    result = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout
