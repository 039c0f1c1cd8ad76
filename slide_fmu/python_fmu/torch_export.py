"""FMUs that carry any scripted or exported torch module (``--backend python``).

For networks that the native runtime does not know. Such an FMU needs Python with torch and numpy
where it runs, and says so; PythonFMU is in it. Only writing it takes torch.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
import keyword
import platform
import tomllib
from importlib import metadata
from pathlib import Path, PurePath
from typing import Annotated, Any

from pydantic import Field, ValidationError, field_validator, model_validator

from slide_fmu.core.extras import how_to_install
from slide_fmu.core.scaling import Affine, range_scaling
from slide_fmu.core.signals import FORMER_HOLDS, Hold, Signal
from slide_fmu.core.window import MAX_WINDOW
from slide_fmu.fmu.description.variables import BY_KEY, KINDS
from slide_fmu.fmu.export import MODULE, MODULE_FILES
from slide_fmu.python_fmu.writer import write_python_fmu
from slide_fmu.recipe.learning import PositiveFloat, Table
from slide_fmu.recipe.reading import mistakes

NEEDED = ("torch", "numpy")

LONGEST_NAME = 100
"""Of an FMU: it becomes part of the names of files."""

PARTS = (
    "fmu.description.variables",
    "python_fmu.slave",
    "python_fmu.torch_window",
    "python_fmu.torch_network",
    "python_fmu.torch_slave",
)
"""Modules of slide_fmu that become part of the FMU, each behind those that it imports."""

_SCRIPT = '''"""The slave of this FMU."""

import {slave}


class {name}({slave}.ModuleSlave):
    """Named as the FMU; nothing else is here that its name could hide."""
'''


class ModuleError(ValueError):
    """A torch module or its description cannot be used."""


class WindowTable(Table):
    """This says what the module sees: ``n_in`` samples, ``step`` seconds apart."""

    step: PositiveFloat
    n_in: int = Field(gt=0, le=MAX_WINDOW)


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
        self.scaling()
        return self

    def signal(self) -> Signal:
        """Give the signal; a ValueError says what is wrong with its range or start."""
        return Signal(self.name, self.unit, self.low, self.high, self.description, self.start)

    def scaling(self) -> Affine:
        """Give the map from values to what the module takes or gives.

        Raises:
            ValueError: the signal is none, or its range too large or too small to be -1 .. 1.
        """
        signal = self.signal()
        if self.offset is not None and self.scale is not None:
            return Affine.of_channels([self.offset], [self.scale])
        try:
            return range_scaling((signal,))
        except ValueError as error:
            raise ValueError(
                f"signal {self.name!r}: range [{self.low}, {self.high}] {self.unit}: {error}; "
                "give another range, or offset and scale"
            ) from error

    def figures(self) -> dict[str, Any]:
        """Give the signal as the slave reads it: nothing is left out."""
        scaling = self.scaling()
        return {
            **self.model_dump(),
            "start": self.signal().start_value,
            "offset": float(scaling.offset[0]),
            "scale": float(scaling.scale[0]),
        }


class ModuleTable(Table):
    """This says what a file beside a torch module says about it.

    Attributes:
        name: of the FMU and of its class: an identifier in C and in Python.
        hold: how inputs act between samples, as in the module's training; the words of former
            versions, ``held`` and ``ramp``, are read too.
        window: what it sees.
        inputs: in the order of the columns of its argument, shape (1, n_in, n_inputs), float32,
            oldest sample first.
        outputs: in the order of its result's newest sample, its last n_outputs values.
    """

    name: str
    hold: Hold = "zero_order"
    window: WindowTable
    inputs: Annotated[tuple[SignalTable, ...], Field(min_length=1)]
    outputs: Annotated[tuple[SignalTable, ...], Field(min_length=1)]

    @field_validator("hold", mode="before")
    @classmethod
    def _in_words_of_today(cls, hold: object) -> object:
        return FORMER_HOLDS.get(hold, hold) if isinstance(hold, str) else hold

    @field_validator("name")
    @classmethod
    def _names_a_class(cls, name: str) -> str:
        identifier = name.isascii() and name.isidentifier() and len(name) <= LONGEST_NAME
        if not identifier or keyword.iskeyword(name) or name.startswith("__"):
            raise ValueError(
                f"expected at most {LONGEST_NAME} letters, digits and underscores, no digit and "
                "no two underscores first, and no keyword of Python"
            )
        return name

    @model_validator(mode="after")
    def _names_differ(self) -> ModuleTable:
        names = [signal.name for signal in (*self.inputs, *self.outputs)]
        names += [kind.name for kind in KINDS if kind.in_module_fmus and kind.per == "one"]
        names += [BY_KEY["INITIAL_INPUT"].name_for(signal.name) for signal in self.inputs]
        twice = [name for name in names if names.count(name) > 1]
        if twice:
            raise ValueError(f"two variables have the name {twice[0]!r}; expected unique names")
        return self


def export_module(module: Path, description: Path, path: Path) -> Path:
    """Write a torch module as FMI 2.0 co-simulation FMU that needs Python where it runs.

    Args:
        module: file of ``torch.jit.save`` (``.pt``) or ``torch.export.save`` (``.pt2``).
        description: TOML file, see ``ModuleTable``.
        path: file to write, ending in ``.fmu``; replaced as a whole when it is there.

    Returns:
        The path.

    Raises:
        ModuleError: the description is wrong, torch is missing, or the module cannot be evaluated.
        OSError: a file cannot be read or written.
    """
    table = _read(description)
    if importlib.util.find_spec("torch") is None:
        raise ModuleError(f"{module}: torch is missing; {how_to_install('train')}")
    needs = {"python": platform.python_version()} | {n: metadata.version(n) for n in NEEDED}
    about = {
        "name": table.name,
        "description": "Torch module on the last "
        f"{table.window.n_in} samples of the inputs, {table.window.step:g} s apart. Needs Python "
        f"with {' and '.join(NEEDED)} where it runs",
        "needs": needs,
        "hold": table.hold,
        "window": table.window.model_dump(),
        "inputs": [{**signal.figures(), "hold": table.hold} for signal in table.inputs],
        "outputs": [signal.figures() for signal in table.outputs],
    }
    resources = {
        PurePath(MODULE).name: json.dumps(about, indent=2, ensure_ascii=False).encode("utf-8"),
        MODULE_FILES[module.suffix]: module.read_bytes(),
    }
    slave, parts = _parts()
    script = _SCRIPT.format(slave=slave, name=table.name)
    try:
        return write_python_fmu(table.name, script, path, resources | parts)
    except (RuntimeError, ValueError) as error:
        raise ModuleError(f"{module}: {error}") from error


def _parts() -> tuple[str, dict[str, bytes]]:
    """Give the name of the slave's module in the FMU, and its files by name.

    Python keeps modules by name: FMUs of different versions in one process need different ones.
    """
    files: dict[str, bytes] = {}
    names: dict[str, str] = {}
    for part in PARTS:
        file = Path(__file__).parents[1].joinpath(*part.split(".")).with_suffix(".py")
        source = file.read_text(encoding="utf-8")
        for known, name in names.items():
            source = source.replace(f"slide_fmu.{known}", name)
        content = source.encode("utf-8")
        names[part] = f"{file.stem}_{hashlib.sha256(content).hexdigest()[:12]}"
        files[f"{names[part]}.py"] = content
    return names[PARTS[-1]], files


def _read(path: Path) -> ModuleTable:
    """Read the description in a file; what is wrong with it becomes a ModuleError."""
    try:
        text = path.read_bytes().decode("utf-8-sig")
        content = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ModuleError(f"{path}: not valid TOML: {error}") from error
    try:
        return ModuleTable.model_validate(content)
    except ValidationError as error:
        raise ModuleError(mistakes(error, str(path), "module", ModuleTable, text)) from error
