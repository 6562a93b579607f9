"""New textures for resized faces: sections repeated or scaled by their rules (LNSW13 5.2.3)."""

from __future__ import annotations

import math

import cv2
import numpy as np

from ..geometry.arrays import Floats, Integers
from ..imaging.image_io import Picture
from .splitting import Split, SplitRule, split

CLEAR = 0.2  # of a wall beside windows, that a face without windows leaves out at either end
SMEARED = 2.0  # stretch of walls beyond which their texture repeats


def resized_rule(rule: SplitRule, size: float) -> SplitRule:
    """Return a group's rule brought to the size (m) of one of its faces.

    Members of a group differ a little in size; the rule was found on the largest.
    """
    factor = size / rule.size
    return SplitRule(
        tuple(factor * a for a in rule.scalable), tuple(factor * b for b in rule.insertable)
    )


def positions(rule: SplitRule, source: float, target: float, pixels: int) -> Floats:
    """Return for every pixel across the new face the place in the old one, as a share 0..1.

    source, target: sizes (m) of the face before and after. Equal sizes give the identity.
    """
    centres = (np.arange(pixels) + 0.5) / pixels * target
    own = resized_rule(rule, source)
    done = split(own, target)
    borders = np.concatenate([[0.0], np.cumsum(done.sizes)])
    section = np.clip(np.searchsorted(borders, centres, side="right") - 1, 0, len(done.sizes) - 1)
    widths = np.empty(2 * len(own.insertable) + 1)
    widths[::2], widths[1::2] = own.scalable, own.insertable
    starts = np.concatenate([[0.0], np.cumsum(widths)])[:-1]
    index = np.array(done.sources)[section]
    share = (centres - borders[section]) / np.maximum(np.diff(borders)[section], 1e-12)
    share = _unsmeared(share, done, section, bool(own.insertable))
    places: Floats = np.clip((starts[index] + share * widths[index]) / source, 0.0, 1.0)
    return places


def _unsmeared(share: Floats, done: Split, section: Integers, framed: bool) -> Floats:
    """Run through much stretched walls to and fro instead of smearing their pixels.

    An odd number of runs begins and ends like the section itself.
    """
    if not done.windows:  # a plain face: what frames the windows stays off its edges
        share = CLEAR + (1 - 2 * CLEAR) * share if framed else share
    if not SMEARED < done.stretch < math.inf:
        return share
    runs = 2 * round((done.stretch - 1) / 2) + 1
    wall = np.array(done.sources)[section] % 2 == 0
    to_and_fro = np.abs((share * runs + 1) % 2 - 1)
    return np.where(wall, to_and_fro, share)


def synthesised(
    picture: Picture,
    rules: tuple[SplitRule, SplitRule],
    source: tuple[float, float],
    target: tuple[float, float],
    density: float,
) -> Picture:
    """Return the picture of a resized face.

    rules: for columns (left to right) and for rows (top to bottom). source, target: width and
    height (m) before and after. density: pixels a metre of the result.
    """
    columns, rows = (max(1, round(size * density)) for size in target)
    x = positions(rules[0], source[0], target[0], columns) * picture.shape[1] - 0.5
    y = positions(rules[1], source[1], target[1], rows) * picture.shape[0] - 0.5
    map_x = np.broadcast_to(x.astype(np.float32), (rows, columns))
    map_y = np.broadcast_to(y.astype(np.float32)[:, None], (rows, columns))
    mapped = cv2.remap(
        picture,
        np.ascontiguousarray(map_x),
        np.ascontiguousarray(map_y),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return np.asarray(mapped, dtype=np.uint8).reshape(rows, columns, 3)
