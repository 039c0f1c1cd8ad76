"""The quarter car of both halves as a whole, without any cut."""

import lower_half as lower
import upper_half as upper

import slide_fmu as slide

STEP = 0.02  # s


def f(x, u, p, du):
    wheel, height, speed = x[:2], x[2], x[3]
    force = lower.force(wheel, [u[0], height], p, [du[0], speed])
    return [*lower.f(wheel, [u[0], height], p, [du[0], speed]), speed, force / p.mass]


def g(x, u, p, du):
    return [x[2]]


def position_of_the_body(road):
    """Give the position of the body in m at the samples of the road, which is at rest before."""
    car = slide.FunctionSystem(
        f,
        g,
        start=[0.0] * 4,
        parameters={**lower.parameters, **upper.parameters},
        step=STEP,
        inputs=[slide.Signal("road", "m", -0.05, 0.05, hold=lower.hold)],
        outputs=[slide.Signal("position", "m", -0.1, 0.1)],
    )
    return car.simulate(road[1:, None])[:, 0]
