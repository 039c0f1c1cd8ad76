"""The whole quarter car, uncut, as a model of exudyn: the same equations as both halves."""

import exudyn as exu
import exudyn.itemInterface as item

from tests.own_models.halves.lower_half import TYRE, TYRE_DAMPER, WHEEL, force_on_body

inputs = {"road": {"range": (-0.1, 0.1), "unit": "m"}}  # user functions read it, and its rate
outputs = {"position": {"range": (-0.1, 0.1), "unit": "m"}}
hold = "first_order"
parameters = {"mass": 300.0}


def build(mbs, p):
    """Build wheel and body on a road."""

    def suspension(mbs, t, number, travel, rate, *_):
        return -force_on_body((0.0, 0.0), travel, rate)

    def tyre(mbs, t, number, height, rate, *_):
        road, road_rate = mbs.variables["road"], mbs.variables["road_rate"]
        return TYRE * (height - road) + TYRE_DAMPER * (rate - road_rate)

    ground = mbs.AddNode(item.NodePointGround())
    wheel, body = (mbs.AddNode(item.Node1D(referenceCoordinates=[0.0])) for _ in range(2))
    mbs.AddObject(item.Mass1D(nodeNumber=wheel, mass=WHEEL))
    mbs.AddObject(item.Mass1D(nodeNumber=body, mass=p.mass))
    ends = [item.MarkerNodeCoordinate(nodeNumber=n, coordinate=0) for n in (ground, wheel, body)]
    a, b, c = (mbs.AddMarker(end) for end in ends)
    mbs.AddObject(item.CoordinateSpringDamper("tyre", [a, b], springForceUserFunction=tyre))
    spring = item.CoordinateSpringDamper("spring", [b, c], springForceUserFunction=suspension)
    mbs.AddObject(spring)
    sensor = item.SensorNode(
        "position", body, outputVariableType=exu.OutputVariableType.Coordinates
    )
    mbs.AddSensor(sensor)
