"""Files of the tests, in all formats, with the same record in each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.io import savemat

RNG = np.random.default_rng(0)
TIME = 0.001 * np.arange(200)
ROAD, TRAVEL = RNG.normal(size=200), RNG.normal(size=200)


def as_csv(path: Path, text: str | None = None) -> None:
    rows = [f"{t!r},{r!r},{y!r}" for t, r, y in zip(*map(np.ndarray.tolist, data()), strict=True)]
    path.write_text(text or "\n".join(["time [s],road [mm],travel (mm)", *rows]), encoding="utf-8")


def data() -> tuple[np.ndarray, ...]:
    return TIME, ROAD, TRAVEL


def as_parquet(path: Path) -> None:
    pq.write_table(
        pa.table(dict(zip(("time", "road [mm]", "travel [mm]"), data(), strict=True))), path
    )


def as_hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        for name, values in zip(("time", "road", "travel"), data(), strict=True):
            file[name] = values
            file[name].attrs["unit"] = "s" if name == "time" else "mm"


def as_mat(path: Path) -> None:
    savemat(path, {"time": TIME[:, None], "road": ROAD, "travel": TRAVEL[None, :], "fs": 1000.0})


def as_new_mat(path: Path) -> None:
    """As MATLAB writes version 7.3: HDF5 behind 512 bytes, arrays with their axes reversed."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in zip(("time", "road", "travel"), data(), strict=True):
            file[name] = values[None, :]


FORMATS: dict[str, tuple[str, Callable[[Path], None]]] = {
    "csv": ("a.csv", as_csv),
    "parquet": ("a.parquet", as_parquet),
    "hdf5": ("a.h5", as_hdf5),
    "mat": ("a.mat", as_mat),
    "mat 7.3": ("a.mat", as_new_mat),
}
