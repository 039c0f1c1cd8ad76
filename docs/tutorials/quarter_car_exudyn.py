"""Quarter car over a road: cubic bump stop, asymmetric damper, tyre."""

import exudyn as exu
import exudyn.itemInterface as item

inputs = {"road": "m"}  # user functions read it, and its rate, from mbs.variables
outputs = {"body_acceleration": "m/s^2", "suspension_travel": "m", "tyre_deflection": "m"}
hold = "first_order"  # the road goes on linearly between samples
parameters = {"body_mass": 300.0, "wheel_mass": 40.0, "spring": 20e3, "bump_stop": 8e6}
parameters |= {"compression": 900.0, "rebound": 1800.0, "tyre": 180e3, "tyre_damping": 100.0}
OF = exu.OutputVariableType


def build(mbs, p):
    def suspension(mbs, t, number, travel, rate, *_):
        damping = p.rebound if rate > 0 else p.compression
        return p.spring * travel + p.bump_stop * travel**3 + damping * rate

    def tyre(mbs, t, number, height, rate, *_):
        road, road_rate = mbs.variables["road"], mbs.variables["road_rate"]
        return p.tyre * (height - road) + p.tyre_damping * (rate - road_rate)

    def deflection(mbs, t, *_):
        return [mbs.GetNodeOutput(wheel, OF.Coordinates) - mbs.variables["road"]]

    ground = mbs.AddNode(item.NodePointGround())
    wheel, body = (mbs.AddNode(item.Node1D(referenceCoordinates=[0.0])) for _ in range(2))
    mbs.AddObject(item.Mass1D(nodeNumber=wheel, mass=p.wheel_mass))
    mbs.AddObject(item.Mass1D(nodeNumber=body, mass=p.body_mass))
    ends = [item.MarkerNodeCoordinate(nodeNumber=n, coordinate=0) for n in (ground, wheel, body)]
    a, b, c = (mbs.AddMarker(end) for end in ends)
    mbs.AddObject(item.CoordinateSpringDamper("tyre", [a, b], springForceUserFunction=tyre))
    spring = item.CoordinateSpringDamper("spring", [b, c], springForceUserFunction=suspension)
    travel = item.SensorObject("suspension_travel", mbs.AddObject(spring))
    travel.outputVariableType = OF.Displacement
    mbs.AddSensor(travel)
    mbs.AddSensor(item.SensorNode("body_acceleration", body, outputVariableType=OF.Coordinates_tt))
    mbs.AddSensor(item.SensorUserFunction("tyre_deflection", sensorUserFunction=deflection))
