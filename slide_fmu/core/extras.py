"""Packages that the base installation does not have are named with the extra that brings them."""

from __future__ import annotations

from importlib.util import find_spec

EXTRAS = {
    "fmpy": "run",
    "lxml": "run",
    "scipy": "run",
    "torch": "train",
    "exudyn": "train",
    "matplotlib": "train",
    "PIL": "train",
    "pythonfmu": "train",
    "sysidentpy": "compare",
}
"""The extra that brings each package."""
RUNNING = ("fmpy",)
"""Packages that running an FMU needs."""
TRAINING = ("torch",)
"""Packages that training needs."""


def how_to_install(extra: str) -> str:
    """Return the commands that install an extra: in a clone, and elsewhere."""
    return (
        f"pip install '.[{extra}]' in a clone of slide-fmu, pip install 'slide-fmu[{extra}]' else"
    )


def missing_extra(error: ImportError) -> str | None:
    """Return a message on what to install; None if the package belongs to no extra."""
    package = (error.name or "").partition(".")[0]
    extra = EXTRAS.get(package)
    if extra is None:
        return None
    return (
        f"the package {package!r} is not installed; expected the extra {extra!r}: "
        f"{how_to_install(extra)}"
    )


def require_training() -> None:
    """Raise an error if a package for training is missing, before any work is done.

    Raises:
        ModuleNotFoundError: a package is not installed; the message has the remedy.
    """
    _require(TRAINING)


def require_running() -> None:
    """Raise an error if a package for running FMUs is missing.

    Raises:
        ModuleNotFoundError: a package is not installed; the message has the remedy.
    """
    _require(RUNNING)


def _require(packages: tuple[str, ...]) -> None:
    package = _first_missing(packages)
    if package is not None:
        missing = ModuleNotFoundError(name=package)
        raise ModuleNotFoundError(missing_extra(missing), name=package)


def missing_for_training() -> str | None:
    """Return the first package for training that is not installed; None if all are."""
    return _first_missing(TRAINING)


def _first_missing(packages: tuple[str, ...]) -> str | None:
    for package in packages:
        try:
            installed = find_spec(package) is not None
        except ModuleNotFoundError:
            installed = False
        if not installed:
            return package
    return None
