"""Average precision on real tiles with its bootstrap interval, beside `wake evaluate detector` and without its code.

    wake detect DIR/tile??.png --json > detections.json
    python tests/foreign/real_tiles.py DIR/labels.json detections.json

A detection is right if its axis is within 10 degrees of a labelled wake, and its tip within 60 pixels of the label's, or its line
within 25 pixels of the label's tip and middle. Best score first, one per label. Detections nearest to an ignored wake do not count.
The interval is the central 95 % of 10,000 draws of as many tiles with replacement (seed 1). Standard library only.
"""

import json
import math
import pathlib
import random
import sys


def unit(degrees):
    return math.sin(math.radians(degrees)), -math.cos(math.radians(degrees))


def cost(found, tip, axis, length):
    """None, or how far a detection is from a label; smaller is nearer."""
    turn = abs((found["axis_deg"] - axis + 180) % 360 - 180)
    (x, y), (right, down) = tip, unit(axis)
    middle = (x + right * length / 2, y + down * length / 2)
    across = unit(found["axis_deg"])
    off = max(
        abs((px - found["tip"][0]) * across[1] - (py - found["tip"][1]) * across[0]) for px, py in (tip, middle)
    )
    away = math.dist(found["tip"], tip)
    if turn > 10 or (away > 60 and off > 25):
        return None
    return min(away / 60, 1 + off / 25) + turn / 10


def nearest(found, wake):
    costs = [cost(found, wake["tip"], wake["axis_deg"], wake["length_px"])]
    if wake.get("direction_ambiguous"):
        (x, y), (right, down), length = wake["tip"], unit(wake["axis_deg"]), wake["length_px"]
        end = (x + right * length, y + down * length)
        costs.append(cost(found, end, wake["axis_deg"] + 180, length))
    return min((c for c in costs if c is not None), default=math.inf)


def judged(wakes, detections, counted):
    """(number of wakes, [(score, right)]) of a tile."""
    labels = [wake for wake in wakes if wake["confidence"] in counted]
    ignored = [wake for wake in wakes if wake["confidence"] not in counted]
    taken, rows = set(), []
    for found in sorted(detections, key=lambda found: -found["score"]):
        fits = sorted((nearest(found, wake), i) for i, wake in enumerate(labels))
        fits = [(c, i) for c, i in fits if c < math.inf]
        other = min((nearest(found, wake) for wake in ignored), default=math.inf)
        if other < (fits[0][0] if fits else math.inf):
            continue
        free = [i for _, i in fits if i not in taken]
        taken.update(free[:1])
        rows.append((found["score"], bool(free)))
    return len(labels), rows


def average_precision(tiles):
    wakes = sum(count for count, _ in tiles)
    rows = sorted((row for _, rows in tiles for row in rows), reverse=True)
    points, right = [], 0
    for i, (score, hit) in enumerate(rows):
        right += hit
        if i + 1 == len(rows) or rows[i + 1][0] != score:
            points.append((right / wakes, right / (i + 1)))
    area = best = 0.0
    for (recall, precision), (before, _) in zip(points[::-1], (points[:-1][::-1] + [(0.0, 1.0)])):
        best = max(best, precision)
        area += (recall - before) * best
    return area


def main():
    labels = json.loads(pathlib.Path(sys.argv[1]).read_text())["images"]
    found = json.loads(pathlib.Path(sys.argv[2]).read_text())["images"]
    found = {pathlib.Path(name).name: wakes for name, wakes in found.items()}
    for counted in (["clear"], ["clear", "probable"]):
        tiles = [judged(image["wakes"], found[name], counted) for name, image in labels.items()]
        draws = random.Random(1)
        spread = sorted(average_precision(draws.choices(tiles, k=len(tiles))) for _ in range(10_000))
        low, high = spread[250], spread[-251]
        wakes = sum(count for count, _ in tiles)
        print(
            f"{' and '.join(counted)}: {len(tiles)} tiles, {wakes} wakes, "
            f"AP {average_precision(tiles):.3f}, 95 % interval {low:.2f} to {high:.2f}"
        )


if __name__ == "__main__":
    main()
