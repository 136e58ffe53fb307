"""Packs the land of a TopoJSON file of Natural Earth: see README.md."""
import json
import sys
import zlib

STEP = 0.005  # degrees

source, target = sys.argv[1:]
with open(source) as file:
    topology = json.load(file)
scale, translate = topology["transform"]["scale"], topology["transform"]["translate"]


def points(index):
    """The points of an arc; a negative index is an arc backwards."""
    x = y = 0
    line = []
    for dx, dy in topology["arcs"][index if index >= 0 else ~index]:
        x, y = x + dx, y + dy
        place = (x * scale[0] + translate[0], y * scale[1] + translate[1])
        line.append(tuple(round(value / STEP) for value in place))
    return line if index >= 0 else line[::-1]


def continued(line):
    """A ring whose longitudes go on across 180 degrees; one around a pole is closed there."""
    turn, half, turns, result = round(360 / STEP), round(180 / STEP), 0, []
    for n, (x, y) in enumerate(line):
        if n > 0 and abs(x - line[n - 1][0]) > half:
            turns += turn if x < line[n - 1][0] else -turn
        result.append((x + turns, y))
    if abs(result[-1][0] - result[0][0]) > half:
        pole = round((90 if result[0][1] > 0 else -90) / STEP)
        result += [(result[-1][0], pole), (result[0][0], pole)]
    return result


packed = bytearray()


def add(number):
    """A whole number: its sign in the lowest bit, seven bits a byte."""
    number = 2 * number if number >= 0 else -2 * number - 1
    while number >= 128:
        packed.append(number & 127 | 128)
        number >>= 7
    packed.append(number)


land = topology["objects"]["land"]["geometries"][0]["arcs"]
rings = [ring for polygon in land for ring in polygon]
add(len(rings))
for ring in rings:
    line = [point for arc in ring for point in points(arc)]
    line = continued(line)
    line = [point for n, point in enumerate(line) if n == 0 or point != line[n - 1]]
    add(len(line))
    last = (0, 0)
    for point in line:
        add(point[0] - last[0])
        add(point[1] - last[1])
        last = point
with open(target, "wb") as file:
    file.write(zlib.compress(bytes(packed), 9))
