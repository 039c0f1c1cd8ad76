"""The models that nobody prepared, each with the frequencies at which its machine works."""

from __future__ import annotations

import importlib
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from slide_fmu.core.signals import FloatArray
from tests.python_fmus import write_python_fmu

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Model:
    """A Model is a file as a user writes it.

    Attributes:
        name: of the file, without suffix.
        kind: of the reference system, as recipes name it (``slide_fmu.systems.loading.KINDS``).
        band: lowest and highest frequency at which the machine works, in Hz.
        resonances: of the machine in Hz.
        ranges: lowest and highest values of inputs for which the file has none: the user types
            them, as ``--input NAME=LOW..HIGH``.
    """

    name: str
    kind: str
    band: tuple[float, float]
    resonances: tuple[float, ...] = ()
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def source(self) -> Path:
        """The file with its equations."""
        return HERE / f"{self.name}.py"

    def module(self) -> Any:
        """Import the file."""
        return importlib.import_module(f"{__package__}.{self.name}")

    def write(self, folder: Path) -> Path:
        """Return what ``slide-fmu init`` takes: the file, or an FMU that is built in a folder."""
        if self.kind != "fmu":
            return self.source
        return write_python_fmu(self.name, self.source, folder / f"{self.name}.fmu")


MODELS = {
    model.name: model
    for model in (
        Model("drive", "function", (0.2, 20.0), (4.3, 18.0)),
        Model("beam", "exudyn", (0.4, 9.0), (7.5,)),
        Model("thermal", "fmu", (0.0005, 0.03), (), {"losses": (50, 350), "fan": (0.2, 1)}),
        Model("bearing", "function", (9.5, 25.5), (15.6, 22.7)),
        Model(
            "two_mass",
            "function",
            (0.2, 6.0),
            (2.7,),
            {"F_bed": (-300, 300), "F_head": (-120, 120)},
        ),
    )
}
"""All models by name."""


@dataclass(frozen=True, eq=False)
class Wanted:
    """A Wanted says which outputs are asked for.

    Attributes:
        inputs: names of the inputs in the order of motions.
        outputs: names of the outputs.
        times: even times from 0 on, in s, (N,).
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    times: FloatArray

    @property
    def step(self) -> float:
        """Time in s between two times."""
        return float(self.times[1] - self.times[0])

    def require(self, inputs: Collection[str], outputs: Collection[str]) -> None:
        """Raise a ValueError unless a model has just these inputs, and these outputs."""
        if set(self.inputs) != set(inputs) or not set(self.outputs) <= set(outputs):
            raise ValueError(
                f"the FMU has the inputs {sorted(self.inputs)} and the outputs "
                f"{sorted(self.outputs)}; expected the inputs {sorted(inputs)}, and outputs out "
                f"of {sorted(outputs)}: give an FMU that was made of this model"
            )
