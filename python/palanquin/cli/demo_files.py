"""The files of a demo: figures, recording, picture, video and plots."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palanquin.cli.console import check_writable, err, prepare_folder, write_json, writing
from palanquin.sim.errors import GraphicsError, MissingExtraError
from palanquin.sim.show.render import Motion, render_picture, render_video

PICTURE_SHARE = 0.62
"""When in a run the picture is taken, as a share of its duration: under way, mid-stride."""


@dataclass(frozen=True)
class DemoFiles:
    """Where a demo writes; the video may be left out.

    `recording`, `figures` (JSON), `picture`, `video` and `plots` are the files' paths.
    """

    recording: Path
    figures: Path
    picture: Path
    video: Path | None
    plots: Path

    @staticmethod
    def prepare(
        name: str, out: Path, rrd: Path | None, figures: Path | None, has_video: bool
    ) -> DemoFiles:
        """Files in `out`/`name`, which is created, unless told otherwise.

        Raises ValueError for a place where nothing can be written.
        """
        check_writable("--rrd", rrd)
        check_writable("--json", figures)
        prepare_folder("--out", out)
        folder = out / name
        prepare_folder("--out", folder)
        return DemoFiles(
            recording=rrd or folder / f"{name}.rrd",
            figures=figures or folder / f"{name}.json",
            picture=folder / f"{name}.png",
            video=folder / f"{name}.mp4" if has_video else None,
            plots=folder / "figures.png",
        )

    def write(
        self,
        figures: dict[str, Any],
        plot: Callable[[Path], None],
        record: Callable[[Path], None],
        motion: Motion,
        progress: Callable[[float], None],
        picture_share: float = PICTURE_SHARE,
    ) -> dict[str, Path]:
        """Writes what can be written here and says what can't; returns the files by their kind.

        `plot` and `record` write the plots and the recording to a path; `motion` is drawn,
        as a picture after `picture_share` of its duration.
        """
        write_json("--json", self.figures, figures, indent=2)
        with writing("--out", self.plots):
            plot(self.plots)
        written = {"figures": self.figures, "plots": self.plots}
        try:
            with writing("--rrd", self.recording):
                record(self.recording)
            written["recording"] = self.recording
        except MissingExtraError as error:
            err.print(f"no recording: {error}", markup=False, style="yellow")
        try:
            time = picture_share * motion.time[-1]
            with writing("--out", self.picture):
                render_picture(motion, self.picture, time)
            written["picture"] = self.picture
            if self.video is not None:
                with writing("--out", self.video):
                    render_video(motion, self.video, progress=progress)
                written["video"] = self.video
        except GraphicsError as error:
            err.print(f"no picture, no video: {error}", markup=False, style="yellow")
        return written
