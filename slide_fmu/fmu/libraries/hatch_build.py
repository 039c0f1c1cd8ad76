"""The build hook of the wheel compiles the runtime and adds its libraries to the wheel.

It is named in pyproject.toml, section ``tool.hatch.build.targets.wheel.hooks.custom``, as
``path``.
"""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any, final

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


@final
class RuntimeBuildHook(BuildHookInterface[Any]):
    """The hook runs for standard and editable wheels alike."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile; ``artifacts`` adds files to the wheel that git ignores."""
        build = Path(self.root, "slide_fmu", "fmu", "libraries", "build.py")
        runpy.run_path(str(build))["build_all"]()
        build_data["artifacts"].append("/slide_fmu/fmu/binaries/**")
