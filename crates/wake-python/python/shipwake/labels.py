"""Labels of ships and wakes in an image."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["Labels", "Object"]


@dataclass(frozen=True, eq=False)
class Object:
    """A wake or a ship that a detector should find.

    Pixels are (column, row), with whole numbers at the centres of pixels. Angles are degrees clockwise from the top of the
    image.
    """

    name: str
    """``"wake"`` or ``"ship"``."""
    box: npt.NDArray[np.float64]
    """``[4]``: x, y, width and height [pixels], cut to the image."""
    corners: npt.NDArray[np.float64]
    """``[4, 2]``: corners of the box along the track, clockwise from port ahead; may lie outside the image."""
    tip: tuple[float, float] | None
    """Bow [pixels]; ``None`` outside the image."""
    axis_deg: float
    """Direction from the tip along the object, 0 to 360."""
    half_angle_deg: float
    """Angle between axis and arms; 0 for a ship."""
    length: float
    """Length along the axis that is visible in the image [pixels]; the whole length of a ship."""
    contrast_db: float | None
    """Contrast of a wake [dB]; ``None`` for a ship."""
    snr: float | None
    """Signal-to-noise ratio of a wake for its matched filter; ``None`` for a ship."""


@dataclass(frozen=True, eq=False)
class Labels:
    """Labels of one image."""

    objects: list[Object]
    """Visible wakes, and ships whose echo is drawn."""
    ships: list[dict[str, Any]]
    """Every ship of the scene with its wake, even outside the image; keys as in ``labels.json``."""
    sea_displacement_m: float
    """Azimuth displacement of the whole sea by its mean Doppler shift [m]; the simulated image leaves it out."""

    @classmethod
    def _of(cls, labels: Mapping[str, Any]) -> Labels:
        return cls(
            objects=[_object(one) for one in labels["objects"]],
            ships=labels["ships"],
            sea_displacement_m=labels["sea_displacement_m"],
        )


def _object(one: Mapping[str, Any]) -> Object:
    tip = one["tip"]
    return Object(
        name=one["name"],
        box=np.asarray(one["box"], dtype=np.float64),
        corners=np.asarray(one["corners"], dtype=np.float64),
        tip=None if tip is None else (tip[0], tip[1]),
        axis_deg=one["axis_deg"],
        half_angle_deg=one["half_angle_deg"],
        length=one["length"],
        contrast_db=one["contrast_db"],
        snr=one["snr"],
    )
