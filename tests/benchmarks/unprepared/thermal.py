"""Power module on a finned heat sink with a fan: PythonFMU slave (co-simulation, FMI 2.0).

Built by:  pythonfmu build -f thermal.py -d .
"""

from math import ceil

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class thermal(Fmi2Slave):
    author = "drives department"
    description = "Losses and fan speed in, temperatures of chip and sink out"

    C_CHIP, C_SINK, C_BOX = 90.0, 340.0, 60.0  # J/K (chips with base plate, sink, air and sheet)
    R_CHIP = 0.11  # K/W, chip to sink at 25 degC
    R_TEMP = 1.6e-3  # 1/K, the paste gets worse when hot
    HA_0, HA_FAN, EXPONENT = 3.5, 22.0, 0.8  # W/K
    EPS_A_SIGMA = 0.9 * 0.055 * 5.67e-8  # W/K^4
    HA_BOX, FLOW = 6.0, 14.0  # W/K, air in the cabinet to outside
    T_OUT = 25.0  # degC

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.losses = 150.0
        self.fan = 0.6
        self.chip_temperature = self.sink_temperature = self.T_OUT
        self.T = [self.T_OUT] * 3
        self.register_variable(
            Real(
                "losses",
                causality=Fmi2Causality.input,
                variability=Fmi2Variability.continuous,
                description="W",
            )
        )
        self.register_variable(
            Real(
                "fan",
                causality=Fmi2Causality.input,
                variability=Fmi2Variability.continuous,
                description="share of full speed",
            )
        )
        self.register_variable(
            Real("chip_temperature", causality=Fmi2Causality.output, description="degC")
        )
        self.register_variable(
            Real("sink_temperature", causality=Fmi2Causality.output, description="degC")
        )

    def rates(self, T):
        chip, sink, air = T
        fan = min(max(self.fan, 0.0), 1.5)
        through = (chip - sink) / (self.R_CHIP * (1 + self.R_TEMP * (chip - 25.0)))
        switching = 1 + 0.0018 * (chip - 25.0)  # losses grow with the temperature
        blown = (self.HA_0 + self.HA_FAN * fan**self.EXPONENT) * (sink - air)
        radiated = self.EPS_A_SIGMA * ((sink + 273.15) ** 4 - (air + 273.15) ** 4)
        out = (self.HA_BOX + self.FLOW * fan) * (air - self.T_OUT)
        return (
            (self.losses * switching - through) / self.C_CHIP,
            (through - blown - radiated) / self.C_SINK,
            (blown + radiated - out) / self.C_BOX,
        )

    def exit_initialization_mode(self):
        # operating point: the converter has run for long under the first inputs
        for _ in range(60000):
            self.T = self.rk4(self.T, 0.2)
            if max(map(abs, self.rates(self.T))) < 1e-9:
                break
        self.set_outputs()

    def rk4(self, T, h):
        k1 = self.rates(T)
        k2 = self.rates([a + 0.5 * h * b for a, b in zip(T, k1, strict=True)])
        k3 = self.rates([a + 0.5 * h * b for a, b in zip(T, k2, strict=True)])
        k4 = self.rates([a + h * b for a, b in zip(T, k3, strict=True)])
        return [
            a + h / 6 * (p + 2 * q + 2 * r + s)
            for a, p, q, r, s in zip(T, k1, k2, k3, k4, strict=True)
        ]

    def do_step(self, current_time, step_size):
        n = max(1, ceil(step_size / 0.25 - 1e-9))
        for _ in range(n):
            self.T = self.rk4(self.T, step_size / n)
        self.set_outputs()
        return True

    def set_outputs(self):
        self.chip_temperature, self.sink_temperature, _ = self.T
