"""The state-space family: the cell and its equations, its network, byte layout and gradient."""
