"""The state-space family: the cell equation, its network, its byte layout, its gradient."""

from slide_fmu.network.state_space.cell import CELL_ACTIVATIONS, Cell
from slide_fmu.network.state_space.equations import GATED
from slide_fmu.network.state_space.network import PingPong, StateSpace
from slide_fmu.network.state_space.roles import Roles

__all__ = ["CELL_ACTIVATIONS", "GATED", "Cell", "PingPong", "Roles", "StateSpace"]
