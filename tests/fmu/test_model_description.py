"""The model description: the variables of a surrogate, their starts and what they depend on."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import fmpy
import numpy as np

from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import Signal
from slide_fmu.cosim.check import check_fmu
from slide_fmu.fmu.export import export_fmu
from slide_fmu.surrogate.surrogate import Surrogate
from tests.bounded import bounded_surrogate
from tests.fmu.native import OK, ExportedFmu, Load
from tests.fmu.samples import STEP, TWO_MASSES, CellShape, random_surrogate
from tests.refusals import refused

KNOWN_AT_START = ["u0", "u1", "prehistory_known", "initial_u0", "initial_u1", "inputs_held"]
KINDS = ["inputs_in_range", "prehistory_known", "initial_u0"]


def test_model_description_holds_the_signals_of_the_surrogate(
    fmu: Path, surrogate: Surrogate
) -> None:
    description = fmpy.read_model_description(str(fmu))
    variables = {variable.name: variable for variable in description.modelVariables}
    assert list(variables) == [
        *("u0", "u1", "y0", "y1", "y0_error_estimate", "y1_error_estimate"),
        *("window_filled", "error_estimate_filled", "inputs_in_range"),
        *("prehistory_known", "initial_u0", "initial_u1", "inputs_held"),
    ]
    first = variables["u0"]
    assert (first.min, first.max, first.start) == ("-2.0", "3.0", repr(surrogate.starts[0].item()))
    assert variables["y0_error_estimate"].unit == "m"
    for name, results in (("window_filled", "outputs"), ("error_estimate_filled", "estimates")):
        filled = variables[name]
        assert (filled.unit, filled.min, filled.max) == ("1", "0.0", "1.0")
        assert filled.description.endswith(f"trust the {results} once it is 1.")
    assert description.defaultExperiment.stepSize == str(STEP)
    assert description.coSimulation.canSerializeFMUstate
    assert description.coSimulation.canHandleVariableCommunicationStepSize
    assert all(not unknown.dependencies for unknown in description.outputs)
    initial = [[v.name for v in u.dependencies] for u in description.initialUnknowns]
    assert initial == [KNOWN_AT_START] * 4 + [["prehistory_known"]] * 2 + [KNOWN_AT_START]
    assert description.coSimulation.providesDirectionalDerivative
    in_range, known, parameter = (variables[name] for name in KINDS)
    assert (in_range.type, in_range.variability) == ("Boolean", "discrete")
    assert (in_range.unit, in_range.min, in_range.start) == (None, None, None)
    assert (known.causality, known.variability, known.initial) == ("parameter", "fixed", "exact")
    assert (known.start, parameter.start, parameter.unit) == ("0.0", first.start, "N")


def test_description_of_fmi_3_says_what_that_of_fmi_2_says_and_more(
    fmu: Path, surrogate: Surrogate, tmp_path: Path
) -> None:
    """What FMI 2.0 says, and what FMI 3.0 has beside."""
    path = export_fmu(surrogate, tmp_path / "m.fmu", fmi=3)
    two, three = (fmpy.read_model_description(str(p)) for p in (fmu, path))
    assert three.fmiVersion == "3.0"
    assert three.instantiationToken == two.guid
    same = ("name", "valueReference", "causality", "unit", "min", "max", "start", "description")
    *variables, time, first_window, window, initial, _, held = three.modelVariables
    variables.append(held)
    for one, other in zip(two.modelVariables, variables, strict=True):
        assert (one.type, other.type) in (("Real", "Float64"), ("Boolean", "Boolean"))
        if other.name == "prehistory_known":  # has one more value
            assert (one.max, other.max) == ("1.0", "2.0")
        else:
            assert [getattr(one, name) for name in same] == [getattr(other, name) for name in same]
    assert (time.name, time.unit, time.causality) == ("time", "s", "independent")
    assert (first_window.name, window.name) == ("y0_window", "y1_window")
    assert (window.causality, window.shape) == ("local", (surrogate.window.n_out,))
    interface = three.coSimulation
    assert interface.fixedInternalStepSize == str(STEP)
    assert three.defaultExperiment.stepSize == str(STEP)
    assert interface.canHandleVariableCommunicationStepSize
    assert interface.canGetAndSetFMUstate
    assert interface.canSerializeFMUstate
    assert interface.providesIntermediateUpdate
    assert not interface.hasEventMode
    assert two.coSimulation.canInterpolateInputs
    assert (initial.name, initial.causality) == ("initial_u0_window", "parameter")
    assert initial.shape == (surrogate.memory_length,)
    arrays = {initial.name, "initial_u1_window"}
    for unknowns in ("outputs", "initialUnknowns"):
        found = [
            [
                (u.variable.name, [v.name for v in u.dependencies if v.name not in arrays])
                for u in getattr(d, unknowns)
            ]
            for d in (two, three)
        ]
        assert found[0] == found[1]


def test_signal_called_time_is_refused_in_fmi_3(surrogate: Surrogate, tmp_path: Path) -> None:
    first, second = surrogate.inputs
    signals = (dataclasses.replace(first, name="time"), second)
    surrogate = dataclasses.replace(surrogate, inputs=signals)
    export_fmu(surrogate, tmp_path / "m.fmu")
    with refused(ValueError, "two variables", "'time'"):
        export_fmu(surrogate, tmp_path / "m.fmu", fmi=3)


def test_description_without_estimator_has_no_estimates(
    surrogate: Surrogate, tmp_path: Path
) -> None:
    surrogate = dataclasses.replace(surrogate, estimator=None)
    path = export_fmu(surrogate, tmp_path / "m.fmu")
    description = fmpy.read_model_description(str(path))
    names = [variable.name for variable in description.modelVariables]
    assert names == [
        *("u0", "u1", "y0", "y1", "window_filled", "inputs_in_range"),
        *("prehistory_known", "initial_u0", "initial_u1", "inputs_held"),
    ]
    initial = [[v.name for v in u.dependencies] for u in description.initialUnknowns]
    assert initial == [KNOWN_AT_START] * 2 + [["prehistory_known"], KNOWN_AT_START]


def test_description_of_a_cell_has_its_truncation_errors(tmp_path: Path) -> None:
    surrogate = random_surrogate(dataclasses.replace(TWO_MASSES, cell=CellShape()))
    path = export_fmu(surrogate, tmp_path / "m.fmu")
    description = fmpy.read_model_description(str(path))
    variables = description.modelVariables
    assert [variable.name for variable in variables[6:]] == [
        *("window_filled", "error_estimate_filled", "y0_truncation_error", "y1_truncation_error"),
        *("inputs_in_range", "prehistory_known", "initial_u0", "initial_u1", "inputs_held"),
    ]
    assert (variables[8].unit, variables[8].min, variables[8].causality) == ("m", "0.0", "output")
    initial = [[v.name for v in u.dependencies] for u in description.initialUnknowns]
    assert initial == [KNOWN_AT_START] * 4 + [["prehistory_known"]] * 2 + [KNOWN_AT_START] * 3


def test_description_of_an_error_bound_has_its_variables(tmp_path: Path) -> None:
    surrogate = bounded_surrogate(dataclasses.replace(TWO_MASSES, cell=CellShape()))
    path = export_fmu(surrogate, tmp_path / "m.fmu")
    description = fmpy.read_model_description(str(path))
    variables = {variable.name: variable for variable in description.modelVariables}
    assert list(variables)[-10:] == [
        *("y0_error_bound", "y1_error_bound", "in_domain", "novelty"),
        *("error_bound_filled", "confidence"),
        *("y0_error_tolerance", "y1_error_tolerance", "trusted", "inputs_held"),
    ]
    confidence, bound = variables["confidence"], variables["y1_error_bound"]
    assert (confidence.min, confidence.max, confidence.start) == ("0.9", "0.99", "0.95")
    assert (confidence.causality, confidence.variability) == ("parameter", "tunable")
    assert (bound.unit, bound.min, bound.max) == ("m", "0.0", None)
    assert variables["in_domain"].type == "Boolean"
    initial = {u.variable.name: u.dependencies for u in description.initialUnknowns}
    *known, held = KNOWN_AT_START
    known += ["confidence", "y0_error_tolerance", "y1_error_tolerance", held]
    assert [v.name for v in initial["novelty"]] == known
    assert [v.name for v in initial["error_bound_filled"]] == ["prehistory_known"]
    assert check_fmu(path) == []


def test_start_values_lie_in_the_range(surrogate: Surrogate, tmp_path: Path) -> None:
    signals = (Signal("u0", "kN", 2.0, 3.0), Signal("u1", "furlong", -3.0, -2.0))
    with refused(ValueError, "input 0 starts at 2", "its range"):
        dataclasses.replace(
            surrogate, inputs=signals, input_scaling=Affine.of_channels([0.5, -2.5], [0.5, 0.5])
        )
    scaling = Affine.of_channels([2.5, -2.5], [0.5, 0.5])
    surrogate = dataclasses.replace(surrogate, inputs=signals, input_scaling=scaling)
    path = export_fmu(surrogate, tmp_path / "m.fmu")
    variables = fmpy.read_model_description(str(path)).modelVariables
    assert [variable.start for variable in variables[:2]] == ["2.0", "-2.0"]
    assert check_fmu(path) == []
    folder = Path(fmpy.extract(str(path), str(tmp_path / "unpacked")))
    native = ExportedFmu(surrogate, path, folder).instance().start()
    assert native.get(0, 2) == [2.0, -2.0]
    native.set(2.5, -2.5)
    assert native.call("fmi2Reset") == OK
    assert native.start().get(0, 2) == [2.0, -2.0]


def test_inputs_start_where_their_signals_say(surrogate: Surrogate, load: Load) -> None:
    """Rounding of offset -+ scale does not matter."""
    signals = (Signal("u0", "N", 0.2, 0.9), Signal("u1", "m", -1.0, 3.0, start=2.5))
    scaling = Affine.of_channels([0.5 * (0.9 + 0.2), 1.0], [0.5 * (0.9 - 0.2), 2.0])
    assert scaling.offset[0] - scaling.scale[0] > 0.2
    loaded = load(dataclasses.replace(surrogate, inputs=signals, input_scaling=scaling))
    native = loaded.instance().start()
    assert native.get(0, 2) == [0.2, 2.5]
    held = np.tile([0.2, 2.5], (20, 1))
    np.testing.assert_allclose(native.get(2, 2), loaded.surrogate.predict(held)[-1], rtol=1e-4)


def test_clashing_names_are_refused(surrogate: Surrogate, tmp_path: Path) -> None:
    signals = (Signal("window_filled", "N", 0.0, 1.0), surrogate.inputs[1])
    with refused(ValueError, "name 'window_filled'"):
        export_fmu(dataclasses.replace(surrogate, inputs=signals), tmp_path / "m.fmu")
