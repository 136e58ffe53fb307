"""Compares the wakes of `wake detect` with the ships of `wake simulate --product`: positions, headings, radial velocities.

    python3 tests/foreign/compare_map.py SHIPS.geojson wakes.geojson [--each]

The direction of increasing range is that of a plane through the tips of the wakes. `--each` also prints every ship: how far the tip
of its wake lies astern of the stern and to starboard of the track, the turn, and both velocities.
"""
import json
import math
import statistics
import sys

RADIUS = 6_371_000.0  # m
FARTHEST = 600.0  # m

ships = json.load(open(sys.argv[1]))["features"]
wakes = json.load(open(sys.argv[2]))["features"]
wakes = [wake for wake in wakes if wake["properties"]["type"] == "wake" and wake["properties"]["sure"]]
middle = statistics.mean(ship["geometry"]["coordinates"][1] for ship in ships)


def metres(place):
    """East and north on a plane: 40 km are off by some metres."""
    longitude, latitude = (math.radians(value) for value in place)
    return longitude * RADIUS * math.cos(math.radians(middle)), latitude * RADIUS


def slopes(values):
    """Change of values with (line, pixel), by least squares over the tips of the wakes."""
    places = [(wake["properties"]["line"], wake["properties"]["pixel"]) for wake in wakes]
    means = [statistics.mean(part) for part in zip(*places)]
    mean = statistics.mean(values)
    away = [(line - means[0], pixel - means[1], value - mean) for (line, pixel), value in zip(places, values)]
    a, b, c = (sum(d[i] * d[j] for d in away) for i, j in [(0, 0), (0, 1), (1, 1)])
    p, q = (sum(d[i] * d[2] for d in away) for i in range(2))
    return (c * p - b * q) / (a * c - b * b), (a * q - b * p) / (a * c - b * b)


tips = [metres(wake["geometry"]["coordinates"][0]) for wake in wakes]
range_azimuth = math.atan2(slopes([east for east, _ in tips])[1], slopes([north for _, north in tips])[1])
each = "--each" in sys.argv
errors = {"position [m]": [], "heading [deg]": [], "radial velocity [m/s]": []}
taken = set()
for ship in ships:
    heading = math.radians(ship["properties"]["heading"])
    speed, length = ship["properties"]["speed"], ship["properties"]["length"]
    x, y = metres(ship["geometry"]["coordinates"])
    stern = x - 0.5 * length * math.sin(heading), y - 0.5 * length * math.cos(heading)

    def away(n):
        return math.dist(stern, metres(wakes[n]["geometry"]["coordinates"][0]))

    free = [n for n in range(len(wakes)) if n not in taken]
    nearest = min(free, key=away, default=None)
    if nearest is None or away(nearest) > FARTHEST:
        continue
    taken.add(nearest)
    found = wakes[nearest]["properties"]
    turn = (found["heading_deg"] - math.degrees(heading) + 180) % 360 - 180
    errors["position [m]"].append(away(nearest))
    errors["heading [deg]"].append(abs(turn))
    toward = -speed * math.cos(heading - range_azimuth) * math.sin(math.radians(found["incidence_deg"]))
    if each:
        tip = metres(wakes[nearest]["geometry"]["coordinates"][0])
        east, north = tip[0] - stern[0], tip[1] - stern[1]
        astern = -(east * math.sin(heading) + north * math.cos(heading))
        starboard = east * math.cos(heading) - north * math.sin(heading)
        read = found["radial_velocity_m_s"]
        print(
            f"{length:4.0f} m, {speed:4.1f} m/s: astern {astern:5.0f} m, starboard {starboard:4.0f} m, turn {turn:5.1f} deg, "
            f"radial velocity {'unknown' if read is None else f'{read:.2f}'} (true {toward:.2f}) m/s, score {found['score']:.2f}"
        )
    if found["radial_velocity_m_s"] is not None:
        errors["radial velocity [m/s]"].append(abs(found["radial_velocity_m_s"] - toward))
print(f"{len(taken)} of {len(ships)} ships found, {len(wakes) - len(taken)} other sure wakes")
for name, values in errors.items():
    print(f"{name}: median {statistics.median(values):.2f}, largest {max(values):.2f}, of {len(values)}")
