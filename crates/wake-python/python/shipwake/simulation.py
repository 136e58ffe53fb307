"""Physical simulation of images from scenes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _check, _core
from .errors import ArrayError, FileError, OptionError
from .labels import Labels
from .plan import Plan
from .scene import Scene, _scene

if TYPE_CHECKING:
    import xarray

__all__ = ["FIELDS", "Simulation", "expected_intensity", "simulate", "simulate_batch"]

FIELDS: Mapping[str, tuple[str, str]] = {
    "elevation": ("m", "elevation of the surface"),
    "slope_x": ("1", "slope of the surface along ground range"),
    "slope_y": ("1", "slope of the surface along azimuth"),
    "velocity_x": ("m s-1", "velocity of the water along ground range"),
    "velocity_y": ("m s-1", "velocity of the water along azimuth"),
    "velocity_z": ("m s-1", "velocity of the water upward"),
    "radial_velocity": ("m s-1", "velocity of the water toward the radar"),
    "sigma0": ("1", "normalized radar cross-section of the surface"),
    "intensity": ("1", "intensity of the image before speckle"),
    "speckled": ("1", "intensity of the image with speckle"),
}
"""Fields of a simulation, with units and meanings."""


@dataclass(frozen=True, eq=False)
class Simulation:
    """Result of :func:`simulate`. Images are ``[rows, columns]``: row 0 has the largest azimuth, column 0 the smallest
    ground range."""

    scene: Scene
    """The simulated scene."""
    fields: dict[str, npt.NDArray[np.float32]] = field(repr=False)
    """All fields by name; :data:`FIELDS` has units and meanings."""
    slc: npt.NDArray[np.complex64] | None = field(repr=False)
    """Single-look complex image, where the radar has an impulse response and one look."""
    labels: Labels = field(repr=False)
    """Labels of ships and wakes."""
    plan: Plan = field(repr=False)
    """Computed terms, and the estimated effect of terms left out."""
    seconds: dict[str, float] = field(repr=False)
    """Computing time by stage [s]."""
    accuracy: dict[str, Any] = field(repr=False)
    """Errors that the fast methods reached, beside the tolerances."""
    grey: dict[str, Any] = field(repr=False)
    """Mapping from intensity to grey of the quick-look: ``darkest_db``, ``brightest_db`` and ``mapping``."""

    @property
    def intensity(self) -> npt.NDArray[np.float32]:
        """Intensity before speckle, linear, in the unit of the normalized radar cross-section."""
        return self.fields["intensity"]

    @property
    def speckled(self) -> npt.NDArray[np.float32]:
        """Intensity with speckle: the image."""
        return self.fields["speckled"]

    def levels(self) -> npt.NDArray[np.uint8]:
        """Returns the image as 8-bit grey levels, linear in amplitude; the scale depends on the scene, not on the pixels."""
        return levels(self.speckled, self.grey)

    def _repr_png_(self) -> bytes:
        return _core.png(self.levels())

    def write_png(self, path: Any) -> None:
        """Writes the image as an 8-bit grey PNG, see :meth:`levels`."""
        _write(path, self._repr_png_())

    def to_xarray(self) -> xarray.Dataset:
        """Returns all fields as an :class:`xarray.Dataset` with coordinates ``y`` (azimuth) and ``x`` (ground range) in metres.

        Needs the package ``xarray``. The scene is an attribute, as the text of a scene file.
        """
        import xarray

        rows, columns = self.scene.shape
        spacing = self.scene.spacing
        y = (rows // 2 - np.arange(rows)) * spacing
        x = (np.arange(columns) - columns // 2) * spacing
        axes = {"units": "m"}
        variables = {
            name: (("y", "x"), values, {"units": FIELDS[name][0], "long_name": FIELDS[name][1]})
            for name, values in self.fields.items()
        }
        return xarray.Dataset(
            variables,
            coords={
                "y": ("y", y, {**axes, "long_name": "azimuth, along the flight"}),
                "x": ("x", x, {**axes, "long_name": "ground range, away from the radar"}),
            },
            attrs={"scene": self.scene.to_toml(), "source": f"shipwake {_core.__version__}"},
        )


def simulate(scene: Scene, *, threads: int | None = None, direct: bool = False) -> Simulation:
    """Simulates the radar image of a scene, with every field, labels and the plan.

    The result depends on the scene alone, not on ``threads``.

    >>> from shipwake import Scene, simulate
    >>> simulation = simulate(Scene(grid={"rows": 64, "columns": 64}))
    >>> simulation.intensity.shape, simulation.intensity.dtype
    ((64, 64), dtype('float32'))
    >>> simulation.labels.ships[0]["ship"]["speed"]
    10.0

    Args:
        scene: The scene to simulate.
        threads: Number of threads, by default one per core.
        direct: Use the slow reference methods instead of the fast ones.

    Raises:
        TooLargeError: A grid that does not fit in memory.
    """
    fields, about = _core.simulate(_scene("scene", scene)._inner, _check.threads(threads), bool(direct))
    return Simulation(
        scene=scene,
        fields=fields,
        slc=about["slc"],
        labels=Labels._of(about["labels"]),
        plan=Plan._of(about["plan"]),
        seconds=about["seconds"],
        accuracy=about["accuracy"],
        grey=about["quick_look"],
    )


def expected_intensity(scene: Scene, *, threads: int | None = None) -> npt.NDArray[np.float32]:
    """Returns the mean over all seas of the intensity before speckle, ``[rows, columns]``: the wake without random waves."""
    return _core.expected_intensity(_scene("scene", scene)._inner, _check.threads(threads))


def simulate_batch(
    theta: npt.ArrayLike,
    keys: Sequence[str],
    *,
    base: Scene | None = None,
    seed: int = 7,
    first: int = 0,
    speckle: bool = True,
    threads: int | None = None,
) -> npt.NDArray[np.float32]:
    """Simulates a scene for each row of an array of values, as a simulator for ``sbi``.

    Image i depends only on row i, ``base``, ``seed`` and ``first + i``, so a batch can be split anywhere and made by any
    number of threads or machines.

    >>> import numpy as np
    >>> from shipwake import Scene, simulate_batch
    >>> base = Scene(grid={"rows": 32, "columns": 32})
    >>> theta = np.array([[6.0, 2.0], [12.0, 4.0]])
    >>> simulate_batch(theta, keys=["ship.speed", "sea.wind_speed"], base=base).shape
    (2, 1, 32, 32)

    Args:
        theta: Values ``[n, k]``.
        keys: ``k`` keys of a scene, such as ``"ship.speed"``.
        base: Scene with the values of all other keys; by default the default scene.
        seed: Seed of the batch; the random sea of image i comes from it and from ``first + i``.
        first: Number of the first image.
        speckle: Whether images have speckle.
        threads: Number of threads, by default one per core.

    Returns:
        ``[n, 1, rows, columns]`` intensities, linear, in the unit of the normalized radar cross-section.

    Raises:
        ArrayError: ``theta`` without two dimensions, or with another number of columns than ``keys``.
        SceneError: A value out of its range; the message names the key.
        TooLargeError: Images that do not fit in memory together.
    """
    if isinstance(keys, str) or not isinstance(keys, Sequence):
        raise OptionError(f"keys is {keys!r:.80}, expected a list of keys such as ['ship.speed']")
    values = _check.array("theta", theta, 2, np.float64)
    if values.shape[1] == 0:
        raise ArrayError("theta has no column; give a key and a column for each value that changes")
    return _core.simulate_batch(
        (Scene() if base is None else _scene("base", base))._inner,
        [_check.text("a key", key) for key in keys],
        values,
        _check.whole("seed", seed, 0, _check.LARGEST_SEED),
        _check.whole("first", first, 0, _check.LARGEST_SEED),
        bool(speckle),
        _check.threads(threads),
    )


def levels(power: npt.ArrayLike, grey: Mapping[str, Any]) -> npt.NDArray[np.uint8]:
    """Converts intensities ``[rows, columns]`` to 8-bit grey levels by a mapping such as :attr:`Simulation.grey`."""
    image = _check.array("power", power, 2, np.float32)
    darkest = _check.number("darkest_db", grey["darkest_db"], -200.0, 100.0)
    brightest = _check.number("brightest_db", grey["brightest_db"], -200.0, 100.0)
    return _core.levels(image, darkest, brightest, grey.get("mapping", "decibel") == "amplitude")


def _write(path: Any, content: bytes) -> None:
    name = _check.path("path", path)
    try:
        with open(name, "wb") as file:
            file.write(content)
    except OSError as error:
        raise FileError(f"cannot write {name}: {error.strerror}") from error
