"""Packages that the base installation does not have are named with the extra that brings them."""

from __future__ import annotations

from importlib.util import find_spec

EXTRAS = {
    "torch": "train",
    "zarr": "train",
    "exudyn": "train",
    "sysidentpy": "compare",
}
"""The extra that brings each package."""
TRAINING = "zarr", "torch"
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
    package = missing_for_training()
    if package is not None:
        missing = ModuleNotFoundError(name=package)
        raise ModuleNotFoundError(missing_extra(missing), name=package)


def missing_for_training() -> str | None:
    """Return the first package for training that is not installed; None if all are."""
    for package in TRAINING:
        try:
            found = find_spec(package) is not None
        except ModuleNotFoundError:
            found = False
        if not found:
            return package
    return None
