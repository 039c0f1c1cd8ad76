"""Machine bed with a tool head: two masses, a hardening spring and a one-way damper valve."""

inputs = {"F_bed": "N", "F_head": "N"}
outputs = {"x_bed": "mm", "x_head": "mm"}
parameters = {
    "m_bed": 120.0,  # kg
    "m_head": 35.0,
    "k_bed": 5.2e4,  # N/m to the floor
    "d_bed": 520.0,  # N s/m
    "k_head": 2.4e4,  # N/m
    "k3_head": 6.0e7,  # N/m^3
    "d_in": 130.0,  # N s/m
    "d_out": 290.0,  # N s/m, the valve is shut
}
start = [0.0, 0.0, 0.0, 0.0]


def head_force(x, p):
    s = x[1] - x[0]
    v = x[3] - x[2]
    d = p.d_out if v > 0 else p.d_in
    return p.k_head * s + p.k3_head * s**3 + d * v


def f(x, u, p):
    fh = head_force(x, p)
    a_bed = (u[0] + fh - p.k_bed * x[0] - p.d_bed * x[2]) / p.m_bed
    a_head = (u[1] - fh) / p.m_head
    return [x[2], x[3], a_bed, a_head]


def g(x, u, p):
    return [1000.0 * x[0], 1000.0 * x[1]]
