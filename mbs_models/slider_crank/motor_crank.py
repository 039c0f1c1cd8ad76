"""The whole machine in one exudyn model: motor with controller, coupling and slider-crank.

It is the truth for machines that are cut at the motor's shaft (``coupled_crank.py`` and
``motor.py``). Its input is the angle that the motor follows.
"""

import exudyn as exu
import exudyn.itemInterface as item

from mbs_models.plants.spring_masses import add_marker
from mbs_models.slider_crank.coupled_crank import DAMPING, STIFFNESS
from mbs_models.slider_crank.slider_crank_plant import Mechanism, add_mechanism

inputs = {
    "followed": {
        "unit": "rad",
        "range": [-1e3, 1e3],
        "hold": "first_order",
        "parameter": "controller.offset",
        "rate_parameter": "controller.velocityOffset",
    }
}
outputs = {
    "shaft": {"unit": "rad", "range": [-1e3, 1e3]},
    "rate": {"unit": "rad/s", "range": [-10.0, 10.0]},
    "crank": {"unit": "rad", "range": [-1e3, 1e3]},
    "crank_rate": {"unit": "rad/s", "range": [-10.0, 10.0]},
}
parameters = {
    "inertia": 0.5,
    "proportional": 400.0,
    "differential": 40.0,
    "stiffness": STIFFNESS,
    "damping": DAMPING,
    "slider_mass": 1.0,
    "elements": 6,
    "integrator": "generalized_alpha",
    "start": "initial",
}


def build(mbs, p):
    """Add the mechanism, the rotor, the coupling between them, and the controller."""
    mechanism = Mechanism(p.stiffness, p.damping, 13.8, p.slider_mass, p.elements, 1.0, 1)
    ground, crank = add_mechanism(mbs, mechanism)
    node = mbs.AddNode(item.Node1D(referenceCoordinates=[0.0]))
    mbs.AddObject(item.Mass1D(nodeNumber=node, mass=p.inertia))
    rotor = add_marker(mbs, node)
    mbs.AddObject(
        item.CoordinateSpringDamper(
            markerNumbers=[rotor, crank], stiffness=p.stiffness, damping=p.damping
        )
    )
    mbs.AddObject(
        item.CoordinateSpringDamperExt(
            name="controller",
            markerNumbers=[ground, rotor],
            stiffness=p.proportional,
            damping=p.differential,
        )
    )
    coordinates, rates = exu.OutputVariableType.Coordinates, exu.OutputVariableType.Coordinates_t
    for name, marker, kind in (
        ("shaft", rotor, coordinates),
        ("rate", rotor, rates),
        ("crank", crank, coordinates),
        ("crank_rate", crank, rates),
    ):
        mbs.AddSensor(item.SensorMarker(name, markerNumber=marker, outputVariableType=kind))
