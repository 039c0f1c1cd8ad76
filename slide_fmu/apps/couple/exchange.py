"""Linked inputs come from outputs at the start of a step, from their mean, or from its end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from slide_fmu.apps.couple.component import Component, Nodes, own_nodes
from slide_fmu.apps.couple.loop import Mix
from slide_fmu.apps.couple.options import IMPLICIT, CouplingOptions
from slide_fmu.apps.couple.structure import CoupledSystem
from slide_fmu.importer.errors import CoSimulationError

GAUSS: Nodes = ((0.5 - 12**-0.5, 0.5), (0.5 + 12**-0.5, 0.5), (1.0, 0.0))
"""Nodes and weights of Gauss's quadrature with two points, which finds means of cubics."""

MIDDLE: Nodes = ((0.5, 1.0), (1.0, 0.0))
"""The same with one point, for straight lines: a sample of an FMU of slide-fmu shows no more."""


def require_no_loop(
    system: CoupledSystem, components: Sequence[Component], options: CouplingOptions
) -> None:
    """Refuse a circle of components with direct feedthrough that no method can solve.

    Explicit methods solve none, and implicit ones need components that can go back.
    """
    through = {one.name for one in components if one.feeds_through and one.inputs == "held"}
    after: dict[str, set[str]] = {name: set() for name in through}
    for link in system.links:
        if {link.source.component, link.target.component} <= through:
            after[link.source.component].add(link.target.component)
    circle = [name for name in after if name in _reached(after, name)]
    if options.method not in IMPLICIT and circle:
        raise CoSimulationError(
            f"method {options.method!r}: outputs of {sorted(circle)} depend on their inputs at "
            "the same time, in a circle; expected no such algebraic loop: choose method 'newton', "
            "or cut the system where an output is a state, such as a displacement"
        )
    once = [one.name for one in components if one.name in circle and not one.rolls_back]
    if once:
        raise CoSimulationError(
            f"outputs of {sorted(circle)} depend on their inputs at the same time, in a circle; "
            f"expected FMUs that can go back to a former state, which {once} cannot "
            "(canGetAndSetFMUstate): export them so that they can, or cut the system where an "
            "output is a state, such as a displacement"
        )


def _reached(after: Mapping[str, set[str]], name: str) -> set[str]:
    """Return all that is reached from a name, which counts itself in a circle alone."""
    reached: set[str] = set()
    new = set(after[name])
    while new:
        reached |= new
        new = set().union(*(after[one] for one in new)) - reached
    return reached


def mixed(
    system: CoupledSystem,
    components: Sequence[Component],
    options: CouplingOptions,
    held: NDArray[np.bool_],
) -> tuple[Mix, list[str]]:
    """Return how linked inputs come from outputs, with remarks; in explicit steps only whether
    they are those of the start of a step.

    An input that moves reaches the output at the end of the step. One that is held is its mean
    over the step: of a smooth output the mean of both ends. An output that follows the slope of
    inputs jumps when a step begins, so that it is read within the step. Whether an output is
    sampled, and so constant over a step, its own description says: an input that an FMU holds may
    be the force of a spring as well as the output of a controller.
    """
    names = [one.name for one in components]
    count = len(system.links)
    mix = Mix(np.zeros(count), np.zeros(count), np.zeros(count))
    remarks: list[str] = []
    for i, link in enumerate(system.links):
        source = components[names.index(link.source.component)]
        if system.variable(link.source).variability == "discrete":
            mix.start[i] = 1.0  # as a controller's output, it is held until the step ends
        elif options.method not in IMPLICIT:
            continue
        elif not held[i]:
            mix.end[i] = 1.0
        elif not source.follows:
            mix.start[i] = mix.end[i] = 0.5
        elif nodes := _nodes(source, options):
            source.nodes, mix.mean[i] = nodes, 1.0
        else:
            mix.end[i] = 1.0
            remarks.append(
                f"{link.target} is held at the value of {link.source} at the end of each step, "
                f"since {source.name} takes no shorter steps: motions are damped more, and errors "
                "may be many times larger; make this FMU with a shorter step"
            )
    remarks += [
        f"{one.name} takes part explicitly, since its FMU cannot go back to a former state "
        "(canGetAndSetFMUstate): compare with a run at half the step"
        for one in components
        if options.method in IMPLICIT and not one.rolls_back and one.linked
    ]
    return mix, remarks


def _nodes(component: Component, options: CouplingOptions) -> Nodes | None:
    """Return the parts of a step at which a component is read for its mean; None without any.

    An FMU that takes steps of one length alone is read after each of its own.
    """
    if component.any_step:  # samples of a surrogate alone would give ten times the error
        return MIDDLE if component.has_slopes(options.step) else GAUSS
    own = component.own_step
    return None if own is None or round(options.step / own) < 2 else own_nodes(options.step, own)
