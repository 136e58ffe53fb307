"""Ship wakes in radar (SAR) images: physical simulation, generation from sentences, and detection.

>>> import shipwake
>>> scene = shipwake.Scene(ship={"speed": 8}, sea={"wind_speed": 3}, grid={"rows": 128, "columns": 128})
>>> image = shipwake.simulate(scene)
>>> image.speckled.shape
(128, 128)

Numbers are in SI units, angles in degrees. x is ground range, away from the radar; y is azimuth, along the flight.
Directions are clockwise from azimuth, and those toward which ships, wind and waves move.

Long calls release the interpreter's lock and run on a thread pool of the package (``threads=``). The package works after
``fork`` and ``spawn``.
"""

from . import errors
from ._core import __version__
from .dataset import CLASSES, Batch, Dataset, Item, merge_shards
from .detector import Detection, Detector
from .estimation import Alternative, Estimate, bound, estimate
from .labels import Labels, Object
from .plan import Plan, PlannedTerm
from .product import Product
from .sampler import Sample, Sampler
from .scene import Scene
from .simulation import FIELDS, Simulation, expected_intensity, simulate, simulate_batch

__all__ = [
    "CLASSES",
    "FIELDS",
    "Alternative",
    "Batch",
    "Dataset",
    "Detection",
    "Detector",
    "Estimate",
    "Item",
    "Labels",
    "Object",
    "Plan",
    "PlannedTerm",
    "Product",
    "Sample",
    "Sampler",
    "Scene",
    "Simulation",
    "__version__",
    "bound",
    "errors",
    "estimate",
    "expected_intensity",
    "merge_shards",
    "simulate",
    "simulate_batch",
]
