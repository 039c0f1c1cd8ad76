"""Three thermal masses in a row, heated at both ends: conduction, convection and radiation."""

inputs = {"left_heater": "W", "right_heater": "W"}
outputs = {"left": "K", "middle": "K", "right": "K"}
parameters = {
    "capacity": 400.0,  # J/K of each
    "conductance": 2.0,  # W/K from one to the next
    "convection": 1.0,  # W/K to the surroundings
    "radiation": 2e-9,  # W/K^4: emissivity times area times Stefan-Boltzmann constant
    "surroundings": 293.0,  # K
}
start = [293.0, 293.0, 293.0]  # temperatures in K


def f(x, u, p):
    left, middle, right = x
    to_middle, to_right = p.conductance * (left - middle), p.conductance * (middle - right)
    return [
        (u[0] - to_middle - lost(left, p)) / p.capacity,
        (to_middle - to_right - lost(middle, p)) / p.capacity,
        (u[1] + to_right - lost(right, p)) / p.capacity,
    ]


def lost(temperature, p):
    hotter, radiated = temperature - p.surroundings, temperature**4 - p.surroundings**4
    return p.convection * hotter + p.radiation * radiated


def g(x, u, p):
    return x
