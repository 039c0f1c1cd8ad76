"""A pendulum on a trolley as an FMU of PythonFMU, which steps by 5 ms."""

from __future__ import annotations

from pathlib import Path

SOURCE = '''
"""Trolley on a spring and a damper, with a damped pendulum; a force pushes the trolley."""

import math

from pythonfmu import Fmi2Causality, Fmi2Slave, Real

OWN_STEP = 0.005


class Pendulum(Fmi2Slave):
    description = "Damped pendulum on a trolley"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.force, self.position, self.angle = 0.0, 0.0, 0.0
        self.state = [0.0, 0.0, 0.0, 0.0]
        self.register_variable(Real("force", causality=Fmi2Causality.input, start=0.0))
        self.register_variable(Real("position", causality=Fmi2Causality.output))
        self.register_variable(Real("angle", causality=Fmi2Causality.output))

    def rates(self, x):
        trolley, bob, length, g = 20.0, 2.0, 1.0, 9.81
        s, v, a, w = x
        push = self.force - 60.0 * s - 40.0 * v
        damping = 1.4 * w
        sin, cos = math.sin(a), math.cos(a)
        mass = trolley + bob * sin * sin
        dv = (push + bob * sin * (length * w * w + g * cos) + damping * cos / length) / mass
        dw = (-cos * dv - g * sin) / length - damping / (bob * length * length)
        return [v, dv, w, dw]

    def do_step(self, current_time, step_size):
        count = max(1, round(step_size / OWN_STEP))
        h, x = step_size / count, self.state
        for _ in range(count):
            k1 = self.rates(x)
            k2 = self.rates([a + 0.5 * h * b for a, b in zip(x, k1)])
            k3 = self.rates([a + 0.5 * h * b for a, b in zip(x, k2)])
            k4 = self.rates([a + h * b for a, b in zip(x, k3)])
            x = [a + h / 6 * (p + 2 * q + 2 * r + s)
                 for a, p, q, r, s in zip(x, k1, k2, k3, k4)]
        self.state = x
        self.position, self.angle = x[0], x[2]
        return True
'''


def build(folder: Path) -> Path:
    """Write the model and build its FMU in a folder; the path of the FMU."""
    from pythonfmu.builder import FmuBuilder

    script = folder / "pendulum.py"
    script.write_text(SOURCE, encoding="utf-8")
    built = FmuBuilder.build_FMU(script, dest=folder)
    script.unlink()
    return Path(built)
