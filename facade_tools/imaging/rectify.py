"""Perspective to fronto-parallel: from four corners, or from two vanishing points.

A facade's horizontal and vertical lines meet in two vanishing points. With the principal point in
the middle of the picture they fix the focal length and the plane's attitude, hence the homography
up to scale; where they do not fix the focal length (one of them far away) a usual one is assumed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from ..errors import InvalidInput
from .homography import Homography, Points, applied, fitted_homography, warped
from .image_io import MAX_PIXELS, MAX_SIDE, Picture, fitted
from .rectify_lines import WORKING, segments_of, straight_share, vanishing_points

Vector = NDArray[np.float64]  # (3,) homogeneous

USUAL_FOCAL = 1.1  # of the longer side
FOCALS = (0.35, 6.0)  # of the longer side: what a camera may have
LEAST_CONFIDENCE = 0.35
SURE = 0.5  # confidence from where an angle of view is told
PARALLEL = 0.87  # of the lines that meet: with more, the picture is straight, its points are noise
LEAST_ANGLE = 8.0  # degrees
LEAST_LEAN = np.radians(5.0)  # from where proportions hang on the focal length
LEAST_TELLING = np.radians(2.0)  # out of the picture's plane: both directions, to tell that length
MOST_GROWTH = 3.0  # of a side
LEAST_SIDE = 16  # pixels
JUDGED = 200  # pixels of the shorter side at working size, from where few lines tell something
BRIGHT = 200  # of 255: darker pictures are lightened before lines are looked for in them
LARGEST_ENTRY = 1e12  # of a homography: products of three stay far from overflow


@dataclass(frozen=True, slots=True)
class Rectification:
    """How a photograph is made straight.

    homography: pixels of the photograph to pixels of the rectified picture. confidence: share of
    line length that agrees with the two directions (1 for corners). size: (width, height).
    guessed: the proportions hang on a focal length that the picture does not tell.
    """

    homography: Homography
    confidence: float
    size: tuple[int, int]
    guessed: bool = False

    @property
    def rows(self) -> tuple[tuple[float, ...], ...]:
        """The homography as rows of numbers."""
        return tuple(tuple(float(entry) for entry in row) for row in self.homography)

    def picture(self, photo: Picture) -> Picture:
        """Return the rectified picture."""
        return warped(photo, self.homography, self.size)


def from_corners(shape: tuple[int, ...], corners: Points) -> Rectification:
    """Return the rectification that makes four corners a rectangle, cropped to it.

    corners: (4, 2) pixels, top left, top right, bottom right, bottom left. Raises InvalidInput
    on corners that are no convex quadrilateral in that order, or that lie beside the picture.
    """
    _check_convex(corners)
    _check_seen(shape, corners)
    lines = [_line(corners[i], corners[(i + 1) % 4]) for i in range(4)]
    across, down = np.cross(lines[0], lines[2]), np.cross(lines[1], lines[3])
    metric, guessed = _metric(shape, across, down)
    straight = applied(metric, corners)
    sides = np.linalg.norm(np.roll(straight, -1, axis=0) - straight, axis=1)
    given = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    width, height = sides[0] + sides[2], sides[1] + sides[3]
    # as many pixels as the photograph has there
    scale = np.sqrt((given[0] + given[2]) * (given[1] + given[3]) / (width * height)) / 2
    size = _size(width * scale, height * scale, shape)
    target = np.array([[0, 0], [size[0], 0], size, [0, size[1]]], np.float64)
    return Rectification(fitted_homography(corners, target), 1.0, size, guessed)


def from_report(
    homography: Sequence[Sequence[float]], size: Sequence[int], confidence: float
) -> Rectification:
    """Return the rectification of given numbers. Raises ValueError on what is none."""
    matrix = np.array(homography, np.float64)
    width, height = (int(side) for side in size)
    if matrix.shape != (3, 3) or not (np.abs(matrix) <= LARGEST_ENTRY).all():
        raise ValueError("no homography")
    if abs(np.linalg.det(matrix)) == 0:
        raise ValueError("no homography")
    if min(width, height) < 1 or max(width, height) > MAX_SIDE or width * height > MAX_PIXELS:
        raise ValueError("no size of a picture")
    return Rectification(matrix, float(confidence), (width, height))


def automatic(picture: Picture) -> Rectification:
    """Return the rectification that a picture's own lines ask for.

    Raises InvalidInput on pictures without enough structure.
    """
    if min(picture.shape[:2]) < LEAST_SIDE:
        raise InvalidInput("is too small to show lines; name the corners")
    lines = segments_of(picture)
    across, down, confidence = vanishing_points(lines, picture.shape)
    if confidence < LEAST_CONFIDENCE:
        message = f"shows too few lines in two directions (confidence {confidence:.2f}); "
        raise InvalidInput(message + "name the corners")
    metric, guessed = _metric(picture.shape, across, down)
    return replace(_framed(picture.shape, metric, confidence), guessed=guessed)


@dataclass(frozen=True, slots=True)
class View:
    """What the lines of a picture tell of the facade in it.

    structure: share of line length that agrees with two directions, 0..1, None where the picture is
    too small to tell. angle: degrees between the facade's normal and the view, None if it looks
    straight: where its lines tell less than LEAST_ANGLE, tell it unsurely, or are about as parallel
    as they meet.
    """

    structure: float | None
    angle: float | None


def view_of(picture: Picture) -> View:
    """Return what the lines of a picture tell, with a usual focal length if they tell none."""
    small = fitted(picture, WORKING, WORKING * WORKING)
    if min(small.shape[:2]) < LEAST_SIDE:
        return View(None, None)
    lines = segments_of(_lightened(small))
    across, down, confidence = vanishing_points(lines, small.shape)
    structure = confidence if min(small.shape[:2]) >= JUDGED else None
    if confidence < SURE or straight_share(lines, small.shape, (across, down)) > PARALLEL:
        return View(structure, None)
    return View(structure, _angle(small.shape, across, down))


def _lightened(picture: Picture) -> Picture:
    """Return a dark picture as bright as others are: edges are told by differences."""
    brightest = float(np.percentile(picture.max(axis=2), 99))
    if not 0 < brightest < BRIGHT:
        return picture
    lightened: Picture = np.minimum(picture * (BRIGHT / brightest), 255).astype(np.uint8)
    return lightened


def _angle(shape: tuple[int, ...], across: Vector, down: Vector) -> float | None:
    """Return the angle (degrees) between the plane's normal and the view, None if it is small."""
    height, width = shape[:2]
    focal = USUAL_FOCAL * max(height, width)
    camera = np.array([[1, 0, -width / 2], [0, 1, -height / 2], [0, 0, focal]])
    normal = np.cross(_unit(camera @ across), _unit(camera @ down))
    angle = float(np.degrees(np.arccos(min(1.0, abs(_unit(normal)[2])))))
    return angle if angle >= LEAST_ANGLE else None


def _line(one: Vector, other: Vector) -> Vector:
    return np.cross([one[0], one[1], 1.0], [other[0], other[1], 1.0])


def _check_convex(corners: Points) -> None:
    sides = np.roll(corners, -1, axis=0) - corners
    following = np.roll(sides, -1, axis=0)
    turns = sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]
    right, below = sides[0] - sides[2], sides[1] - sides[3]
    # more upright than if it began at another corner, which would turn the picture on its side
    upright = right[0] + below[1] > abs(below[0] - right[1])
    if not np.isfinite(corners).all() or (turns <= 1e-6).any() or not upright:
        message = "corners are no convex quadrilateral in the order top left, top right, "
        raise InvalidInput(message + "bottom right, bottom left")


def _check_seen(shape: tuple[int, ...], corners: Points) -> None:
    height, width = shape[:2]
    whole = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32)
    area, _ = cv2.intersectConvexConvex(corners.astype(np.float32), whole)
    if not area > 0:
        raise InvalidInput(f"corners lie outside the picture ({width}×{height} pixels)")


def _metric(shape: tuple[int, ...], across: Vector, down: Vector) -> tuple[Homography, bool]:
    """Return the homography that undoes the perspective of a plane with two orthogonal directions.

    The middle of the picture keeps its place and scale. Also tell whether the plane leans so much
    that the focal length matters, in but one of its directions, which does not tell it.
    """
    height, width = shape[:2]
    longer = max(height, width)
    middle = np.array([[1, 0, -width / 2], [0, 1, -height / 2], [0, 0, 1.0]])
    one, other = _unit(middle @ across), _unit(middle @ down)
    measured = _focal(one, other, longer)
    focal = USUAL_FOCAL * longer if measured is None else measured
    camera = np.diag([1 / focal, 1 / focal, 1.0])
    right, below = _unit(camera @ one), _unit(camera @ other)
    right = right if right[0] > 0 else -right
    below = below if below[1] > 0 else -below
    below = _unit(below - right * (right @ below))
    plane = np.diag([focal, focal, 1.0]) @ np.column_stack([right, below, [0.0, 0.0, 1.0]])
    inverse = np.linalg.inv(plane)
    inverse /= inverse[2, 2]
    scale = np.sqrt(abs(np.linalg.det(inverse[:2, :2] - np.outer(inverse[:2, 2], inverse[2, :2]))))
    upright = np.diag([1 / scale, 1 / scale, 1.0]) @ inverse
    leans = abs(float(np.cross(right, below)[2])) < np.cos(LEAST_LEAN)
    faint = min(abs(float(right[2])), abs(float(below[2]))) < np.sin(LEAST_TELLING)
    return np.linalg.inv(middle) @ upright @ middle, bool(leans and (measured is None or faint))


def _unit(vector: Vector) -> Vector:
    unit: Vector = vector / max(float(np.linalg.norm(vector)), 1e-300)
    return unit


def _focal(one: Vector, other: Vector, longer: int) -> float | None:
    """Return the focal length for which two vanishing points are orthogonal, pixels.

    None where they do not fix one that a camera may have.
    """
    if min(abs(one[2]), abs(other[2])) > 1e-9:
        square = -(one[0] * other[0] + one[1] * other[1]) / (one[2] * other[2])
        if (FOCALS[0] * longer) ** 2 < square < (FOCALS[1] * longer) ** 2:
            return float(np.sqrt(square))
    return None


def _framed(shape: tuple[int, ...], metric: Homography, confidence: float) -> Rectification:
    """Shift a homography so that the whole picture, within limits, has positive pixels."""
    height, width = shape[:2]
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float64)
    depth = np.column_stack([corners, np.ones(4)]) @ metric[2]
    if (depth <= 0.05).any():
        raise InvalidInput("is seen at too sharp an angle; name the corners")
    mapped = applied(metric, corners)
    middle = np.array([width / 2, height / 2])
    reach = MOST_GROWTH * np.array([width, height]) / 2
    low = np.maximum(mapped.min(axis=0), middle - reach)
    high = np.minimum(mapped.max(axis=0), middle + reach)
    size = _size(high[0] - low[0], high[1] - low[1], shape)
    shift = np.array([[1, 0, -low[0]], [0, 1, -low[1]], [0, 0, 1.0]])
    return Rectification(shift @ metric, confidence, size)


def _size(width: float, height: float, shape: tuple[int, ...]) -> tuple[int, int]:
    most = int(MOST_GROWTH * max(shape[:2]))
    return min(max(round(width), 1), most), min(max(round(height), 1), most)
