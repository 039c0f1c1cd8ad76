"""FMUs of PythonFMU are written, with the licences of their contents."""

from __future__ import annotations

import hashlib
import importlib
import sys
import tempfile
import zipfile
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path

from pythonfmu import FmuBuilder

from slide_fmu.core.files import write_zip
from slide_fmu.fmu.attachments.files import FOLDER as ATTACHMENTS
from slide_fmu.fmu.attachments.files import LICENSES

TEXTS = ATTACHMENTS / "licenses"

_OVERVIEW = f"""What is in this FMU, and under which licence:

binaries/, resources/pythonfmu/: PythonFMU {metadata.version("pythonfmu")}, MIT, see pythonfmu.txt
modelDescription.xml and all other files of slide-fmu: MIT, see slide-fmu.txt
What the user put in, such as a model, is the user's own.
"""


def write_python_fmu(
    class_name: str, script: str, path: Path, resources: Mapping[str, bytes] | None = None
) -> Path:
    """Write a script with one slave class as FMI 2.0 co-simulation FMU.

    The same arguments give the same bytes, if the slave is a ``Slave``.

    Args:
        class_name: the name of the slave class, which becomes the model identifier.
        script: the Python source that defines it.
        path: the file to write, ending in ``.fmu``; an old file is replaced as a whole.
        resources: further files next to the script, by name.

    Returns:
        The path.

    Raises:
        OSError: the file cannot be written.
        ValueError: the path does not end in ``.fmu``.
    """
    if path.suffix != ".fmu":
        raise ValueError(f"FMU {str(path)!r}; expected a name ending in .fmu")
    files = dict(resources or {})
    content = script.encode() + b"".join(files[name] for name in sorted(files))
    # Python stores modules by name, so two FMUs in one process need different names
    module_name = f"{class_name.lower()}_{hashlib.sha256(content).hexdigest()[:12]}"
    with tempfile.TemporaryDirectory() as folder:
        script_file = Path(folder) / f"{module_name}.py"
        script_file.write_text(script, encoding="utf-8")
        for name, data in files.items():
            (Path(folder) / name).write_bytes(data)
        importlib.invalidate_caches()
        try:
            built = FmuBuilder.build_FMU(
                script_file,
                dest=Path(folder) / "built.fmu",
                project_files=[Path(folder) / name for name in files],
                needsExecutionTool="true",
            )
        finally:
            sys.modules.pop(module_name, None)
            sys.path[:] = [entry for entry in sys.path if str(entry) != folder]
        with zipfile.ZipFile(built) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
    write_zip(path, {**members, **_licenses()})
    return path


def _licenses() -> dict[str, bytes]:
    """Return the licences of the contents of such an FMU, by their names in it.

    PythonFMU is under the MIT licence, whose notice must be included with its libraries.
    """
    files = metadata.files("pythonfmu") or []
    texts = [file.read_binary() for file in files if file.name == "LICENSE"]
    if not texts:
        raise RuntimeError(
            "PythonFMU is installed without its file LICENSE, which must go along with the FMU; "
            "expected one: pip install --force-reinstall pythonfmu"
        )
    own = {f"{LICENSES}/{name}": (TEXTS / name).read_bytes() for name in ("slide-fmu.txt",)}
    return {
        **own,
        f"{LICENSES}/license.txt": _OVERVIEW.encode("utf-8"),
        f"{LICENSES}/pythonfmu.txt": texts[0],
    }
