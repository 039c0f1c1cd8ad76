"""FMUs of PythonFMU, as another tool writes them."""

from __future__ import annotations

import hashlib
import importlib
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from pythonfmu import FmuBuilder


def write_python_fmu(
    class_name: str,
    script: Path,
    path: Path,
    resources: Mapping[str, bytes] | None = None,
    **options: str,
) -> Path:
    """Write an FMU whose slave class a script defines, and return its path.

    Python keeps modules by name, so that two FMUs in one process need different ones. Options are
    attributes of the element ``CoSimulation``.
    """
    files = dict(resources or {})
    content = script.read_bytes() + b"".join(files.values())
    module = f"{class_name.lower()}_{hashlib.sha256(content).hexdigest()[:12]}"
    with tempfile.TemporaryDirectory() as folder:
        copied = Path(folder) / f"{module}.py"
        copied.write_bytes(script.read_bytes())
        places = [Path(folder) / name for name in files]
        for place, data in zip(places, files.values(), strict=True):
            place.write_bytes(data)
        importlib.invalidate_caches()
        options = {"needsExecutionTool": "true", **options}
        FmuBuilder.build_FMU(copied, dest=path, project_files=places, **options)
        sys.modules.pop(module, None)
        sys.path[:] = [entry for entry in sys.path if entry != folder]
    return path
