"""This module finds installed apps and their additions to the way from a model to an FMU.

An app is any package that registers an ``App`` under the entry-point group ``slide_fmu.apps``.
The apps of slide-fmu lie in ``slide_fmu/apps``; another package may register further ones.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the console script reads this file before it knows what is asked
    from slide_fmu.fmu.export import Provenance
    from slide_fmu.recipe.case import Case
    from slide_fmu.recipe.recipe import Recipe
    from slide_fmu.report.table import ReportTable
    from slide_fmu.surrogate.surrogate import Surrogate

GROUP = "slide_fmu.apps"
"""Entry points of this group are apps; each has the name of its table ``[apps.NAME]``."""


ExampleFiles = tuple[Mapping[str, float], dict[str, bytes]]
"""Physical parameters of a run, and its CSV files ``inputs``, ``results`` and ``reference``."""


@dataclass(frozen=True, eq=False)
class Release:
    """A Release is an FMU that is about to be written, with its documents for people.

    Attributes:
        surrogate: the surrogate in the FMU.
        case: the case that it was made from, with all values resolved.
        provenance: its origin, with measured figures if it was measured.
        members: documents of the FMU by their names in it; empty if it was not measured.
        fmu: the FMU without documents, whose library may be run; None if nothing may be run.
        former: an FMU of the same surrogate, whose results are kept if it carries any.
        seed: seed of the unseen trajectories that it was measured on.
    """

    surrogate: Surrogate
    case: Case
    provenance: Provenance
    members: Mapping[str, bytes] = field(default_factory=dict)
    fmu: Path | None = None
    former: Path | None = None
    seed: int = 0


@dataclass(frozen=True)
class RepeatedRun:
    """This is the result of repeating a run that an FMU carries.

    Attributes:
        table: the differences; its title names the repeated run.
        problems: one sentence each; empty if nothing differs.
        figures: the same as plain values.
    """

    table: ReportTable
    problems: Sequence[str]
    figures: Mapping[str, Any]


@dataclass(frozen=True)
class App:
    """An App lists its additions; attributes that it leaves out add nothing.

    Attributes:
        subcommands: functions that become subcommands of ``slide-fmu``, by their names, each with
            its module.
        public: names that ``slide_fmu`` offers to Python, each with its module.
        check_table: raises a RecipeError if the app's table of a recipe cannot be used.
        origin: returns the part of the provenance of an FMU for this app, with keys of
            ``ORIGIN_KEYS`` only.
        origin_keys: these keys.
        check_origin: raises a ValueError if an FMU carries an origin that cannot be used.
        members: returns further files of an FMU, or replacements of its files, by their names in
            it.
        problems: returns faults in files of the FMU; the FMU is not run.
        repeat: repeats a run that the FMU carries; None without one.
        section: returns HTML that ends the report of an FMU.
        example_run: returns parameters and CSV files of the run that an FMU carries; None without
            one.
        moves: returns the moves of an FMU for the task in a file, as plain values.
    """

    subcommands: Mapping[str, str] = field(default_factory=dict)
    public: Mapping[str, str] = field(default_factory=dict)
    check_table: Callable[[Mapping[str, Any]], None] | None = None
    origin: Callable[[Recipe, Surrogate], Provenance] | None = None
    origin_keys: Sequence[str] = ()
    check_origin: Callable[[Surrogate, Provenance | None], object] | None = None
    members: Callable[[Release], Mapping[str, bytes]] | None = None
    problems: Callable[[Path, Surrogate, Provenance | None], list[str]] | None = None
    repeat: Callable[[Path, Surrogate], RepeatedRun | None] | None = None
    section: Callable[[Path], str] | None = None
    example_run: Callable[[Path], ExampleFiles | None] | None = None
    moves: Callable[[Path, Path], Mapping[str, Any]] | None = None


def apps() -> Mapping[str, App]:
    """Return all installed apps that can be used, by their names, sorted."""
    return {name: app for name, app in _installed().items() if isinstance(app, App)}


def unusable_apps() -> list[str]:
    """Return one sentence on each installed app that cannot be used, with the remedy."""
    return [reason for reason in _installed().values() if isinstance(reason, str)]


@cache
def _installed() -> Mapping[str, App | str]:
    """Return all installed apps by their names, sorted; in place of a broken one, the reason."""
    entries = sorted(entry_points(group=GROUP), key=lambda entry: entry.name)
    return {entry.name: _loaded(entry) for entry in entries}


def _loaded(entry: EntryPoint) -> App | str:
    try:
        app = entry.load()
    except Exception as error:  # it is code of others, which may raise anything
        return _unusable(entry.name, entry.value, f"{type(error).__name__}: {error}")
    return app if isinstance(app, App) else _unusable(entry.name, entry.value, f"it is {app!r}")


def _unusable(name: str, place: str, reason: str) -> str:
    return (
        f"the app {name!r} ({place}) cannot be loaded: {reason}; expected an App of "
        "slide_fmu.pipeline.apps: install its package again, or uninstall it"
    )


def subcommands_of_apps(
    others: Collection[str] = (),
) -> tuple[dict[str, Callable[..., None]], list[str]]:
    """Return the subcommands of apps by their names, and one sentence on each that is left out.

    A subcommand is left out if it or its app cannot be loaded, or if its name is one of the
    ``others`` or that of another app.
    """
    subcommands: dict[str, Callable[..., None]] = {}
    left_out = unusable_apps()
    for owner, app in apps().items():
        for name, module in app.subcommands.items():
            if name in subcommands or name in others:
                reason = f"there is a subcommand {name!r} already"
                left_out.append(_unusable(owner, module, reason))
                continue
            try:
                subcommands[name] = getattr(import_module(module), name)
            except Exception as error:  # as above
                left_out.append(_unusable(owner, module, f"{type(error).__name__}: {error}"))
    return subcommands, left_out


def example_run(fmu: Path) -> ExampleFiles | None:
    """Return the run that an FMU carries; None without one, or if no installed app reads it."""
    read = next((app.example_run for app in apps().values() if app.example_run is not None), None)
    return None if read is None else read(fmu)


def moves_of_task(fmu: Path, task: Path) -> Mapping[str, Any] | None:
    """Return the moves of an FMU for the task in a file; None if no installed app chooses any."""
    choose = next((app.moves for app in apps().values() if app.moves is not None), None)
    return None if choose is None else choose(fmu, task)


def check_app_tables(recipe: Recipe) -> None:
    """Refuse tables that an installed app cannot use.

    Raises:
        RecipeError: the message names the recipe and the table.
    """
    from slide_fmu.recipe.recipe import RecipeError

    for name, table in recipe.apps.items():
        if name not in apps():
            continue  # ``remarks_on_app_tables`` says so
        check = apps()[name].check_table
        try:
            if check is not None:
                check(table)
            elif table:
                raise RecipeError(f"[apps.{name}]: the app {name!r} reads no table; delete it")
        except RecipeError as error:
            raise RecipeError(f"recipe {recipe.name!r}: {error}") from error


def remarks_on_app_tables(recipe: Recipe) -> list[str]:
    """Say which tables are not used here, since their apps are not installed."""
    return [
        f"[apps.{name}] counts for nothing here: no installed app has this name; expected one of "
        f"{sorted(apps())}: correct it, or install the package that has the app"
        for name in recipe.apps
        if name not in apps()
    ]


def with_origins(provenance: Provenance, recipe: Recipe, surrogate: Surrogate) -> Provenance:
    """Return provenance in which each app has replaced its own part.

    Errors come from the apps.
    """
    origins = dict(provenance)
    for app in apps().values():
        for key in app.origin_keys:
            origins.pop(key, None)
        if app.origin is not None:
            origins |= app.origin(recipe, surrogate)
    return origins


def check_origins(surrogate: Surrogate, provenance: Provenance | None) -> None:
    """Refuse an FMU with a part of the provenance that its app cannot use.

    Raises:
        ValueError: the message names the fault.
    """
    for app in apps().values():
        if app.check_origin is not None:
            app.check_origin(surrogate, provenance)


def all_members(release: Release) -> dict[str, bytes]:
    """Return the files of a release and of all apps, by their names in the FMU."""
    members = dict(release.members)
    for app in apps().values():
        if app.members is not None:
            members |= app.members(release)
    return members


def app_problems(fmu: Path, surrogate: Surrogate, provenance: Provenance | None) -> Iterator[str]:
    """Return the problems of files that apps have put into an FMU."""
    for app in apps().values():
        if app.problems is not None:
            yield from app.problems(fmu, surrogate, provenance)


def repeated(fmu: Path, surrogate: Surrogate) -> dict[str, RepeatedRun]:
    """Repeat the runs that an FMU carries, by the names of the apps."""
    runs = {n: app.repeat(fmu, surrogate) for n, app in apps().items() if app.repeat is not None}
    return {name: run for name, run in runs.items() if run is not None}


def last_section(fmu: Path) -> str:
    """Return the HTML that apps put at the end of the report of an FMU; may be empty."""
    return "".join(app.section(fmu) for app in apps().values() if app.section is not None)
