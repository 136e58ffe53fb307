"""Reads the GeoTIFF files of wake-geo with GDAL.

    pip install rasterio
    WAKE_GEO_OUT=out cargo test -p wake-geo --test geotiff -- --ignored files_for_others   # 4.5 GB
    python tests/foreign/read_geotiff.py out
"""

import pathlib
import sys

import numpy as np
import rasterio
from rasterio.windows import Window

folder = pathlib.Path(sys.argv[1])
line, pixel = np.mgrid[0:70, 0:53]
level = (line * 131 + pixel * 7).astype(np.uint16)

for place in ("upright", "turned", "points"):
    for kind in ("plain", "deflate"):
        for sample in ("u16", "f32"):
            with rasterio.open(folder / f"{place}_{kind}_{sample}.tif") as image:
                expected = level if sample == "u16" else level.astype(np.float32) / 4
                assert np.array_equal(image.read(1), expected), image.name
                assert image.nodata == 0, image.nodata
                if place == "points":
                    points, system = image.gcps
                    assert system.to_epsg() == 4326, system
                    # GDAL counts from the corner of a pixel, the writer from its centre.
                    found = sorted((p.row - 0.5, p.col - 0.5, p.y, p.x, p.z) for p in points)
                    wanted = [(r, c, 50 - 1e-4 * r, 7 + 1e-4 * c, 12.5) for r in (0, 69) for c in (0, 52)]
                    assert np.allclose(found, wanted, rtol=0, atol=1e-12), found
                else:
                    assert image.crs.to_epsg() == 32632, image.crs
                    x, y = image.transform * (10.5, 20.5)
                    wanted = (500100, 5999800) if place == "upright" else (500110, 5999830)
                    assert np.allclose((x, y), wanted, rtol=0, atol=1e-6), (x, y)

with rasterio.open(folder / "big.tif") as image:
    assert (image.height, image.width) == (45000, 25000)
    last = image.read(1, window=Window(24990, 44990, 10, 10))
    line, pixel = np.mgrid[44990:45000, 24990:25000]
    assert np.array_equal(last, (line + pixel / 32768).astype(np.float32))
print("GDAL reads what wake-geo writes")
