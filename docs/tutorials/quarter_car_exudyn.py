"""A quarter car on a road: its bump stops stiffen cubically, its damper is harder in rebound."""

import exudyn as exu
import exudyn.itemInterface as item

inputs = {"road": {"unit": "m", "hold": "first_order"}}
outputs = {"body_acceleration": "m/s^2", "suspension_travel": "m", "tyre_deflection": "m"}
parameters = {"body": 300.0, "wheel": 40.0, "spring": 2e4, "bump": 4e6, "tyre": 1.8e5}


def build(mbs, p):
    def tyre(mbs, t, number, height, speed, *_):
        return p.tyre * (height - mbs.variables["road"])

    def suspension(mbs, t, number, travel, speed, *_):
        damping = 1800.0 if speed > 0.0 else 900.0
        return p.spring * travel + p.bump * travel**3 + damping * speed

    ground = mbs.AddNode(item.NodePointGround())
    wheel, body = (mbs.AddNode(item.Node1D(referenceCoordinates=[0.0])) for _ in range(2))
    mbs.AddObject(item.Mass1D(nodeNumber=wheel, mass=p.wheel))
    mbs.AddObject(item.Mass1D(nodeNumber=body, mass=p.body))
    ends = [item.MarkerNodeCoordinate(nodeNumber=n, coordinate=0) for n in (ground, wheel, body)]
    a, b, c = (mbs.AddMarker(end) for end in ends)
    mbs.AddObject(item.CoordinateSpringDamper(markerNumbers=[a, b], springForceUserFunction=tyre))
    spring = item.CoordinateSpringDamper(markerNumbers=[b, c], springForceUserFunction=suspension)
    mbs.AddObject(spring)

    def place(node):
        return mbs.GetNodeOutput(node, exu.OutputVariableType.Coordinates)

    def add_sensor(name, value):
        function = lambda *_: [value()]  # noqa: E731
        mbs.AddSensor(item.SensorUserFunction(name, sensorUserFunction=function))

    kind = exu.OutputVariableType.Coordinates_tt
    mbs.AddSensor(item.SensorNode("body_acceleration", nodeNumber=body, outputVariableType=kind))
    add_sensor("suspension_travel", lambda: place(body) - place(wheel))
    add_sensor("tyre_deflection", lambda: place(wheel) - mbs.variables["road"])
