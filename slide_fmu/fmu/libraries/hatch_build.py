"""Build hook of the wheel: compile the runtime and take its libraries into the wheel.

Named in pyproject.toml, section ``tool.hatch.build.targets.wheel.hooks.custom``, as ``path``.
"""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class RuntimeBuildHook(BuildHookInterface[Any]):
    """Runs for standard and editable wheels alike. Final."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile; ``artifacts`` brings files into the wheel that git ignores."""
        build = Path(self.root, "slide_fmu", "fmu", "libraries", "build.py")
        runpy.run_path(str(build))["build_all"]()
        build_data["artifacts"].append("/slide_fmu/fmu/binaries/**")
