"""Reference values of the tests of `scattering::backscatter` and `scattering::cmod5n`.

A second implementation of the same published formulas, in plain Python and 64 bits, written from the formulas in the
documentation of those functions. It finds slips of programming; it is no second source for the formulas.

    python3 crates/wake-physics/tests/reference/scattering.py

prints every value in the order of the tests, in half a minute. Python 3.8 or later, no packages.
"""

import cmath
import math

from sea_and_scattering import LIGHT, Elfouhaily, permittivity

# Coefficients of CMOD5.N, Hersbach (2010), J. Atmos. Oceanic Technol. 27, 721, numbered from 1.
CMOD5N = dict(enumerate([
    -0.6878, -0.7957, 0.3380, -0.1728, 0.0000, 0.0040, 0.1103, 0.0159, 6.7329, 2.7713, -2.2885, 0.4971, -0.7250, 0.0450,
    0.0066, 0.3222, 0.0120, 22.700, 2.0813, 3.0000, 8.3659, -3.3428, 1.3236, 6.2437, 2.3893, 0.3249, 4.1590, 1.6930,
], 1))


def cmod5n(wind, azimuth, incidence):
    """CMOD5.N; wind [m/s], degrees from upwind, degrees of incidence."""
    c, x, v = CMOD5N, (incidence - 40) / 25, wind
    a0 = sum(c[1 + n] * x**n for n in range(4))
    a1 = c[5] + c[6] * x
    a2 = c[7] + c[8] * x
    gamma = c[9] + c[10] * x + c[11] * x**2
    s0 = c[12] + c[13] * x
    s = a2 * v
    limit = 1 / (1 + math.exp(-max(s, s0)))
    a3 = limit if s >= s0 else (s / s0) ** (s0 * (1 - limit)) * limit
    b0 = a3**gamma * 10 ** (a0 + a1 * v)
    b1 = c[15] * v * (0.5 + x - math.tanh(4 * (x + c[16] + c[17] * v)))
    b1 = (c[14] * (1 + x) - b1) / (math.exp(0.34 * (v - c[18])) + 1)
    v0 = c[21] + c[22] * x + c[23] * x**2
    d1 = c[24] + c[25] * x + c[26] * x**2
    d2 = c[27] + c[28] * x
    y, y0, power = v / v0 + 1, c[19], c[20]
    if y < y0:
        a = y0 - (y0 - 1) / power
        y = a + (y - 1) ** power / (power * (y0 - 1) ** (power - 1))
    b2 = (d2 * y - d1) * math.exp(-y)
    phi = math.radians(azimuth)
    return b0 * (1 + b1 * math.cos(phi) + b2 * math.cos(2 * phi)) ** 1.6


def decibels(value):
    return 10 * math.log10(value)


class TwoScale:
    """Romeiser et al. (1997) at VV over a developed Elfouhaily sea, area weight 1/(cos s_p cos s_n).

    The wind blows along the look direction (`upwind`) or across it.
    """

    def __init__(self, hertz, degrees, wind, upwind=True):
        self.theta, self.k = math.radians(degrees), 2 * math.pi * hertz / LIGHT
        self.epsilon = permittivity(hertz, 20.0, 35.0)
        self.sea, self.upwind = Elfouhaily(wind, gravity=9.80665), upwind
        self.split = self.k / 4
        # Slopes of the waves up to the split.
        along, across = self.slopes()
        self.variance = (along, across) if upwind else (across, along)

    def slopes(self, steps=20_000):
        low, high = math.log(self.sea.peak / 30), math.log(self.split)
        step = (high - low) / steps
        sums = [0.0, 0.0]
        for n in range(steps + 1):
            k = math.exp(low + step * n)
            weight = 0.5 * step * self.sea.curvature(k) * (0.5 if n in (0, steps) else 1)
            half = self.sea.anisotropy(k) / 2
            sums[0] += weight * (1 + half)
            sums[1] += weight * (1 - half)
        return sums

    def facet(self, sx, sy):
        sp = math.atan(sx)
        sn = math.atan(sy * math.cos(sp))
        look = self.theta - sp
        cos_i = math.cos(look) * math.cos(sn)
        if cos_i <= 0 or math.cos(look) <= 0:
            return 0.0
        sin2 = 1 - cos_i**2
        kx, ky = 2 * self.k * math.sin(look), -2 * self.k * math.cos(look) * math.sin(sn)
        kb = math.hypot(kx, ky)
        passed = math.exp(-((0.86 * self.split / kb) ** 6)) if kb > 0.05 * self.split else 0.0
        if passed == 0.0:
            return 0.0
        root = cmath.sqrt(self.epsilon - sin2)
        hh = (self.epsilon - 1) / (cos_i + root) ** 2
        vv = (self.epsilon - 1) * (self.epsilon * (1 + sin2) - sin2) / (self.epsilon * cos_i + root) ** 2
        mixed = (math.sin(look) * math.cos(sn)) ** 2 / sin2 * vv + math.sin(sn) ** 2 / sin2 * hh
        phi = math.atan2(ky, kx) - (0 if self.upwind else math.pi / 2)
        spread = (1 + self.sea.anisotropy(kb) * math.cos(2 * phi)) / (2 * math.pi)
        density = self.sea.curvature(kb) / kb**4 * spread
        area = 1 / (math.cos(sp) * math.cos(sn))
        return 16 * math.pi * self.k**4 * cos_i**4 * abs(mixed) ** 2 * density * passed * area

    def tilted(self, step=0.01, reach=6.5):
        """Mean over Gaussian slopes, by trapezoids."""
        deviations = [math.sqrt(v) for v in self.variance]
        counts = [int(reach * d / step) for d in deviations]
        total = 0.0
        for i in range(-counts[0], counts[0] + 1):
            sx = i * step
            px = math.exp(-0.5 * (sx / deviations[0]) ** 2)
            for j in range(counts[1] + 1):
                sy = j * step
                py = math.exp(-0.5 * (sy / deviations[1]) ** 2) * (1 if j == 0 else 2)
                total += px * py * self.facet(sx, sy)
        return total * step**2 / (2 * math.pi * deviations[0] * deviations[1])

    def specular(self):
        """Geometric optics with the same slopes, Valenzuela (1978)."""
        root = cmath.sqrt(self.epsilon)
        reflected = abs((root - 1) / (root + 1)) ** 2
        along, across = self.variance
        density = math.exp(-0.5 * math.tan(self.theta) ** 2 / along) / (2 * math.pi * math.sqrt(along * across))
        return math.pi * reflected / math.cos(self.theta) ** 4 * density


def main():
    print("scattering::cmod5n::cmod5n_meets_the_reference: wind, incidence, dB at 0, 90, 180 degrees from upwind")
    for wind, degrees in [(3, 20), (3, 40), (5, 30), (7, 35), (10, 25), (10, 40)]:
        values = [round(decibels(cmod5n(wind, phi, degrees)), 3) for phi in (0, 90, 180)]
        print(f"    ({wind:.1f}, {degrees:.1f}, {values}),")

    print("scattering::backscatter::c_band_two_scale_meets_the_reference: wind, incidence, dB upwind, crosswind")
    for wind in (5, 10):
        for degrees in (30, 35, 40):
            both = [round(decibels(TwoScale(5.3e9, degrees, wind, up).tilted()), 3) for up in (True, False)]
            print(f"    ({wind:.1f}, {degrees:.1f}, {both}),")

    print("scattering::backscatter::x_band_parts_meet_the_reference: wind, incidence, dB of Bragg, two-scale, specular, sum")
    for wind in (3, 5, 7):
        for degrees in (16, 24, 32):
            model = TwoScale(9.6e9, degrees, wind)
            flat, bragg, specular = model.facet(0, 0), model.tilted(), model.specular()
            values = [round(decibels(v), 3) for v in (flat, bragg, specular, bragg + specular)]
            print(f"    ({wind:.1f}, {degrees:.1f}, {values}),")


if __name__ == "__main__":
    main()
