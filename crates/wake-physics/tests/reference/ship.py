"""Reference values of the tests of `hull` and `kelvin`: Michell's integral for a Wigley hull.

A second implementation in plain Python and 64 bits: the integrals over the hull in closed form, the one over the
directions by trapezoids in a variable that takes the singularity away. It shares nothing with the library but Michell's
formula. Doctors and Beck (1987), Table 1, quote 1.2486e-3 for the coefficient at Froude number 0.35.

    python3 crates/wake-physics/tests/reference/ship.py

prints every value in the order of the tests. Python 3.8 or later, no packages; some seconds.
"""

import math

GRAVITY, DENSITY = 9.80665, 1025.0


def wetted_surface(length, beam, draft, n=1000):
    """Both sides of y = B/2 (1 - (2x/L)^2)(1 - (z/T)^2), by midpoints."""
    total = 0.0
    for i in range(n):
        x = (i + 0.5) / n * 0.5 * length
        for j in range(n):
            z = (j + 0.5) / n * draft
            dx = -4 * beam * x / length**2 * (1 - (z / draft) ** 2)
            dz = -beam * z / draft**2 * (1 - (2 * x / length) ** 2)
            total += math.sqrt(1 + dx * dx + dz * dz)
    return 4 * total * 0.5 * length * draft / n**2


def resistance(length, beam, draft, speed):
    """R = 4 rho g^2/(pi U^2) integral of J^2 l^2/sqrt(l^2 - 1) over l from 1; l = cosh u."""

    def hull(l):
        k = l * GRAVITY / speed**2
        half = 0.5 * length
        along = 2 * (math.sin(k * half) / k**2 - half * math.cos(k * half) / k)
        m = l * k
        a = m * draft
        # Integral of (1 - z^2/T^2) exp(m z) over z from -T to 0.
        if a < 1e-2:
            down = draft * (2 / 3 - a / 4 + a * a / 15)
        else:
            down = (1 - math.exp(-a)) / m - (2 - math.exp(-a) * (a * a + 2 * a + 2)) / (m**3 * draft**2)
        return 4 * beam / length**2 * along * down

    steps, top = 400_000, math.acosh(60.0)
    step = top / steps
    total = 0.0
    for n in range(steps + 1):
        l = math.cosh(n * step)
        weight = 0.5 if n in (0, steps) else 1.0
        total += weight * hull(l) ** 2 * l**2
    return 4 * DENSITY * GRAVITY**2 / (math.pi * speed**2) * total * step


def main():
    surface = wetted_surface(1.0, 0.1, 0.0625)
    print(f"hull::wetted_surface_of_the_standard_hull: {surface:.6f}")
    print("kelvin::wave_resistance_of_the_standard_hull: Froude number, 1000 C_w")
    for froude in (0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.8, 1.0):
        speed = froude * math.sqrt(GRAVITY)
        coefficient = resistance(1.0, 0.1, 0.0625, speed) / (0.5 * DENSITY * speed**2 * surface)
        print(f"    {froude}, {1e3 * coefficient:.4f}")
    print("kelvin::wave_resistance_of_the_scene_ship: speed, newtons")
    for speed in (6.0, 8.0, 9.0, 10.0, 12.0):
        print(f"    {speed}, {resistance(195.0, 26.0, 10.0, speed):.3e}")


if __name__ == "__main__":
    main()
