"""Figures 8, 9, 22 and 23 of Kim et al. on the reduced-order plant."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from palanquin.benchmarks.layered.runs import reduced_loop
from palanquin.benchmarks.layered.survival import tilts
from palanquin.problems.layered import VARIANTS, LinkSettings
from palanquin.sim.runs.record import Record

mpl.use("Agg")

_BIASES = (48.0, 58.0)  # N/m, Figure 23
_BIAS_START = 1.0  # s
# Multipliers agree when, over the last seconds, they differ by less than this on average.
_AGREED, _LATE = 5.0, 2.0  # N/m, s


@dataclass(frozen=True)
class Drawn:
    """A figure's file, and what it shows in numbers."""

    file: Path
    numbers: dict[str, Any]


def draw_all(folder: Path, weights: str, duration: float) -> Iterator[Drawn]:
    """Runs and draws all figures with the given weights."""
    for draw in (draw_figure8, draw_figure9, draw_figure22, draw_figure23):
        yield draw(folder, weights, duration)


def draw_figure8(folder: Path, weights: str, duration: float) -> Drawn:
    """Desired and actual velocities: nominal without payload, the others with 5 kg."""
    logs = {
        f"{planner} ({kg:g} kg)": reduced_loop(name, duration, planner, weights).run()
        for planner, kg, name in (
            ("nominal", 0.0, "none"), ("centralized", 5.0, "payload-5"),
            ("distributed", 5.0, "payload-5"),
        )
    }  # fmt: skip
    figure = Figure(figsize=(12, 3.4), layout="constrained")
    for axis, (name, log) in zip(figure.subplots(1, 3, sharey=True), logs.items(), strict=True):
        _plot_velocities(axis, log, name)
    return _save(
        figure, folder, f"figure8-{weights}", {n: _summary(log) for n, log in logs.items()}
    )


def draw_figure9(folder: Path, weights: str, duration: float) -> Drawn:
    """Unequal commands, 0.15 and 0 m/s: velocities, and where the robots go."""
    log = reduced_loop("unequal", duration, weights=weights).run()
    figure = Figure(figsize=(9, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    _plot_velocities(left, log, "distributed, commands 0.15 and 0 m/s")
    for i in range(2):
        path = log.bodies[:, i, :2].T
        right.plot(*path, color=f"C{i}", label=f"robot {i + 1}")
    right.set(xlabel="x (m)", ylabel="y (m)", title="centres of mass", aspect="equal")
    right.legend()
    return _save(figure, folder, f"figure9-{weights}", {"distributed": _summary(log)})


def draw_figure22(folder: Path, weights: str, duration: float) -> Drawn:
    """Both robots' estimates of the multiplier, and the plant's, under a slow load."""
    log = reduced_loop("slow", duration, weights=weights).run()
    figure = Figure(figsize=(7, 3.4), layout="constrained")
    axis = figure.subplots()
    _plot_estimates(axis, log)
    axis.set_title("distributed, 5 kg, sinusoids of 10 N and 2 to 5 s")
    numbers = _summary(log) | {"disagreement_n_per_m": _disagreement(log)}
    return _save(figure, folder, f"figure22-{weights}", {"distributed": numbers})


def draw_figure23(folder: Path, weights: str, duration: float) -> Drawn:
    """A constant bias in what robot 2 hears of robot 1's multiplier, from 1 s on."""
    figure = Figure(figsize=(11, 3.4), layout="constrained")
    numbers = {}
    for axis, bias in zip(figure.subplots(1, 2), _BIASES, strict=True):
        start = round(_BIAS_START / VARIANTS[weights].dt)
        links = {(0, 1): LinkSettings(bias=bias, bias_from=start)}
        log = reduced_loop("none", duration, weights=weights, links=links).run()
        _plot_estimates(axis, log)
        axis.axvline(_BIAS_START, color="gray", linestyle=":")
        axis.set_title(f"bias {bias:g} N/m from {_BIAS_START:g} s on")
        gap = _disagreement(log)
        numbers[f"bias {bias:g} N/m"] = _summary(log) | {
            "disagreement_n_per_m": gap, "agree": bool(not log.fall and gap < _AGREED),
        }  # fmt: skip
    return _save(figure, folder, f"figure23-{weights}", numbers)


def _look(robot: int) -> dict[str, Any]:
    """Later robots are dashed: those of a symmetric run lie on top of each other."""
    return {"color": f"C{robot}", "linestyle": "-" if robot == 0 else "--", "linewidth": 1.2}


def _plot_velocities(axis: Any, log: Record, title: str) -> None:
    for i in range(log.robots):
        axis.plot(log.time, log.bodies[:, i, 7], label=f"robot {i + 1}", **_look(i))
        axis.axhline(log.references[-1, i, 7], color=f"C{i}", linestyle=":", linewidth=1)
    if log.fall:
        axis.axvline(log.duration, color="black", label="fall")
    axis.set(xlabel="time (s)", ylabel="forward velocity (m/s)", title=title, ylim=(-0.5, 0.8))
    axis.legend(loc="lower right")


def _plot_estimates(axis: Any, log: Record) -> None:
    estimates, multipliers = log.more["estimates"], log.more["multipliers"]
    for i in range(log.robots):
        label = f"robot {i + 1}'s estimate"
        axis.plot(log.time, estimates[:, i, 0], label=label, **_look(i))
    axis.plot(log.time, multipliers[:, 0], color="gray", linewidth=0.7, label="plant")
    axis.margins(y=0.25)  # for the legend
    axis.set(xlabel="time (s)", ylabel="multiplier (N/m)")
    axis.legend(loc="upper right", ncols=3)


def _disagreement(log: Record) -> float:
    late = log.time >= log.time[-1] - _LATE
    estimates = log.more["estimates"][late]
    return float(np.abs(estimates[:, 0, 0] - estimates[:, 1, 0]).mean())


def _summary(log: Record) -> dict[str, Any]:
    error = (log.bodies - log.references)[log.time >= 2.0][..., 7:9]
    return {
        "fell_at_s": log.duration if log.fall else None,
        "velocity_error_rms": float(np.sqrt(np.mean(error**2))) if error.size else None,
        "tilt_max_deg": float(np.degrees(tilts(log).max())),
        "length_error_m": log.extremes["bar_length_error_m"],
        "failures": len(log.events),
    }


def _save(figure: Figure, folder: Path, name: str, numbers: Mapping[str, Any]) -> Drawn:
    file = folder / f"{name}.png"
    figure.savefig(file, dpi=110)
    return Drawn(file, dict(numbers))
