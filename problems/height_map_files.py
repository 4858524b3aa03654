"""Height maps from files: NumPy arrays, tables of numbers and grey pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from palanquin.errors import ProblemError

SUFFIXES = (".npy", ".npz", ".csv", ".png")


def read_heights(path: Path, black: float = 0.0, white: float = 1.0) -> np.ndarray:
    """Samples [rows, columns], m, as a file has them; rows run along y from its smallest value.

    `.npy` holds the array, `.npz` has it as `heights`, `.csv` has a row a line with commas. A
    `.png` is grey: its darkest value stands for `black` and its brightest for `white`, m, and its
    lowest line of pixels is the first row, so that the picture shows the map from above.

    Raises:
        ProblemError: an unknown suffix, or a file that cannot be read as what its suffix says.
    """
    readers = {".npy": _read_npy, ".npz": _read_npz, ".csv": _read_csv, ".png": _read_grey}
    if path.suffix not in readers:
        raise ProblemError(f"{path}: a height map must be one of {', '.join(SUFFIXES)}")
    try:
        samples = readers[path.suffix](path)
    except Exception as error:  # a file of anything makes its parser raise anything
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise ProblemError(f"{path}: not a height map ({reason})") from error
    return black + (white - black) * samples if path.suffix == ".png" else samples


def _read_npy(path: Path) -> np.ndarray:
    return np.asarray(np.load(path, allow_pickle=False))


def _read_npz(path: Path) -> np.ndarray:
    with np.load(path, allow_pickle=False) as file:
        return np.asarray(file["heights"])


def _read_csv(path: Path) -> np.ndarray:
    """Empty fields are holes."""
    return np.genfromtxt(path, delimiter=",", ndmin=2)


def _read_grey(path: Path) -> np.ndarray:
    import matplotlib.image

    picture = matplotlib.image.imread(path)
    if picture.ndim == 3:
        colours = picture[..., :3]
        if np.ptp(colours, axis=-1).max() > 0:
            raise ValueError("the picture has colours; a grey one is needed")
        picture = colours[..., 0]
    return np.asarray(picture[::-1], dtype=float)
