"""Packages that the base installation does not have are named with the extra that brings them."""

from __future__ import annotations

from importlib.util import find_spec

EXTRAS = {
    "torch": "train",
    "zarr": "train",
    "exudyn": "train",
    "sysidentpy": "compare",
}
"""Extras by the packages that they bring."""
TRAINING = "zarr", "torch"
"""Packages without which nothing can be learnt."""


def how_to_install(extra: str) -> str:
    """Return the commands that install an extra: of a clone, as the README has it, and else."""
    return (
        f"pip install '.[{extra}]' in a clone of slide-fmu, pip install 'slide-fmu[{extra}]' else"
    )


def told_missing(error: ImportError) -> str | None:
    """Say what must be installed; None where the package is of no extra."""
    package = (error.name or "").partition(".")[0]
    extra = EXTRAS.get(package)
    if extra is None:
        return None
    return (
        f"the package {package!r} is not installed; expected the extra {extra!r}: "
        f"{how_to_install(extra)}"
    )


def require_training() -> None:
    """Refuse to learn without the packages for it, before anything is made.

    Raises:
        ModuleNotFoundError: one is not installed; the message has the remedy.
    """
    package = missing_for_training()
    if package is not None:
        missing = ModuleNotFoundError(name=package)
        raise ModuleNotFoundError(told_missing(missing), name=package)


def missing_for_training() -> str | None:
    """Return the first package for learning that is not installed; None if all are."""
    for package in TRAINING:
        try:
            found = find_spec(package) is not None
        except ModuleNotFoundError:
            found = False
        if not found:
            return package
    return None
