"""FMUs that carry any scripted or exported torch module (``--backend python``).

For networks that the native runtime does not know. Such an FMU needs Python with torch, numpy and
pythonfmu where it runs, and says so. Only writing it takes torch.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
import platform
import tomllib
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError, model_validator

from slide_fmu.learning_recipe import PositiveFloat, PositiveInt, Table
from slide_fmu.recipe import mistakes
from slide_fmu.scaling import Affine, range_scaling
from slide_fmu.signals import Hold, Signal
from slide_fmu.systems.python_fmu import write_python_fmu
from slide_fmu.torch_fmu.files import ABOUT, SUFFIXES

NEEDED = ("torch", "numpy", "pythonfmu")


class ModuleError(ValueError):
    """A torch module or its description cannot be used."""


class WindowTable(Table):
    """What the module sees: ``n_in`` samples, ``step`` seconds apart."""

    step: PositiveFloat
    n_in: PositiveInt


class SignalTable(Table):
    """One input or output: as ``Signal``, and what the module takes or gives for it.

    Attributes:
        offset, scale: the module's value is (value - offset) / scale; both, or neither: -1 .. 1
            for the range.
    """

    name: str
    unit: str
    low: float
    high: float
    description: str = ""
    start: float | None = None
    offset: float | None = None
    scale: PositiveFloat | None = None

    @model_validator(mode="after")
    def _is_a_signal(self) -> SignalTable:
        if (self.offset is None) != (self.scale is None):
            raise ValueError(f"{self.name}: offset or scale is missing; expected both or neither")
        self.signal()
        return self

    def signal(self) -> Signal:
        """The signal.

        Raises:
            ValueError: its range or start is none.
        """
        return Signal(self.name, self.unit, self.low, self.high, self.description, self.start)

    def figures(self) -> dict[str, Any]:
        """As the slave reads it: nothing left out."""
        signal = self.signal()
        scaling = range_scaling((signal,))
        if self.offset is not None and self.scale is not None:
            scaling = Affine.of_channels([self.offset], [self.scale])
        return {
            **asdict(signal),
            "start": signal.start_value,
            "offset": float(scaling.offset[0]),
            "scale": float(scaling.scale[0]),
        }


class ModuleTable(Table):
    """What a file beside a torch module says about it.

    Attributes:
        name: C identifier; name of the FMU.
        hold: how inputs act between samples, as in the module's training.
        window: what it sees.
        inputs: in the order of the columns of its argument, shape (1, n_in, n_inputs), float32,
            oldest sample first.
        outputs: in the order of its result's newest sample, its last n_outputs values.
    """

    name: str = Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$")
    hold: Hold = "held"
    window: WindowTable
    inputs: Annotated[tuple[SignalTable, ...], Field(min_length=1)]
    outputs: Annotated[tuple[SignalTable, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _names_differ(self) -> ModuleTable:
        names = [signal.name for signal in (*self.inputs, *self.outputs)]
        names += ["window_filled", "inputs_in_range", "prehistory_known"]
        names += [f"initial_{signal.name}" for signal in self.inputs]
        twice = [name for name in names if names.count(name) > 1]
        if twice:
            raise ValueError(f"two variables have the name {twice[0]!r}; expected unique names")
        return self


def export_module(module: Path, description: Path, path: Path) -> Path:
    """Write a torch module as FMI 2.0 co-simulation FMU that needs Python where it runs.

    Args:
        module: file of ``torch.jit.save`` (``.pt``) or ``torch.export.save`` (``.pt2``).
        description: TOML file, see ``ModuleTable``.
        path: file to write, ending in ``.fmu``.

    Returns:
        The path.

    Raises:
        ModuleError: the description is wrong, torch is missing, or the module cannot be evaluated.
        OSError: a file cannot be read.
        ValueError: the path does not end in ``.fmu``.
    """
    table = _read(description)
    if importlib.util.find_spec("torch") is None:
        raise ModuleError(f"{module}: torch is missing; pip install 'slide-fmu[train]'")
    needs = {"python": platform.python_version()} | {n: metadata.version(n) for n in NEEDED}
    about = {
        "name": table.name,
        "description": "Torch module on the last "
        f"{table.window.n_in} samples of the inputs, {table.window.step:g} s apart. Needs Python "
        f"with {', '.join(NEEDED)} where it runs",
        "needs": needs,
        "hold": table.hold,
        "window": table.window.model_dump(),
        "inputs": [signal.figures() for signal in table.inputs],
        "outputs": [signal.figures() for signal in table.outputs],
    }
    resources = {
        ABOUT: json.dumps(about, indent=2, ensure_ascii=False).encode("utf-8"),
        SUFFIXES[module.suffix]: module.read_bytes(),
    }
    script, parts = _sources()
    script += f'\n\nclass {table.name}(ModuleSlave):\n    """The slave of this FMU."""\n'
    try:
        return write_python_fmu(table.name, script, path, resources | parts)
    except (RuntimeError, ValueError) as error:
        raise ModuleError(f"{module}: {error}") from error


def _sources() -> tuple[str, dict[str, bytes]]:
    """Python source of the slave, and the files that it imports, by name.

    Python keeps modules by name: FMUs of different versions in one process need different ones.
    """
    script = _source("slave")
    files = {}
    for part in ("network", "window"):
        source = _source(part).encode("utf-8")
        name = f"module_{part}_{hashlib.sha256(source).hexdigest()[:12]}"
        script = script.replace(f"slide_fmu.torch_fmu.{part}", name)
        files[f"{name}.py"] = source
    return script, files


def _source(name: str) -> str:
    return Path(__file__).with_name(f"{name}.py").read_text(encoding="utf-8")


def _read(path: Path) -> ModuleTable:
    try:
        return ModuleTable.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except tomllib.TOMLDecodeError as error:
        raise ModuleError(f"{path}: not valid TOML: {error}") from error
    except ValidationError as error:
        raise ModuleError(mistakes(error, str(path))) from error
