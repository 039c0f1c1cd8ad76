"""Travel drive of a portal: servo motor, planetary gear with worn teeth, pinion shaft, carriage.

All of it is reduced to the pinion side. Angles are not states, only the twist between gear and
pinion: the carriage may roll as far as it likes. In the tooth gap the felt ring of the coupling
still pulls a little (soft stage), outside of it the shaft is stiff (hard stage).
"""

import numpy as np

inputs = {
    "motor_torque": {"unit": "N.m", "range": [-4.0, 4.0]},  # at the motor
    "load_torque": {"unit": "N.m", "range": [-25.0, 25.0]},  # at the pinion: rope, slope, wind
}
outputs = {"motor_speed": "rad/s", "load_speed": "rad/s", "shaft_torque": "N.m"}
parameters = {
    "ratio": 12.0,
    "J_motor": 2.1e-3,  # kg m^2, with brake disc and sun
    "J_load": 0.35,  # kg m^2 at the pinion
    "d_motor": 0.010,  # N m s/rad, bearings, seals and eddy-current brake
    "d_load": 1.0,  # N m s/rad
    "T_coulomb": 1.6,  # N m of the rail wipers
    "w_coulomb": 0.25,  # rad/s, where wipers let go
    "k_hard": 2200.0,  # N m/rad
    "k_soft": 140.0,  # N m/rad in the gap
    "gap": 0.006,  # rad to each side (0.34 deg)
    "edge": 0.0008,  # rad, tooth contact sets in over this
    "d_shaft": 1.6,  # N m s/rad
}
start = [0.0, 0.0, 0.0]  # twist in rad, motor speed, pinion speed in rad/s


def shaft(x, p):
    twist, motor, load = x
    rate = motor / p.ratio - load
    beyond = twist + 0.5 * (
        np.sqrt((twist - p.gap) ** 2 + p.edge**2) - np.sqrt((twist + p.gap) ** 2 + p.edge**2)
    )
    return p.k_soft * twist + (p.k_hard - p.k_soft) * beyond + p.d_shaft * rate, rate


def f(x, u, p):
    torque, rate = shaft(x, p)
    friction = p.d_load * x[2] + p.T_coulomb * np.tanh(x[2] / p.w_coulomb)
    return [
        rate,
        (u[0] - p.d_motor * x[1] - torque / p.ratio) / p.J_motor,
        (torque - friction - u[1]) / p.J_load,
    ]


def g(x, u, p):
    return [x[1], x[2], shaft(x, p)[0]]
