"""Reference values of the tests of `permittivity`, `scattering::bragg`, `spectrum::elfouhaily` and `spectrum::jonswap`.

A second implementation of the same published formulas, in plain Python and 64 bits, written from the formulas in the
documentation of those functions. It finds slips of programming; it is no second source for the formulas.

    python3 crates/wake-physics/tests/reference/sea_and_scattering.py

prints every value in the order of the tests. Python 3.8 or later, no packages.
"""

import cmath
import math

LIGHT = 299_792_458.0


def conductivity(t, s):
    """Stogryn et al. (1995) [S/m]; temperature in degrees C, salinity in psu."""
    pure = sum(a * t**n for n, a in enumerate([2.903602, 8.607e-2, 4.738817e-4, -2.991e-6, 4.3047e-9]))
    r15 = s * (37.5109 + 5.45216 * s + 1.4409e-2 * s**2) / (1004.75 + 182.283 * s + s**2)
    a0 = (6.9431 + 3.2841 * s - 9.9486e-2 * s**2) / (84.850 + 69.024 * s + s**2)
    a1 = 49.843 - 0.2276 * s + 0.198e-2 * s**2
    return pure * r15 * (1 + a0 * (t - 15) / (a1 + t))


def permittivity(hertz, t, s):
    """Meissner and Wentz (2004, 2012), at most 30 degrees C; time factor exp(-i w t)."""
    f = hertz / 1e9
    es = (3.70886e4 - 8.2168e1 * t) / (4.21854e2 + t)
    e1 = 5.7230 + 2.2379e-2 * t - 7.1237e-4 * t**2
    n1 = (45 + t) / (5.0478 - 7.0315e-2 * t + 6.0059e-4 * t**2)
    ei = 3.6143 + 2.8841e-2 * t
    n2 = (45 + t) / (1.3652e-1 + 1.4825e-3 * t + 2.4166e-4 * t**2)
    es *= math.exp(-3.33300e-3 * s + 4.74868e-6 * s**2)
    shift = sum(a * t**n for n, a in enumerate([2.3232e-3, -7.9208e-5, 3.6764e-6, -3.5594e-7, 8.9795e-9]))
    n1 *= 1 + s * shift
    e1 *= math.exp(-6.28908e-3 * s + 1.76032e-4 * s**2 - 9.22144e-5 * t * s)
    n2 *= 1 + s * (-1.99723e-2 + 1.81176e-4 * (t + 30) / 2)
    ei *= 1 + s * (-2.04265e-3 + 1.57883e-4 * t)
    relaxed = (es - e1) / (1 - 1j * f / n1) + (e1 - ei) / (1 - 1j * f / n2) + ei
    return relaxed + 1j * conductivity(t, s) * 17.97510 / f


def bragg(epsilon, theta):
    """|g|^2 at VV and HH; Valenzuela (1978)."""
    cos, sin2 = math.cos(theta), math.sin(theta) ** 2
    root = cmath.sqrt(epsilon - sin2)
    hh = (epsilon - 1) / (cos + root) ** 2
    vv = (epsilon - 1) * (epsilon * (1 + sin2) - sin2) / (epsilon * cos + root) ** 2
    return abs(vv) ** 2, abs(hh) ** 2


class Elfouhaily:
    """Elfouhaily et al. (1997) with log10 in the peak enhancement; drag of Wu (1982) unless another is given."""

    def __init__(self, wind, omega=0.84, gravity=9.81, drag=None):
        self.gravity, self.omega = gravity, omega
        self.friction = math.sqrt(drag or (0.8 + 0.065 * wind) * 1e-3) * wind
        self.peak = gravity * (omega / wind) ** 2
        ratio = self.friction / 0.23
        self.short = max(0.0, 0.01 * (1 + (1 if ratio <= 1 else 3) * math.log(ratio)))

    def speed(self, k):
        return math.sqrt(self.gravity / k * (1 + (k / 370.0) ** 2))

    def curvature(self, k):
        q = math.sqrt(k / self.peak) - 1
        sigma = 0.08 * (1 + 4 * self.omega**-3)
        gamma = 1.7 if self.omega <= 1 else 1.7 + 6 * math.log10(self.omega)
        shape = math.exp(-1.25 * (self.peak / k) ** 2) * gamma ** math.exp(-(q**2) / (2 * sigma**2))
        peak_speed = math.sqrt(self.gravity / self.peak)
        long = 0.006 * math.sqrt(self.omega) * peak_speed * math.exp(-self.omega / math.sqrt(10) * q)
        short = self.short * 0.23 * math.exp(-0.25 * (k / 370.0 - 1) ** 2)
        return 0.5 * (long + short) / self.speed(k) * shape

    def anisotropy(self, k):
        c, peak_speed = self.speed(k), math.sqrt(self.gravity / self.peak)
        wind = 0.13 * self.friction / 0.23 * (0.23 / c) ** 2.5
        return math.tanh(math.log(2) / 4 + 4 * (c / peak_speed) ** 2.5 + wind)

    def integral(self, weight, steps=20_000):
        """Trapezoids in ln k from a tenth of the peak to 20 k_m."""
        low, high = math.log(self.peak / 10), math.log(20 * 370.0)
        step = (high - low) / steps
        ks = (math.exp(low + step * n) for n in range(steps + 1))
        return sum(weight(k) for k in ks) * step

    def significant_height(self):
        return 4 * math.sqrt(self.integral(lambda k: self.curvature(k) / k**2))

    def slopes(self):
        up = self.integral(lambda k: 0.5 * self.curvature(k) * (1 + self.anisotropy(k) / 2))
        cross = self.integral(lambda k: 0.5 * self.curvature(k) * (1 - self.anisotropy(k) / 2))
        return up + cross, up, cross


def jonswap(wind, fetch, gravity=9.81):
    """Height [m], peak period [s] and level of Hasselmann et al. (1976), without an end; trapezoids in ln f."""
    xi = gravity * fetch / wind**2
    level, peak = 0.076 * xi**-0.22, 3.5 * gravity / wind * xi**-0.33

    def density(f):
        sigma = 0.07 if f <= peak else 0.09
        gamma = 3.3 ** math.exp(-((f - peak) ** 2) / (2 * sigma**2 * peak**2))
        return level * gravity**2 * (2 * math.pi) ** -4 * f**-5 * math.exp(-1.25 * (peak / f) ** 4) * gamma

    step = 1e-3
    frequencies = (peak * math.exp(step * n) for n in range(-1600, 7000))
    variance = sum(f * density(f) for f in frequencies) * step
    return 4 * math.sqrt(variance), 1 / peak, level


def main():
    print("permittivity::permittivity_meets_the_reference: frequency, real, imaginary")
    for hertz in (1.27e9, 5.405e9, 9.6e9):
        e = permittivity(hertz, 20.0, 35.0)
        print(f"    {hertz:.4g}, {e.real:.3f}, {e.imag:.3f}")
    print(f"    conductivity at 20, 15, 25 degrees C: {[round(conductivity(t, 35.0), 4) for t in (20, 15, 25)]}")

    print("scattering::bragg::coefficients_meet_the_reference: incidence, k_B, |g_VV|^2, |g_HH|^2")
    radar = 2 * math.pi * 9.6e9 / LIGHT
    print(f"    radar wavenumber {radar:.4f}")
    for degrees in (16, 20, 23, 26, 29, 32):
        theta = math.radians(degrees)
        vv, hh = bragg(permittivity(9.6e9, 20.0, 35.0), theta)
        print(f"    {degrees}, {2 * radar * math.sin(theta):.2f}, {vv:.4f}, {hh:.4f}")

    print("spectrum::elfouhaily::curvature_and_anisotropy_meet_the_reference: k, B at 5 and 3 m/s, delta at 5 m/s")
    five, three = Elfouhaily(5.0), Elfouhaily(3.0)
    for k in (1.0, 10.0, 100.0, 200.0, 370.0):
        print(f"    {k:g}, {five.curvature(k):.5e}, {three.curvature(k):.5e}, {five.anisotropy(k):.4f}")

    print("spectrum::elfouhaily::moments_meet_the_reference: wind, height, length of the peak, slopes: all, up, cross")
    for wind in (3.0, 5.0, 7.0):
        sea = Elfouhaily(wind)
        all_slopes, up, cross = sea.slopes()
        length = 2 * math.pi / sea.peak
        print(f"    {wind}, {sea.significant_height():.3f}, {length:.1f}, {all_slopes:.5f}, {up:.5f}, {cross:.5f}")

    print("spectrum::elfouhaily::a_fetch_makes_the_reference_seas: wind, fetch, age, height, length of the peak, slopes")
    for wind, fetch in ((3.0, 1e4), (5.0, 4e4), (7.0, 7e4)):
        age = 0.84 * math.tanh((9.81 * fetch / wind**2 / 2.2e4) ** 0.4) ** -0.75
        sea = Elfouhaily(wind, age)
        length = 2 * math.pi / sea.peak
        print(f"    {wind}, {fetch:g}, {age:.3f}, {sea.significant_height():.3f}, {length:.2f}, {sea.slopes()[0]:.4f}")

    print("spectrum::jonswap::growing_seas_meet_the_reference: wind, fetch, height, peak period, level")
    for wind, fetch in ((3.0, 1e4), (5.0, 1e4), (7.0, 1e4), (7.0, 4e4), (5.0, 4e4), (7.0, 7e4)):
        height, period, level = jonswap(wind, fetch)
        print(f"    {wind}, {fetch:g}, {height:.3f}, {period:.2f}, {level:.5f}")

    print("spectrum::elfouhaily::fixed_drag_meets_its_reference: wind, slopes")
    for wind in (3.0, 5.0, 7.0, 10.0):
        print(f"    {wind}, {Elfouhaily(wind, drag=0.00144).slopes()[0]:.5f}")


if __name__ == "__main__":
    main()
