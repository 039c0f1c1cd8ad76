"""The whole machine in one exudyn model: the boom, and the cylinder with its equations inside.

It is the truth for machines that are cut in the cylinder's rod (``boom.py`` and ``cylinder.py``).
Its input is the opening of the valve. Integrals of the pressures are coordinates, in MPa s, so
that pressures are rates and all equations are of second order.
"""

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np

from mbs_models.boom import cylinder
from mbs_models.boom.boom import DAMPING, EYE, FOOT, STIFFNESS, add_boom

inputs = {"valve": {"unit": "1", "range": [-1.0, 1.0], "hold": "first_order"}}
outputs = {
    "length": {"unit": "m", "range": [1.1, 1.9], "sensor": "state[0]"},
    "rate": {"unit": "m/s", "range": [-1.0, 1.0], "sensor": "state_rate[0]"},
    "pressure": {"unit": "MPa", "range": [0.0, 30.0], "sensor": "state_rate[1]"},
}
parameters = {
    **cylinder.parameters,
    "boom_load": 100.0,
    "stiffness": STIFFNESS,
    "damping": DAMPING,
    "integrator": "generalized_alpha",
    "start": "initial",
}

MEGA = 1e6


def build(mbs, p):
    """Add the boom, and one object that holds rod, piston and oil."""
    nodes = add_boom(mbs, p.boom_load)
    first = cylinder.start(None, p)
    state = mbs.AddNode(
        item.NodeGenericODE2(
            numberOfODE2Coordinates=3,
            referenceCoordinates=[0.0] * 3,
            initialCoordinates=[first[0], 0.0, 0.0],
            initialCoordinates_t=[0.0, first[2] / MEGA, first[3] / MEGA],
        )
    )

    def forces(mbs, t, number, q, q_t):
        way = np.array([EYE + q[0] - FOOT[0], q[1] - FOOT[1]])
        distance = float(np.hypot(*way))
        along = way / distance
        piston, rate, pressures = q[4], q_t[4], (MEGA * q_t[5], MEGA * q_t[6])
        speed = float(along @ q_t[:2])
        force = p.stiffness * (piston - distance) + p.damping * (rate - speed)
        rates = cylinder.pressure_rates(piston, rate, pressures, mbs.variables["valve"], p)
        moved = cylinder.push(pressures, rate, p) - force
        return [*(force * along), 0.0, 0.0, moved, rates[0] / MEGA, rates[1] / MEGA]

    mbs.AddObject(
        item.ObjectGenericODE2(
            nodeNumbers=[nodes[1], state],
            massMatrix=np.diag([0.0, 0.0, 0.0, 0.0, p.mass, 1.0, 1.0]),
            forceUserFunction=forces,
        )
    )
    kinds = {
        "state": exu.OutputVariableType.Coordinates,
        "state_rate": exu.OutputVariableType.Coordinates_t,
    }
    for name, kind in kinds.items():
        mbs.AddSensor(item.SensorNode(name, nodeNumber=state, outputVariableType=kind))
    return forces
