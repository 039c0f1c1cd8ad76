"""A mass on a spring under a force, in exudyn: change this into your own multibody model.

build fills the system; an input is the load of its name, an output the sensor of its name. All
that may be written here is on the page "Your own model" of the documentation.
"""

import exudyn as exu
import exudyn.itemInterface as item

inputs = {"force": {"unit": "N", "range": [-10.0, 10.0]}}
outputs = {"position": "m"}
parameters = {"mass": 1.0, "damping": 4.0, "stiffness": 100.0}


def build(mbs, p):
    ground = mbs.AddNode(item.NodePointGround())
    node = mbs.AddNode(item.Node1D(referenceCoordinates=[0.0]))
    mbs.AddObject(item.Mass1D(nodeNumber=node, mass=p.mass))
    wall, mass = (
        mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=number, coordinate=0))
        for number in (ground, node)
    )
    mbs.AddObject(
        item.CoordinateSpringDamper(
            markerNumbers=[wall, mass], stiffness=p.stiffness, damping=p.damping
        )
    )
    mbs.AddLoad(item.LoadCoordinate(name="force", markerNumber=mass))
    coordinates = exu.OutputVariableType.Coordinates
    mbs.AddSensor(item.SensorNode("position", node, outputVariableType=coordinates))
