"""Spring-steel blade with a tip mass on a positioning slide (ANCF cable, planar), hanging down.

The slide follows the commanded position through a position loop, here a spring whose end is
moved (12 Hz) and a damper to ground (0.7). The blade is 400 x 30 x 2.5 mm with a constrained
damping layer (about 6 % in the first bending mode).
"""

import exudyn as exu
import exudyn.itemInterface as item
from exudyn.beams import GenerateStraightLineANCFCable2D

inputs = {
    "command": {
        "unit": "m",
        "range": [-0.015, 0.015],
        "parameter": "loop.offset",
    }
}
outputs = {"tip_deflection": "m", "root_moment": "N.m"}
parameters = {
    "length": 0.4,  # m
    "width": 0.03,
    "thickness": 0.0025,
    "E": 2.1e11,  # N/m^2
    "rho": 7850.0,
    "retardation": 2.6e-3,  # s, material damping
    "tip_mass": 0.12,  # kg
    "slide_mass": 5.0,
    "loop_stiffness": 2.84e4,  # N/m
    "loop_damping": 528.0,  # N s/m
    "elements": 6,
}
OF = exu.OutputVariableType


def build(mbs, p):
    area = p.width * p.thickness
    EI = p.E * p.width * p.thickness**3 / 12
    cable = item.ObjectANCFCable2D(
        physicsMassPerLength=p.rho * area,
        physicsBendingStiffness=EI,
        physicsAxialStiffness=p.E * area,
        physicsBendingDamping=p.retardation * EI,
        physicsAxialDamping=1e-4 * p.E * area,
    )
    nodes, objects, *_ = GenerateStraightLineANCFCable2D(
        mbs,
        [0, 0, 0],
        [0, -p.length, 0],
        int(p.elements),
        cable,
        massProportionalLoad=[0, -9.81, 0],
    )
    root, tip = nodes[0], nodes[-1]
    ground = mbs.AddNode(item.NodePointGround())
    zero = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))

    # clamp: height and direction of the root are fixed, x is the slide
    for coordinate in (1, 2, 3):
        marker = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=root, coordinate=coordinate))
        mbs.AddObject(item.CoordinateConstraint(markerNumbers=[zero, marker]))
    slide = mbs.AddNode(item.Node1D(referenceCoordinates=[0.0]))
    mbs.AddObject(item.Mass1D(nodeNumber=slide, mass=p.slide_mass))
    slide_x = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=slide, coordinate=0))
    root_x = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=root, coordinate=0))
    mbs.AddObject(item.CoordinateConstraint(markerNumbers=[slide_x, root_x]))
    mbs.AddObject(
        item.CoordinateSpringDamper(
            name="loop",
            markerNumbers=[zero, slide_x],
            stiffness=p.loop_stiffness,
            damping=p.loop_damping,
        )
    )

    # tip mass
    at_tip = mbs.AddNode(item.NodePoint2D(referenceCoordinates=[0, -p.length]))
    body = mbs.AddObject(item.MassPoint2D(physicsMass=p.tip_mass, nodeNumber=at_tip))
    for coordinate in (0, 1):
        a = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=tip, coordinate=coordinate))
        b = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=at_tip, coordinate=coordinate))
        mbs.AddObject(item.CoordinateConstraint(markerNumbers=[a, b]))
    weight = mbs.AddMarker(item.MarkerBodyPosition(bodyNumber=body))
    mbs.AddLoad(item.Force(markerNumber=weight, loadVector=[0, -9.81 * p.tip_mass, 0]))

    def deflection(mbs, t, *_):
        return [
            mbs.GetNodeOutput(tip, OF.Displacement)[0] - mbs.GetNodeOutput(slide, OF.Coordinates)
        ]

    mbs.AddSensor(item.SensorUserFunction("tip_deflection", sensorUserFunction=deflection))
    mbs.AddSensor(
        item.SensorBody(
            "root_moment",
            bodyNumber=objects[0],
            localPosition=[0, 0, 0],
            outputVariableType=OF.TorqueLocal,
        )
    )
