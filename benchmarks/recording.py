"""Rates as a Rerun recording (needs the extra `viz`)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from palanquin.benchmarks.tables import solver_of
from palanquin.errors import ProblemError

Row = dict[str, Any]


def record(rows: list[Row], path: Path) -> None:
    """Writes `path` (.rrd): `solver/<R> robots/<start>/<variant>/p50_ms` and `/p99_ms`.

    Its timeline `horizon` counts intervals. Raises ProblemError when rerun-sdk is not installed.
    """
    try:
        import rerun as rr
    except ModuleNotFoundError as error:
        raise ProblemError(
            "--rrd: rerun-sdk is not installed; `pip install palanquin[viz]` adds it"
        ) from error
    recording = rr.RecordingStream("palanquin-bench")
    recording.save(path)
    series: dict[str, list[Row]] = {}
    for row in rows:
        if row["solve_ms"] and not row["ditches"]:
            entity = f"solver/{row['robots']} robots/{row['start']}/{solver_of(row).label}"
            series.setdefault(entity.replace(",", "").replace(" ", "_"), []).append(row)
    for entity, points in series.items():
        points.sort(key=lambda row: row["horizon"])
        time = rr.TimeColumn("horizon", sequence=[row["horizon"] for row in points])
        for quantile in ("p50", "p99"):
            values = [row["solve_ms"][quantile] for row in points]
            recording.send_columns(
                f"{entity}/{quantile}_ms", [time], rr.Scalars.columns(scalars=values)
            )
    recording.disconnect()
