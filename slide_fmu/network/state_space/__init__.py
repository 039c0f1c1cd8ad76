"""The state-space family has its cell, equations, network, byte layout and gradient here."""
