"""Writes the GeoTIFF fixtures of wake-geo with GDAL.

    pip install rasterio
    python tests/foreign/write_geotiff.py crates/wake-geo/tests/fixtures/gdal
"""

import pathlib
import sys

import numpy as np
import rasterio
from rasterio.control import GroundControlPoint
from rasterio.transform import Affine

folder = pathlib.Path(sys.argv[1])
line, pixel = np.mgrid[0:70, 0:53]
level = (line * 131 + pixel * 7).astype(np.int64)
tiles = {"tiled": True, "blockxsize": 32, "blockysize": 16}


def write(name, values, **options):
    values = values if values.ndim == 3 else values[None]
    count, height, width = values.shape
    with rasterio.open(
        folder / f"{name}.tif", "w", driver="GTiff", height=height, width=width, count=count, dtype=values.dtype, **options
    ) as image:
        image.write(values)


utm = {"crs": "EPSG:32632", "transform": Affine(10, 0, 500000, 0, -10, 6000000)}
write("tiles_deflate_float", level.astype(np.float32) / 4, compress="deflate", predictor=3, **tiles, **utm)
write("tiles_lzw_big_endian", level.astype(np.uint16), compress="lzw", predictor=2, endianness="big", **tiles, **utm)
write("tiles_lzw_float", level.astype(np.float32) / 4, compress="lzw", predictor=3, **tiles, **utm)
write("strips_lzw_bands", np.stack([level, level + 1]).astype(np.int16), compress="lzw", predictor=2, interleave="pixel", **utm)
write("strips_packbits", (level % 251).astype(np.uint8), compress="packbits", blockysize=7, **utm)
write("strips_signed_big", (level - 3000).astype(np.int16), bigtiff="yes", blockysize=9, **utm)
bands = np.stack([level, level + 1, level + 2]).astype(np.uint16)
write("bands_pixel", bands, interleave="pixel", compress="deflate", **utm)
write("bands_line", bands, interleave="band", **tiles, **utm)
points = [GroundControlPoint(r + 0.5, c + 0.5, 7 + 1e-4 * c, 50 - 1e-4 * r, 12.5) for r in (0, 69) for c in (0, 52)]
write("points", level.astype(np.uint16), gcps=points, crs="EPSG:4326")
