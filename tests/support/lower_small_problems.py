"""lower_small_problems.py FOLDER NAME...: lowers problems of the library for the C++ tests.

Leaves NAME, NAME-exact.so and NAME.txt in FOLDER: the saved problem, the library of its exact
Hessians, and the parameters, measured knot and guess, each as its number of rows and columns and
then its values.
"""

import logging
import os
import shutil
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from support.small_problems import LIBRARY


def main() -> None:
    folder, names = Path(sys.argv[1]), sys.argv[2:]
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    os.environ["PALANQUIN_CACHE"] = str(folder / "cache")
    for name in names:
        lowered = LIBRARY[name].build().lower()
        lowered.save(folder / name)
        shutil.copy(lowered.library("exact"), folder / f"{name}-exact.so")
        with (folder / f"{name}.txt").open("w") as file:
            for array in LIBRARY[name].inputs(lowered):
                matrix = np.atleast_2d(array.values)
                file.write(f"{matrix.shape[0]} {matrix.shape[1]}\n")
                np.savetxt(file, matrix, fmt="%.17g")


if __name__ == "__main__":
    main()
