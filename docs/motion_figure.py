"""The pictures on the page about motions: vibration after an optimised move, and after others.

``python docs/motion_figure.py`` chooses the moves of two tasks, simulates them with the reference
models, and writes ``docs/motion_crank.svg`` and ``docs/motion_robot.svg``.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import theme

from slide_fmu.apps.motion import MoveTask, read_task
from slide_fmu.apps.motion.move import Move
from slide_fmu.apps.motion.solve import MoveSolution, solve

ROOT = Path(__file__).parents[1]
AFTER = 0.35
"""Time in s that is shown after the last move has settled."""


def solved_task(fmu: str, task: str) -> MoveSolution:
    """Choose the move of a task, and simulate it and its baselines with the reference model."""
    read = read_task(ROOT / "docs" / "tutorials" / f"{task}.toml")
    assert isinstance(read, MoveTask)
    return solve(ROOT / "fmus" / fmu / f"{fmu}.fmu", read, verify=True)


def shown_moves(solved: MoveSolution) -> list[tuple[Move, float, str, float]]:
    """The plain move, the shaper that settles first, and the chosen move; with times and looks."""
    true = solved.true_moves()
    figures = [
        move.figures(solved.optimised.response, solved.limits, solved.task.tolerance)
        for move in true
    ]
    times = [np.inf if found.settled_s is None else found.settled_s for found in figures]
    best = min(range(2, len(true)), key=times.__getitem__)
    looks = ((1, theme.ORANGE, 1.3), (best, theme.GREY, 1.6), (0, theme.BLUE, 2.2))
    return [(true[index], times[index], colour, width) for index, colour, width in looks]


def draw(solved: MoveSolution, title: str, first: float, largest: float, distance: bool) -> None:
    """Draw the outputs after rest in mm, and mark when each move has settled."""
    matplotlib.rcParams.update(theme.STYLE | {"svg.hashsalt": title, "font.size": 11})
    figure, axes = plt.subplots(figsize=(7, 3.7), layout="constrained")
    moves, tolerance = shown_moves(solved), 1e3 * solved.task.tolerance
    low = 0 if distance else -largest
    axes.axhspan(0 if distance else -tolerance, tolerance, color=theme.SHADE, zorder=0)
    for move, settled, colour, width in moves:
        outputs = 1e3 * move.outputs
        shown = np.linalg.norm(outputs, axis=1) if distance else outputs[:, 0]
        time = solved.optimised.response.output_time[: len(shown)]
        name = {"not shaped": "plain"}.get(move.name, move.name)
        axes.plot(time, shown, color=colour, lw=width, label=f"{name}: {settled:.2f} s")
        axes.axvline(settled, color=colour, lw=1, ls=":")
    last = max(settled for _, settled, _, _ in moves) + AFTER
    quantity = "distance of the tool from rest" if distance else "deflection of the rod"
    axes.set(xlim=(first, last), ylim=(low, largest), xlabel="time / s", ylabel=f"{quantity} / mm")
    figure.legend(title="at rest after", loc="outside upper center", ncols=3, frameon=False)
    theme.save(figure, ROOT / "docs" / f"motion_{title}.svg")


def main() -> None:
    """Solve both tasks, and draw."""
    draw(solved_task("slider_crank_payload", "turned_payload"), "crank", 0.0, 70.0, False)
    draw(solved_task("robot_6r", "pick_and_place"), "robot", 0.8, 2.5, True)


if __name__ == "__main__":
    main()
