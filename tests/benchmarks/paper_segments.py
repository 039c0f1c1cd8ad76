"""Error of an FMU in segments of its output window, as the paper gives it for the robot.

    python tests/benchmarks/paper_segments.py fmus/robot_6r/robot_6r.fmu --json - [--excitation 2]

The recipe's unseen test motions, beyond the burn-in, are cut into segments of n_out samples one
after the other; the surrogate gives the newest output of every step, as in a co-simulation. Its
error is that against the recipe's reference model, for each kind of excitation and for all.

Of every segment, with all outputs together: its RMSE relative to the RMS of the reference over the
kind, about the means (``of_kind``), to the reference's RMS in the segment itself (``of_segment``),
and to that about the means in the segment (``of_motion``: large where little moves); and the mean
Euclidean error over the segment, whose 95th percentile over the segments is the paper's e_95.
Outputs in another unit than the first one are left out.

``--excitation N`` draws all motions of the N-th excitation of the recipe, counted from 1, instead
of its mix: each kind alone then has as many motions as the mix.
"""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from figures_out import measure_and_write
from seeds import PAPER_SEGMENTS

from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.data.draws import TEST, Stream
from slide_fmu.data.unseen import UnseenMotion, unseen_motions
from slide_fmu.fmu.export import read_fmu
from slide_fmu.importer.file import UnpackedFmu, unpacked
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate

QUANTILES = {"p05": 0.05, "p25": 0.25, "median": 0.5, "p75": 0.75, "p95": 0.95}
MILLIMETRES = {"m": 1000.0, "mm": 1.0}
"""Of one unit of an output."""
LITTLE = np.finfo(np.float64).tiny


@dataclass(frozen=True, eq=False)
class Segments:
    """Segments of motions, shape (segments, n_out, n_outputs) each.

    Attributes:
        error: surrogate minus reference.
        reference: outputs of the reference model.
    """

    error: FloatArray
    reference: FloatArray

    @staticmethod
    def of_motion(found: FloatArray, reference: FloatArray, length: int) -> Segments:
        """From outputs along a motion, shape (N, n_outputs); a rest at its end is left out."""
        count = len(reference) // length
        shape = (count, length, reference.shape[1])
        whole = slice(0, count * length)
        return Segments((found - reference)[whole].reshape(shape), reference[whole].reshape(shape))

    @staticmethod
    def together(parts: list[Segments]) -> Segments:
        """All segments of several motions."""
        return Segments(
            np.concatenate([part.error for part in parts]),
            np.concatenate([part.reference for part in parts]),
        )

    def figures(self, millimetres: float | None) -> dict[str, Any]:
        """Statistics over the segments; Euclidean errors only where the unit is a length."""
        rmse, overall = _root(self.error**2), self.reference.mean(axis=(0, 1))
        of_kind = float(np.sqrt(np.mean((self.reference - overall) ** 2)))
        about_means = _root((self.reference - self.reference.mean(axis=1, keepdims=True)) ** 2)
        distance = np.mean(np.linalg.norm(self.error, axis=2), axis=1)
        lengths = {
            "mean_euclidean_error_mm": _statistics((millimetres or 0.0) * distance),
            "e_95_mm": (millimetres or 0.0) * float(np.quantile(distance, 0.95)),
        }
        return {
            "segments": len(rmse),
            "rms_reference_about_means": of_kind,
            "rmse": float(np.sqrt(np.mean(self.error**2))),
            "relative_rmse": {
                "of_kind": _statistics(rmse / max(of_kind, LITTLE)),
                "of_segment": _statistics(rmse / np.maximum(_root(self.reference**2), LITTLE)),
                "of_motion": _statistics(rmse / np.maximum(about_means, LITTLE)),
            },
            **(dict.fromkeys(lengths) if millimetres is None else lengths),
        }


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Errors of all segments by kind of excitation."""
    surrogate, found = read_fmu(arguments.fmu)
    whole = recipe_of_provenance(found, str(arguments.fmu))
    recipe = with_excitation(whole, arguments.excitation)
    duration = arguments.duration or recipe.measured_duration()
    count = recipe.unseen(arguments.trajectories)
    stream = Stream(TEST, arguments.seed, tuple(arguments.amplitude), duration)
    unit = surrogate.outputs[0].unit
    chosen = [i for i, signal in enumerate(surrogate.outputs) if signal.unit == unit]
    by_number: dict[int, list[Segments]] = {}
    with ExitStack() as stack:
        fmu = stack.enter_context(unpacked(arguments.fmu)) if arguments.through_fmu else None
        for motion in unseen_motions(
            recipe, case_of(recipe).reference, stream, count, bar("test motions")
        ):
            segments = segments_of(surrogate, fmu, motion, chosen)
            number = arguments.excitation or motion.kind + 1
            by_number.setdefault(number, []).append(segments)
    millimetres = MILLIMETRES.get(unit)
    kinds = [
        {
            "excitation": number,
            "kind": whole.data.excitation[number - 1].kind,
            "settings": whole.data.excitation[number - 1].settings(),
            "seed": arguments.seed,
            "trajectories": len(parts),
            **Segments.together(parts).figures(millimetres),
        }
        for number, parts in sorted(by_number.items())
    ]
    every = [part for parts in by_number.values() for part in parts]
    return {
        "recipe": recipe.name,
        "through_fmu": arguments.through_fmu,
        "reference": dict(recipe.system.reference),
        "seed": arguments.seed,
        "amplitude": list(arguments.amplitude),
        "trajectories": count,
        "duration_s": duration,
        "segment_samples": surrogate.window.n_out,
        "outputs": [surrogate.outputs[i].name for i in chosen],
        "unit": unit,
        "excitation": arguments.excitation,
        "kinds": kinds,
        "all": Segments.together(every).figures(millimetres),
    }


def with_excitation(recipe: Recipe, number: int | None) -> Recipe:
    """The recipe with one of its excitations alone.

    Args:
        number: of the excitation, from 1; None for the whole mix.
    """
    if number is None:
        return recipe
    kinds = recipe.data.excitation
    if not 1 <= number <= len(kinds):
        names = ", ".join(f"{index} ({kind.kind})" for index, kind in enumerate(kinds, start=1))
        raise SystemExit(
            f"--excitation {number}: recipe {recipe.name!r} has {len(kinds)} excitations; "
            f"expected one of {names}"
        )
    data = recipe.data.model_copy(update={"excitation": (kinds[number - 1],)})
    return recipe.model_copy(update={"data": data})


def segments_of(
    surrogate: Surrogate, fmu: UnpackedFmu | None, motion: UnseenMotion, chosen: list[int]
) -> Segments:
    """Segments of one motion.

    Args:
        fmu: gives the outputs; the surrogate in numpy if None.
        chosen: indices of the outputs.
    """
    n_out = surrogate.window.n_out
    first = motion.first(surrogate.network.memory_length)
    newest = outputs(surrogate, fmu, motion)[first - 1 :, chosen]
    segments = Segments.of_motion(newest, motion.outputs[first:, chosen], n_out)
    if not len(segments.error):
        step = surrogate.window.step
        raise SystemExit(
            f"duration = {step * (len(motion.inputs) - motion.burn_in):g} s; expected at least "
            f"{step * (first + n_out - 1 - motion.burn_in):g} s, so that a segment can be scored"
        )
    return segments


def outputs(surrogate: Surrogate, fmu: UnpackedFmu | None, motion: UnseenMotion) -> FloatArray:
    """Newest outputs at samples 1 .. N, shape (N, n_outputs): by numpy, or by the FMU itself."""
    if fmu is None:
        return surrogate.predict_newest(motion.inputs)
    inputs = {signal.name: motion.inputs[:, i] for i, signal in enumerate(surrogate.inputs)}
    names = [signal.name for signal in surrogate.outputs]
    return run_fmu(fmu, inputs, names, step=surrogate.window.step).values[1:]


def _root(squares: FloatArray) -> FloatArray:
    """Root of the mean over the samples and outputs of every segment."""
    return np.asarray(np.sqrt(np.mean(squares, axis=(1, 2))))


def _statistics(values: FloatArray) -> dict[str, float]:
    """Mean and spread over the segments, median and quantiles."""
    quantiles = np.quantile(values, list(QUANTILES.values()))
    return {
        "mean": float(np.mean(values)),
        "standard_deviation": float(np.std(values)),
        **{name: float(value) for name, value in zip(QUANTILES, quantiles, strict=True)},
        "largest": float(np.max(values)),
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("fmu", type=Path)
    parser.add_argument("--trajectories", type=int, help="the recipe's if not given")
    parser.add_argument("--duration", type=float, help="in s; the recipe's if not given")
    parser.add_argument("--seed", type=int, default=PAPER_SEGMENTS, help="of the motions")
    parser.add_argument(
        "--excitation", type=int, metavar="N", help="of the recipe, from 1; its mix if not given"
    )
    parser.add_argument(
        "--amplitude", type=float, nargs=2, default=(1.0, 1.0), metavar=("LOW", "HIGH")
    )
    parser.add_argument("--through-fmu", action="store_true", help="run the FMU itself")
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
