"""Finished rows on disk, so that a measurement that was cut off can go on."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from palanquin.errors import ProblemError
from palanquin.user_files import read_text

Row = dict[str, Any]


class RowStore:
    """A file with one finished row a line.

    Rows that were measured under other conditions are not taken up again.

    Args:
        file: rows are appended there.
        conditions: what makes rows comparable, for example steps, seed and revision.
        resume: keep rows that are there already; otherwise the file is begun anew.

    Raises:
        ProblemError: `resume` and the file holds something else.
    """

    def __init__(self, file: Path, conditions: dict[str, Any], resume: bool) -> None:
        self._file = file
        self._conditions = json.loads(json.dumps(conditions))
        self._rows: dict[str, Row] = {}
        if resume and file.exists():
            self._rows = self._read()
        elif file.exists():
            file.unlink()

    def __contains__(self, key: str) -> bool:
        return key in self._rows

    def __getitem__(self, key: str) -> Row:
        return self._rows[key]

    @property
    def rows(self) -> list[Row]:
        """All rows, in the order in which they were added."""
        return list(self._rows.values())

    def add(self, key: str, row: Row) -> None:
        """Keeps a finished row."""
        self._rows[key] = row
        entry = {"key": key, "conditions": self._conditions, "row": row}
        with self._file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(entry, allow_nan=False) + "\n")

    def _read(self) -> dict[str, Row]:
        """Rows under our conditions; a last line that was cut off is taken out of the file."""
        rows = {}
        try:
            lines = read_text(self._file).splitlines()
        except ValueError as error:
            raise ProblemError(f"{self._file}: {error}") from error
        for number, line in enumerate(lines, start=1):
            try:
                key, conditions, row = _parts(json.loads(line))
            except (ValueError, TypeError, KeyError, RecursionError) as error:
                if number == len(lines) and isinstance(error, ValueError):
                    text = "".join(f"{whole}\n" for whole in lines[:-1])
                    self._file.write_text(text, encoding="utf-8")
                    break
                raise ProblemError(
                    f"{self._file}, line {number} is not a row of results; "
                    "delete the file, or go on in another one"
                ) from error
            if conditions == self._conditions:
                rows[key] = row
        return rows


def _parts(entry: dict[str, Any]) -> tuple[str, Any, Row]:
    """Key, conditions and row; raises KeyError or TypeError for anything else."""
    key, conditions, row = entry["key"], entry["conditions"], entry["row"]
    if not (isinstance(key, str) and isinstance(row, dict)):
        raise TypeError("a key in words and a row of figures are needed")
    return key, conditions, row
