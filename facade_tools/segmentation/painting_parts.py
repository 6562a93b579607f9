"""How the parts of a rendered facade are painted, each kind in a random style."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Canvas = NDArray[np.float32]  # (height, width, 3) shares of full light
Color = NDArray[np.float32]  # (3,)
Box = tuple[int, int, int, int]  # x0, y0, x1, y1 pixels, y down

WALLS = ((212, 198, 168), (196, 186, 168), (226, 218, 200), (180, 160, 128), (150, 90, 70),
         (170, 168, 162), (205, 180, 150), (232, 228, 220), (150, 140, 122))  # fmt: skip
ROOFS = ((92, 100, 116), (120, 126, 136), (70, 72, 80), (110, 84, 72), (150, 152, 156),
         (130, 140, 156))  # fmt: skip
SKIES = ((150, 190, 235), (225, 230, 236), (190, 200, 212), (240, 243, 246), (110, 160, 220),
         (252, 252, 252))  # fmt: skip
SHOPS = ((60, 30, 28), (30, 44, 60), (28, 50, 34), (40, 38, 36), (150, 140, 126), (110, 22, 26),
         (200, 30, 30), (30, 90, 160), (70, 140, 60))  # fmt: skip
DOORS = ((70, 46, 30), (34, 50, 40), (30, 36, 56), (96, 66, 40), (50, 40, 36), (120, 100, 80))


@dataclass(frozen=True, slots=True)
class Style:
    """Everything about a facade that is drawn once; lengths in units of 1/288 of the height."""

    unit: float
    wall: Color
    trim: Color
    roof: Color
    sky: Color
    shop: Color
    door: Color
    rail: Color
    frame: Color
    joints: float
    blocks: float
    shutters: float
    curtains: float
    bars: int
    grain: float
    course: float
    leaves: bool
    surround: float
    lintel: float
    iron: float
    period: float
    see_through: float
    slab: float
    stone: bool
    clutter: int

    def px(self, length: float) -> int:
        """Return a length in pixels, at least one."""
        return max(1, round(length * self.unit))


def random_style(unit: float, rng: np.random.Generator) -> Style:
    """Return a style for a canvas of `unit` pixels a unit."""
    wall = _pick(WALLS, rng)
    return Style(
        unit, wall, np.clip(wall * np.float32(rng.uniform(0.9, 1.2)), 0, 1), _pick(ROOFS, rng),
        _pick(SKIES, rng), _pick(SHOPS, rng), _pick(DOORS, rng),
        np.full(3, rng.uniform(0.03, 0.25), np.float32),
        np.full(3, rng.choice([0.95, 0.85, 0.75, 0.5, 0.2]), np.float32),
        float(rng.choice([0, 0.05, 0.15, 0.3])), float(rng.uniform(0, 0.05)),
        float(rng.choice([0, 0, 0.1, 0.4])), float(rng.uniform(0, 0.8)), int(rng.integers(0, 5)),
        float(rng.uniform(0.005, 0.035)), float(rng.uniform(3, 14)), bool(rng.random() < 0.15),
        float(rng.uniform(0, 5)), float(rng.choice([0, 0, 3, 6, 9])), float(rng.uniform(0.15, 0.7)),
        float(rng.uniform(1.2, 4.5)), float(rng.uniform(0.6, 1.3)), float(rng.uniform(0, 4)),
        bool(rng.random() < 0.08), int(rng.integers(0, 50)),
    )  # fmt: skip


def _pick(colors: tuple[tuple[int, int, int], ...], rng: np.random.Generator) -> Color:
    base = np.array(colors[int(rng.integers(len(colors)))], np.float32) / 255
    return np.clip(base * rng.uniform(0.8, 1.15) + rng.normal(0, 0.03, 3), 0, 1).astype(np.float32)


def noise(shape: tuple[int, int], scale: float, rng: np.random.Generator) -> Canvas:
    """Return smooth noise of about unit spread, (height, width, 1)."""
    small = (max(2, int(shape[0] / scale) + 2), max(2, int(shape[1] / scale) + 2))
    field = rng.normal(0, 1, small).astype(np.float32)
    large = cv2.resize(field, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)
    return np.atleast_2d(large).astype(np.float32).reshape(*shape, 1)


def _fill(
    canvas: Canvas, box: Box, color: Color, grain: float, style: Style, rng: np.random.Generator
) -> Canvas:
    """Fill a box with a grained colour and return the view of it."""
    part = canvas[box[1] : box[3], box[0] : box[2]]
    shape = (part.shape[0], part.shape[1])
    part[:] = color
    for scale in (1.0, 3.0, 12.0):
        part += grain * noise(shape, scale * style.unit, rng)
    return part


def band(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    """Paint a ledge: lit on top, its shadow below, sometimes carried by consoles."""
    x0, y0, x1, y1 = box
    part = canvas[max(0, y0) : max(0, y1), x0:x1]
    if not part.size:
        return
    part *= np.float32(rng.uniform(0.8, 1.15))
    part[: style.px(0.7)] *= np.float32(rng.uniform(1.0, 1.3))
    depth = style.px(rng.uniform(0.5, 4))
    shadow = canvas[max(0, y1) : y1 + depth, x0:x1]
    shadow *= np.float32(rng.uniform(0.4, 0.9))
    if rng.random() < 0.4 and shadow.size:
        step = style.px(rng.uniform(2, 10))
        for x in range(0, shadow.shape[1], step):
            shadow[:, x : x + max(1, step // 3)] *= np.float32(1.5)


def _sky(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    part = _fill(canvas, box, style.sky, 0.003, style, rng)
    shape = (part.shape[0], part.shape[1])
    part += np.linspace(-0.06, 0.06, shape[0], dtype=np.float32)[:, None, None]
    part += np.float32(rng.uniform(0, 0.08)) * noise(shape, 30 * style.unit, rng)


def _wall(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    part = _fill(canvas, box, style.wall, style.grain, style, rng)
    pitch = style.px(style.course)
    for row, y in enumerate(range((-box[1]) % pitch, part.shape[0], pitch)):
        part[y : y + style.px(0.6)] *= np.float32(1 - style.joints)
        long = 3 * pitch
        for x in range(-(row % 2) * pitch - box[0] % long, part.shape[1], long):
            stone = part[y : y + pitch, max(0, x) : max(0, x + long)]
            stone *= np.float32(1 + style.blocks * rng.normal())
            stone[:, :1] *= np.float32(1 - style.joints * 0.6)


def _roof(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    part = _fill(canvas, box, style.roof, 0.02, style, rng)
    if style.bars % 2:
        part[:, (-box[0]) % style.px(9) :: style.px(9)] *= 0.8
    else:
        part[(-box[1]) % style.px(3) :: style.px(3)] *= 0.92
    part[: style.px(1)] *= np.float32(rng.uniform(0.7, 1.3))


def _chimney(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    _fill(canvas, box, style.wall * np.float32(rng.uniform(0.6, 1.05)), 0.03, style, rng)
    canvas[box[1] : box[1] + style.px(2), box[0] : box[2]] *= 0.7
    wide = style.px(3)
    for x in range(box[0] + wide // 2, box[2] - wide, 2 * wide):
        top = max(0, box[1] - style.px(rng.uniform(2, 6)))
        canvas[top : box[1], x : x + wide] = np.array([0.6, 0.35, 0.25], np.float32)


def _window(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    _around(canvas, box, style, rng)
    glass = np.array([0.95, 1.0, 1.08], np.float32) * np.float32(rng.uniform(0.05, 0.5))
    part = _fill(canvas, box, glass, 0.05, style, rng)
    tall, wide = part.shape[:2]
    if rng.random() < style.shutters:
        part[:] = style.frame * np.float32(rng.uniform(0.6, 1.0))
        part[:: style.px(1.5)] *= 0.8
        return
    ramp = np.linspace(rng.uniform(-0.1, 0.25), rng.uniform(-0.1, 0.1), tall)
    part += ramp.astype(np.float32)[:, None, None]
    if rng.random() < style.curtains:
        cloth = np.float32(rng.uniform(0.3, 0.8))
        width = int(wide * rng.uniform(0.15, 0.55))
        for side in (part[:, :width], part[:, wide - width :]):
            side[:] = np.float32(0.4) * side + np.float32(0.6) * cloth
    if rng.random() < 0.15:
        part[: int(tall * rng.uniform(0.1, 0.7))] = np.float32(rng.uniform(0.4, 0.9))  # a blind
    _frame(part, style)
    part[: style.px(rng.uniform(0.5, 4))] *= np.float32(rng.uniform(0.4, 0.9))  # lintel's shadow
    part[:, : style.px(0.7)] *= np.float32(rng.uniform(0.5, 1.0))


def _frame(part: Canvas, style: Style) -> None:
    tall, wide = part.shape[:2]
    thick = style.px(0.8)
    middle = wide // 2
    part[:, middle - thick // 2 : middle + (thick + 1) // 2] = style.frame
    part[:, :thick] = part[:, wide - thick :] = style.frame * np.float32(0.9)
    part[:thick] = part[tall - thick :] = style.frame * np.float32(0.9)
    for k in range(1, style.bars):
        part[k * tall // style.bars :][: style.px(0.5)] = style.frame


def _around(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    """Paint what surrounds a window: trim, lintel, open shutters."""
    x0, y0, x1, y1 = box
    border = round(style.surround * style.unit)
    around = canvas[max(0, y0 - border) : y1, max(0, x0 - border) : x1 + border]
    around[:] = np.float32(0.4) * around + np.float32(0.6) * style.trim
    around[:, :1] *= np.float32(0.8)
    around[:, -1:] *= np.float32(0.8)
    if style.lintel:
        top = y0 - border - style.px(style.lintel)
        reach = border + style.px(2)
        over = (max(0, x0 - reach), top, x1 + reach, top + style.px(style.lintel / 2))
        band(canvas, over, style, rng)
    if style.leaves:
        half = max(2, (x1 - x0) // 2)
        for left in (x0 - half, x1):
            leaf = canvas[y0:y1, max(left, 0) : max(0, left + half)]
            leaf[:] = style.frame * np.float32(0.95)
            leaf[:: style.px(1.5)] *= 0.85


def _balcony(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    x0, y0, x1, y1 = box
    part = canvas[y0:y1, x0:x1]
    above = canvas[max(0, 2 * y0 - y1) : y0, x0:x1][::-1]
    if len(above):  # what stands above goes on behind the railing
        part[: len(above)] = above
        part[len(above) :] = above[-1:]
    if style.stone:
        part[:] = style.trim * np.float32(rng.uniform(0.8, 1.0))
        part[:, (-x0) % style.px(4) :: style.px(4)] *= 0.6
    else:
        _railing(part, x0, style, rng)
    foot = style.px(style.slab)
    if style.slab > 1:
        part[-min(foot, max(1, len(part) // 4)) :] = style.trim * np.float32(rng.uniform(0.7, 1.1))
    shadow = canvas[y1 : y1 + style.px(rng.uniform(0.5, 9)), x0:x1]
    shadow *= np.float32(rng.uniform(0.35, 0.9))
    if rng.random() < 0.6:  # consoles
        wide = rng.uniform(1.5, 5)
        for x in range(0, shadow.shape[1], style.px(wide * rng.uniform(2, 6))):
            shadow[:, x : x + style.px(wide)] *= np.float32(rng.uniform(1.2, 2.2))


def _railing(part: Canvas, x0: int, style: Style, rng: np.random.Generator) -> None:
    shape = (part.shape[0], part.shape[1])
    part *= np.float32(rng.uniform(0.65, 1.0))
    iron = noise(shape, 1.5 * style.unit, rng) > 2 * style.see_through - 0.9
    part[:] = np.where(iron, np.float32(0.3) * part + np.float32(0.7) * style.rail, part)
    step = max(2, style.px(style.period))
    for k in range(max(1, step // 3)):
        part[:, (k - x0) % step :: step] *= np.float32(style.iron)
    if rng.random() < 0.7:
        part[: style.px(1)] = style.rail
    if rng.random() < 0.7:
        low = style.px(1.5)
        part[-2 * low : -low] = style.rail
    if rng.random() < 0.08:  # flowers
        green = noise(shape, 2 * style.unit, rng)[:, :, 0] > 0.4
        part[green] = rng.uniform((0.1, 0.2, 0.05), (0.4, 0.5, 0.25))


def _door(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    _around(canvas, box, style, rng)
    part = _fill(canvas, box, style.door, 0.02, style, rng)
    tall, wide = part.shape[:2]
    middle, thick = wide // 2, style.px(0.7)
    part[:, middle : middle + thick] *= 0.5
    part[:thick] *= 0.6
    if rng.random() < 0.6:
        part[: tall // 4] = np.float32(rng.uniform(0.1, 0.5))  # a fanlight
    for k in range(1, 4):
        part[k * tall // 4 :][:thick] *= np.float32(rng.uniform(0.6, 1.4))


def _shop(canvas: Canvas, box: Box, style: Style, rng: np.random.Generator) -> None:
    color = style.shop if rng.random() < 0.7 else _pick(SHOPS, rng)
    part = _fill(canvas, box, color, 0.05, style, rng)
    shape = (part.shape[0], part.shape[1])
    part += np.float32(rng.uniform(0.05, 0.25)) * np.clip(noise(shape, 6 * style.unit, rng), 0, 2)
    step = style.px(rng.uniform(10, 40))
    for x in range(int(rng.integers(2, 20)), shape[1], step):
        part[:, x : x + style.px(1.5)] = style.frame * np.float32(0.7)
        pane = part[int(shape[0] * rng.uniform(0.1, 0.5)) :, x + style.px(2) : x + step]
        if rng.random() < 0.5 and pane.size:  # with something bright or dark behind it
            pane[:] = np.float32(0.4) * pane + np.float32(0.6 * rng.uniform(0.02, 0.7))
            if rng.random() < 0.4:
                _frame(pane, style)
    if rng.random() < 0.7:  # a sign, an awning
        depth = max(1, int(shape[0] * rng.uniform(0.1, 0.45)))
        part[:depth] = _pick(SHOPS + WALLS, rng)
        if rng.random() < 0.3:
            part[:depth, :: style.px(4)] *= 1.4
        letters = part[1 : depth - 1]
        if letters.size:
            letters += 0.4 * (noise(letters.shape[:2], 2.5 * style.unit, rng) > 0.8)


# what hangs in front comes after what it hides
PAINTERS: dict[str, Callable[[Canvas, Box, Style, np.random.Generator], None]] = {
    "sky": _sky,
    "wall": _wall,
    "roof": _roof,
    "shop": _shop,
    "chimney": _chimney,
    "window": _window,
    "door": _door,
    "balcony": _balcony,
}
