"""The functions that the standards define, by their official headers."""

from __future__ import annotations

import re

from slide_fmu.fmu.libraries.build import standard_headers


def functions(fmi: int) -> list[str]:
    """Names of all functions of FMI 2.0 or 3.0."""
    text = "".join(header.read_text() for header in standard_headers(fmi))
    return sorted(set(re.findall(rf"\b(fmi{fmi}\w+)TYPE\s*\(", text)))
