"""Fast, trustworthy stand-ins for slow multibody models, as FMUs that load anywhere.

This is the public face of the package. Whatever ``__all__`` lists is kept working from one release
to the next; what lies in the rooms below may move. Installed apps add names of their own, such
as ``slide_fmu.calibrate`` (``slide_fmu.apps``). A name is imported when it is first used, so
that ``import slide_fmu`` is quick and loads neither torch nor exudyn.

    import slide_fmu as slide

    surrogate = slide.load("fmus/duffing/duffing.fmu")
    outputs = surrogate.predict(inputs)  # (samples, inputs) to (samples, outputs)
"""

from importlib import import_module
from typing import TYPE_CHECKING

from slide_fmu.core.version import __version__

if TYPE_CHECKING:
    from slide_fmu.cli.python_calls import RunResult, export, learn, run, validate
    from slide_fmu.core.parameters import Parameter
    from slide_fmu.core.signals import Signal
    from slide_fmu.core.window import Window
    from slide_fmu.cosim.simulate import simulate
    from slide_fmu.data.trajectories import TrajectoryError
    from slide_fmu.fitting.errors import TrainingError
    from slide_fmu.fmu.export import export_fmu, load
    from slide_fmu.fmu.native import NativeSurrogate
    from slide_fmu.fmu.native_library import NativeError
    from slide_fmu.importer.errors import CoSimulationError, FmuError
    from slide_fmu.memory.sizing import ShortWindowError
    from slide_fmu.memory.stability import UnstableSurrogateError
    from slide_fmu.pipeline.run_folder import StageError
    from slide_fmu.recipe.reading import load_recipe
    from slide_fmu.recipe.recipe import Recipe, RecipeError
    from slide_fmu.report.quality import QualityError
    from slide_fmu.surrogate.gradient import gradient, jacobian, parameter_jacobian
    from slide_fmu.surrogate.payload import PayloadError
    from slide_fmu.surrogate.surrogate import Surrogate
    from slide_fmu.systems.base import (
        Linearizable,
        Linearization,
        RandomStates,
        Restorable,
        State,
        StateMatrix,
        Stepping,
        System,
    )
    from slide_fmu.systems.errors import LoadError, SimulationError
    from slide_fmu.systems.function.integration import Solver
    from slide_fmu.systems.function.record import RecordSystem
    from slide_fmu.systems.function.system import FunctionSystem

__all__ = [
    "CoSimulationError",
    "FmuError",
    "FunctionSystem",
    "Linearizable",
    "Linearization",
    "LoadError",
    "NativeError",
    "NativeSurrogate",
    "Parameter",
    "PayloadError",
    "QualityError",
    "RandomStates",
    "Recipe",
    "RecipeError",
    "RecordSystem",
    "Restorable",
    "RunResult",
    "ShortWindowError",
    "Signal",
    "SimulationError",
    "Solver",
    "StageError",
    "State",
    "StateMatrix",
    "Stepping",
    "Surrogate",
    "System",
    "TrainingError",
    "TrajectoryError",
    "UnstableSurrogateError",
    "Window",
    "__version__",
    "export",
    "export_fmu",
    "gradient",
    "jacobian",
    "learn",
    "load",
    "load_recipe",
    "parameter_jacobian",
    "run",
    "simulate",
    "validate",
]

_HOMES = {
    "slide_fmu.core.parameters": ("Parameter",),
    "slide_fmu.core.signals": ("Signal",),
    "slide_fmu.core.window": ("Window",),
    "slide_fmu.cosim.simulate": ("simulate",),
    "slide_fmu.fmu.export": ("export_fmu", "load"),
    "slide_fmu.importer.errors": ("CoSimulationError", "FmuError"),
    "slide_fmu.fmu.native": ("NativeSurrogate",),
    "slide_fmu.cli.python_calls": ("RunResult", "export", "learn", "run", "validate"),
    "slide_fmu.recipe.reading": ("load_recipe",),
    "slide_fmu.recipe.recipe": ("Recipe", "RecipeError"),
    "slide_fmu.surrogate.gradient": ("gradient", "jacobian", "parameter_jacobian"),
    "slide_fmu.surrogate.surrogate": ("Surrogate",),
    "slide_fmu.systems.errors": ("LoadError", "SimulationError"),
    "slide_fmu.systems.base": (
        "Linearizable",
        "Linearization",
        "RandomStates",
        "Restorable",
        "State",
        "StateMatrix",
        "Stepping",
        "System",
    ),
    "slide_fmu.fmu.native_library": ("NativeError",),
    "slide_fmu.surrogate.payload": ("PayloadError",),
    "slide_fmu.report.quality": ("QualityError",),
    "slide_fmu.memory.sizing": ("ShortWindowError",),
    "slide_fmu.pipeline.run_folder": ("StageError",),
    "slide_fmu.data.trajectories": ("TrajectoryError",),
    "slide_fmu.fitting.errors": ("TrainingError",),
    "slide_fmu.memory.stability": ("UnstableSurrogateError",),
    "slide_fmu.systems.function.system": ("FunctionSystem",),
    "slide_fmu.systems.function.integration": ("Solver",),
    "slide_fmu.systems.function.record": ("RecordSystem",),
}
"""The module that each public name is imported from at its first use (PEP 562)."""

if not TYPE_CHECKING:  # type checkers read the imports above and refuse names that are not there

    def __getattr__(name: str) -> object:
        if name.startswith("__"):  # what Python itself asks for loads no apps
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        for module, names in _HOMES.items():
            if name in names:
                found = getattr(import_module(module), name)
                globals()[name] = found  # the next use does not come here
                return found
        from slide_fmu.pipeline.apps import apps, unusable_apps

        for app in apps().values():
            if name in app.public:
                return getattr(import_module(app.public[name]), name)
        lacks = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError("; ".join([lacks, *unusable_apps()]))


def __dir__() -> list[str]:
    return sorted(__all__)
