"""A quarter car on a road: its bump stops stiffen cubically, its damper is harder in rebound."""

import exudyn as exu
import exudyn.itemInterface as item

inputs = {"road": {"unit": "m", "hold": "first_order"}}
outputs = {"body_acceleration": "m/s^2", "suspension_travel": "m", "tyre_deflection": "m"}
parameters = {"body": 300.0, "wheel": 40.0, "spring": 2e4, "bump": 4e6, "tyre": 1.8e5}

OF = exu.OutputVariableType


def build(mbs, p):
    def tyre(mbs, t, number, height, speed, *_):
        return p.tyre * (height - mbs.variables["road"])

    def suspension(mbs, t, number, travel, speed, *_):
        damping = 1800.0 if speed > 0.0 else 900.0
        return p.spring * travel + p.bump * travel**3 + damping * speed

    def deflection(mbs, t, *_):
        return [mbs.GetNodeOutput(wheel, OF.Coordinates) - mbs.variables["road"]]

    ground = mbs.AddNode(item.NodePointGround())
    wheel, body = (mbs.AddNode(item.Node1D(referenceCoordinates=[0.0])) for _ in range(2))
    mbs.AddObject(item.Mass1D(nodeNumber=wheel, mass=p.wheel))
    mbs.AddObject(item.Mass1D(nodeNumber=body, mass=p.body))
    nodes = (ground, wheel, body)
    a, b, c = (mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=n, coordinate=0)) for n in nodes)
    mbs.AddObject(item.CoordinateSpringDamper(markerNumbers=[a, b], springForceUserFunction=tyre))
    spring = mbs.AddObject(
        item.CoordinateSpringDamper(markerNumbers=[b, c], springForceUserFunction=suspension)
    )
    for sensor in (
        item.SensorNode("body_acceleration", body, outputVariableType=OF.Coordinates_tt),
        item.SensorObject("suspension_travel", spring, outputVariableType=OF.Displacement),
        item.SensorUserFunction("tyre_deflection", sensorUserFunction=deflection),
    ):
        mbs.AddSensor(sensor)
