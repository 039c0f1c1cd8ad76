"""The moving picture of the README: a slider-crank turns plainly, and as its FMU chooses.

``python docs/moving_picture.py`` solves ``docs/tutorials/turned_crank.toml`` with a released FMU,
simulates both moves with the reference model, and writes ``docs/moving_picture.gif``.
"""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch, Rectangle
from PIL import Image
from scipy.interpolate import CubicSpline

from mbs_models.slider_crank import SliderCrank
from slide_fmu.apps.motion.solve import MoveSolution, reference_at, solve
from slide_fmu.apps.motion.task import MoveTask, read_task
from slide_fmu.core.search_path import make_models_importable
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import read_fmu
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.systems.simulation import simulate

ROOT = Path(__file__).parents[1]
FMU = ROOT / "fmus" / "slider_crank_payload" / "slider_crank_payload.fmu"
TASK = ROOT / "docs" / "tutorials" / "turned_crank.toml"
PICTURE = ROOT / "docs" / "moving_picture.gif"

ORANGE, BLUE, DARK, GREY, GREEN = "#d9730d", "#1f6fb2", "#22303c", "#8a959e", "#2c8a4b"
SIZE, DPI = (8.0, 4.3), 100
"""Size of the picture in inches, and its pixels for each inch."""
SLOWER, PAUSE = 2.0, 1.6
"""The picture is slower than the machine by this factor, and rests at its end, in s."""
FRAME, LAST = 0.04, 2.6
"""Time in s that a frame is shown, and time of the machine at which the picture ends."""
MAGNIFIED = 3.0
"""Factor on the drawn deflection of the rod."""
SHOWN = 10.0
"""Deflections in mm up to which the curves are shown."""
COLOURS = 63
"""The number of colours; one more is transparent."""


@dataclass(frozen=True, eq=False)
class Filmed:
    """Filmed is a move as the reference model made it.

    Attributes:
        arrives, settled: times in s when the set points end, and from which on the rod stays
            within the tolerance.
        points: positions in m of pivot, tip and rod over the time in s.
        deflection: deflection of the rod in mm, from rest, over the time in s.
    """

    label: str
    colour: str
    arrives: float
    settled: float
    points: CubicSpline
    deflection: CubicSpline


def solved_task() -> MoveSolution:
    """Return the task with its answer, and the same moves by the reference model."""
    task = read_task(TASK)
    assert isinstance(task, MoveTask)
    return solve(FMU, task, verify=True)


def settling_times(solved: MoveSolution) -> dict[str, float | None]:
    """Return the times in s at which the moves have settled, by the reference model."""
    true = solved.figures().reference
    assert true is not None
    return {move.name: move.settled_s for move in (true.move, *true.baselines)}


def best_shaper(times: dict[str, float | None]) -> float:
    """Return the earliest settling time in s among the moves behind input shapers."""
    return min(time for name, time in times.items() if name.startswith("Z") and time is not None)


def filmed(solved: MoveSolution, name: str, label: str, colour: str) -> Filmed:
    """Simulate a move of the task again, and keep where the machine is."""
    make_models_importable(FMU)
    surrogate, provenance = read_fmu(FMU)
    recipe = recipe_of_provenance(provenance, str(FMU))
    system = reference_at(recipe, surrogate, solved.task.parameters)
    assert isinstance(system, SliderCrank)
    response = solved.optimised.response
    (move,) = (move for move in solved.moves if move.name == name)
    inputs = response.inputs(move.motion)
    states = [system.rest_state(inputs[0])]
    outputs = simulate(system, inputs, states[0], states).outputs[response.lead :, 0]
    places = np.stack([system.points(state) for state in states[-len(outputs) :]])
    time = system.step * np.arange(len(outputs), dtype=np.float64)
    settled = settling_times(solved)[name]
    assert settled is not None
    arrives = float(response.time[move.end])
    turned, bent = CubicSpline(time, places), CubicSpline(time, 1e3 * outputs)
    return Filmed(label, colour, arrives, settled, turned, bent)


def magnified(rod: FloatArray) -> FloatArray:
    """Return nodes of the rod, (n, 2), with larger distances from the line between its ends."""
    straight = np.linspace(rod[0], rod[-1], len(rod))
    return np.asarray(straight + MAGNIFIED * (rod - straight))


def draw_machine(axes: Axes, move: Filmed, time: float) -> None:
    """Draw crank, rod and slider at a time in s, and whether the rod is at rest."""
    points = move.points(max(time, 0.0))
    axes.set(xlim=(-0.62, 1.6), ylim=(-0.16, 0.92), aspect="equal")
    axes.set_axis_off()
    axes.plot([0.12, 1.56], [-0.085, -0.085], color=GREY, lw=1.5)
    axes.add_patch(Circle((0, 0), 0.5, fill=False, ec="#dde3e7", lw=1.2))
    corner = (points[-1, 0] - 0.1, -0.075)
    axes.add_patch(Rectangle(corner, 0.2, 0.15, fc="#dfe6ea", ec=DARK, lw=1.5))
    axes.plot(*points[:2].T, color=DARK, lw=8, solid_capstyle="round")
    axes.plot(*magnified(points[2:]).T, color=move.colour, lw=5.5, solid_capstyle="round")
    for joint in (points[0], points[1], points[-1]):
        axes.plot(*joint, "o", color="white", mec=DARK, mew=1.5, ms=6)
    rests = time >= move.settled
    moves = "vibrating" if time > move.arrives else "moving"
    state = f"at rest after {move.settled:.2f} s" if rests else moves
    axes.text(-0.55, 0.91, move.label, color=move.colour, fontsize=16, weight="bold", va="top")
    colour = GREEN if rests else DARK
    weight = "bold" if rests else "normal"
    axes.text(-0.55, 0.73, state, color=colour, fontsize=14, weight=weight, va="top")


def draw_curves(
    axes: Axes, moves: tuple[Filmed, ...], shaped: float, tolerance: float, time: float
) -> None:
    """Draw the deflections in mm until a time in s, and the settling times."""
    axes.set(xlim=(0, LAST), ylim=(-SHOWN, SHOWN), yticks=(-SHOWN, 0, SHOWN))
    axes.axhspan(-tolerance, tolerance, color="#cfe8d6", lw=0)
    past = np.arange(0.0, min(max(time, 0.0), LAST) + 1e-9, 0.004)
    for move in moves:
        axes.plot(past, move.deflection(past), color=move.colour, lw=2.2)
    marks = [(move.settled, move.colour, f"{move.settled:.2f} s") for move in moves]
    for settled, colour, label in (*marks, (shaped, GREY, f"best shaper {shaped:.2f} s")):
        if time >= settled:
            axes.axvline(settled, color=colour, lw=1.3, ls="--")
            left = colour == GREY
            place = settled + (-0.02 if left else 0.02)
            text = axes.text(place, 0.8 * SHOWN, label, color=colour, weight="bold")
            text.set(fontsize=11 if left else 12, ha="right" if left else "left", va="center")
            text.set_bbox({"fc": "white", "ec": "none", "pad": 1.5})
    allowed = f"green: within {tolerance:g} mm"
    axes.text(2.22, -0.84 * SHOWN, allowed, color=GREEN, ha="right", va="center", fontsize=11)
    axes.set_ylabel("deflection\nof the rod / mm", color=DARK, fontsize=11)
    axes.set_xlabel("time / s", color=DARK, fontsize=11, labelpad=1, loc="left")
    axes.tick_params(colors=DARK, labelsize=11)
    axes.spines[["top", "right"]].set_visible(False)


def draw_frame(
    moves: tuple[Filmed, ...], shaped: float, tolerance: float, time: float
) -> Image.Image:
    """Draw a frame at a time in s: the machines above, the deflections below.

    The other times are in s too: when the best move of an input shaper has settled. The tolerance
    is in mm.
    """
    figure = Figure(figsize=SIZE, dpi=DPI, facecolor="none")
    card = FancyBboxPatch(
        (0.006, 0.01), 0.988, 0.98, "round,pad=0,rounding_size=0.02", transform=figure.transFigure
    )
    card.set(zorder=-1, fc="white", ec="#c8d0d6", lw=1, mutation_aspect=SIZE[0] / SIZE[1])
    figure.add_artist(card)
    for index, move in enumerate(moves):
        axes = figure.add_axes((0.02 + 0.485 * index, 0.51, 0.475, 0.45))
        axes.patch.set_visible(False)
        draw_machine(axes, move, time)
    draw_curves(figure.add_axes((0.125, 0.125, 0.845, 0.34)), moves, shaped, tolerance, time)
    note = f"half speed; the rod's bending is drawn {MAGNIFIED:g} times as large"
    figure.text(0.97, 0.035, note, color=GREY, fontsize=10, ha="right")
    drawn = BytesIO()
    figure.savefig(drawn, format="png")
    return Image.open(drawn).convert("RGBA")


def frames(solved: MoveSolution) -> list[Image.Image]:
    """Draw all frames of the picture."""
    moves = (
        filmed(solved, "not shaped", "plain: as fast as possible", ORANGE),
        filmed(solved, "optimised", "optimised with the FMU", BLUE),
    )
    shaped = best_shaper(settling_times(solved))
    tolerance = 1e3 * solved.task.tolerance
    times = np.arange(-0.1, LAST, FRAME / SLOWER)
    return [draw_frame(moves, shaped, tolerance, float(time)) for time in times]


def written(images: list[Image.Image]) -> bytes:
    """Return the GIF, which has one palette and is transparent outside of the card."""
    sample = Image.new("RGB", (images[0].width, 3 * images[0].height), "white")
    for row, share in enumerate((0.25, 0.5, 1.0)):
        shown = images[round(share * (len(images) - 1))]
        sample.paste(shown, (0, row * shown.height), shown)
    palette = sample.quantize(COLOURS, dither=Image.Dither.NONE)
    flat = []
    for image in images:
        white = Image.new("RGB", image.size, "white")
        white.paste(image, (0, 0), image)
        indexed = white.quantize(palette=palette, dither=Image.Dither.NONE)
        indexed.paste(COLOURS, mask=image.getchannel("A").point(lambda a: 255 * (a < 128)))
        flat.append(indexed)
    shown_for = [round(1e3 * FRAME)] * (len(flat) - 1) + [round(1e3 * PAUSE)]
    data = BytesIO()
    flat[0].save(
        data,
        "GIF",
        save_all=True,
        append_images=flat[1:],
        duration=shown_for,
        loop=0,
        transparency=COLOURS,
    )
    return data.getvalue()


def main() -> None:
    """Write the picture."""
    PICTURE.write_bytes(written(frames(solved_task())))


if __name__ == "__main__":
    main()
