"""An FMU is described once: its surrogate, how it was made, and what was measured of it.

``slide-fmu info`` prints this description, and model card, report, page and credentials are made
from it.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from slide_fmu.core.figures import plain, read_figures, spread
from slide_fmu.fmu.export import Provenance
from slide_fmu.recipe.quick import REMARK
from slide_fmu.report.run_figures import RunFigures, released_figures
from slide_fmu.report.verdict import verdict
from slide_fmu.surrogate.description import SurrogateDescription
from slide_fmu.surrogate.surrogate import Surrogate


@dataclass(frozen=True)
class Origin:
    """An Origin is the part of an FMU's provenance that users see.

    Attributes:
        recipe: the text of its recipe; empty without one.
        seeds: seeds by their use.
        versions: versions of the packages that made it, by name.
    """

    recipe: str = ""
    seeds: Mapping[str, int | None] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)

    @property
    def description(self) -> str:
        """The recipe's description of the surrogate; empty if there is none."""
        try:
            return str(tomllib.loads(self.recipe).get("description", ""))
        except tomllib.TOMLDecodeError:
            return ""

    @property
    def known_seeds(self) -> dict[str, int]:
        """The seeds that were used, by their use."""
        return {use: seed for use, seed in self.seeds.items() if seed is not None}


@dataclass(frozen=True)
class FmuDescription:
    """This describes an FMU.

    Attributes:
        surrogate: what it is, and what it knows of its error.
        provenance: how it was made, as the FMU carries it; None if that is unknown. It is read
            when it is asked for, so that an FMU with other figures can still be described.
    """

    surrogate: SurrogateDescription = spread()
    provenance: Provenance | None = None

    @classmethod
    def of(cls, surrogate: Surrogate, provenance: Provenance | None) -> FmuDescription:
        """Describe a surrogate with its provenance."""
        return cls(SurrogateDescription.of(surrogate), provenance)

    @cached_property
    def origin(self) -> Origin:
        """How it was made; empty where that is unknown.

        Raises:
            ValueError: the provenance is not of the form that this version writes.
        """
        return read_figures(Origin, self.provenance or {})

    @cached_property
    def measured(self) -> RunFigures | None:
        """The figures of its report; None where it was not measured.

        Raises:
            ValueError: the figures are not of the form that this version writes.
        """
        return released_figures(self.provenance)

    @property
    def quick(self) -> str | None:
        """What is said of an FMU of a quick run; None of another one."""
        return REMARK if "quick" in (self.provenance or {}) else None

    @property
    def verdict(self) -> tuple[str, ...]:
        """The verdict on it; empty where it was not measured."""
        return () if self.measured is None else verdict(self.measured.rows)

    def dump(self) -> Any:
        """Return plain values, as ``slide-fmu info --json`` writes them.

        Outputs have neither hold nor angle.
        """
        values = plain(self)
        for output in values["outputs"]:
            del output["hold"], output["angle"]
        return values
