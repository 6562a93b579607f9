"""Rules for the masses of house styles with two and three storeys."""

from __future__ import annotations

from samples_draw import (
    Draw,
    Dress,
    Mass,
    box,
    chimney,
    cone,
    features,
    flat,
    gable,
    hip,
    palette,
    shed,
)


def two_storey_gable(d: Draw) -> Mass:
    """Return the suburban house: two storeys, side gable, garage beside, porch at the door."""
    w, dep = d.scaled(8, 12), d.scaled(8, 10)
    s = 2.8
    h = 2 * s - d.between(0.0, 0.2)
    pitch = d.between(28, 38, 1)
    main = box("main", "general", (0, w), (0, dep), (h, gable(pitch)))
    boxes = [main]
    bay_w = d.scaled(3.4, 4.6)
    if d.chance(0.55):
        out = d.between(0.8, 1.6)
        boxes.append(
            box("gablet", "general", (0, bay_w), (-out, dep * 0.5), (h, gable(pitch, "y")))
        )
        door = bay_w + d.between(1.3, 2.0)
    else:
        door = d.pick([0.3, 0.5]) * w
    if d.chance(0.75):
        g = 3.4 if d.size < 0.4 else d.between(5.6, 6.4)
        front = d.pick([-1.5, 0.5, 1.0])
        boxes.append(
            box("garage", "garage", (w, w + g), (front, front + 6.4), (2.7, gable(pitch, "y", 0.3)))
        )
    if d.chance(0.8):
        half = 1.2
        boxes.append(
            box(
                "porch",
                "porch",
                (door - half, door + half),
                (-1.5, 0),
                (2.4, d.pick([shed(12), gable(30, "y", 0.2)])),
            )
        )
    if d.chance(0.4):
        boxes.append(box("deck", "porch", (1.5, 5.5), (dep, dep + 2.6), (2.4, flat(0.2))))
    stacks = (chimney(main, 0.85, 0.5),) if d.chance(0.35) else ()
    dress = Dress(
        d.pick(["casement", "sash", "sliding"], [0.4, 0.4, 0.2]),
        d.pick(["casement", "sliding"]),
        d.between(1.0, 1.4),
        d.between(1.2, 1.4),
        0.9,
        door_x=door,
        bays=d.chance(0.2),
        picture=d.chance(0.3),
    )
    return Mass(tuple(boxes), dress, palette(d, "abdghi"), s, stacks, features(stacks))


def hip_porches(d: Draw) -> Mass:
    """Return a foursquare: cubic, hip roof, porch over the whole front and one at the back."""
    w = d.scaled(8.4, 11)
    dep = w + d.between(-0.4, 1.2)
    s = 3.0
    main = box(
        "main", "general", (0, w), (0, dep), (2 * s - d.between(0, 0.2), hip(d.between(25, 33, 1)))
    )
    inset = 0.0 if d.chance(0.7) else 1.0
    deep = d.between(1.9, 2.6)
    porch = box("porch", "porch", (inset, w - inset), (-deep, 0), (2.65, hip(15, "x", 0.3)))
    boxes = [main, porch]
    if d.chance(0.8):
        span = d.scaled(3, 6)
        boxes.append(
            box(
                "back",
                "porch",
                (w / 2 - span / 2, w / 2 + span / 2),
                (dep, dep + 2),
                (2.5, hip(14, "x", 0.25)),
            )
        )
    if d.chance(0.2 + 0.3 * d.size):
        boxes.append(box("garage", "garage", (w, w + 3.6), (dep - 6.2, dep), (2.6, hip(25, "y"))))
    stacks = (chimney(main, 0.25, 0.6),) if d.chance(0.6) else ()
    dress = Dress(
        "sash",
        "sash",
        d.between(0.9, 1.1, 0.05),
        d.between(1.4, 1.7),
        0.75,
        (2.5, 2.7, 3.0),
        (0.0, 0.05, 0.2),
        paired=d.chance(0.35),
        door_x=d.pick([0.5, 0.18]) * w,
        sidelights=d.chance(0.3),
    )
    return Mass(tuple(boxes), dress, palette(d, "cdfgl"), s, stacks, features(stacks))


def townhouse(d: Draw) -> Mass:
    """Return a narrow, deep house of three storeys; flat with a parapet or gabled to the street."""
    w, dep, s = d.scaled(5.2, 7), d.scaled(9, 13), d.pick([2.9, 3.0, 3.1])
    flat_top = d.chance(0.5)
    top = flat(0.0) if flat_top else gable(d.between(38, 48, 1), "y", 0.2)
    main = box("main", "general", (0, w), (0, dep), (3 * s, top))
    boxes = [main]
    if d.chance(0.5):
        boxes.append(
            box(
                "annex",
                "general",
                (0, w * 0.6),
                (dep, dep + d.between(2, 3.5)),
                (s * d.pick([1, 2]), flat(0.0)),
            )
        )
    if d.chance(0.25):
        boxes.append(box("stoop", "porch", (0.2, 2.4), (-1.2, 0), (2.6, flat(0.1))))
    stacks = () if flat_top or d.chance(0.3) else (chimney(main, 0.06, 0.5, 0.6),)
    dress = Dress(
        d.pick(["sash", "casement"], [0.6, 0.4]),
        "casement",
        d.between(0.95, 1.15, 0.05),
        d.between(1.5, 1.8),
        0.75,
        (1.9, 2.1, 4.5),
        (0.0, 0.1, 0.75),
        door_x=1.2,
        regular=0.97,
        bays=d.chance(0.3),
    )
    return Mass(tuple(boxes), dress, palette(d, "cel"), s, stacks, features(stacks))


def victorian(d: Draw) -> Mass:
    """Return steep gables, a corner tower under a cone, bay windows and a porch around the door."""
    w, dep, s = d.scaled(8.5, 11.5), d.scaled(9.5, 12.5), 3.2
    pitch = d.between(42, 50, 1)
    main = box("main", "general", (0, w), (0, dep), (2 * s, hip(pitch, "y", 0.35)))
    tw = d.between(2.8, 3.4)
    left = d.chance(0.5)
    x0 = -0.9 if left else w - tw + 0.9
    tower_h = 2 * s + d.pick([0.8, 3.0], [0.4, 0.6])
    tower = box(
        "tower", "general", (x0, x0 + tw), (-0.9, tw - 0.9), (tower_h, cone(d.between(55, 62, 1)))
    )
    cross = box(
        "cross",
        "general",
        (w - 1.0, w + d.between(1, 1.8)) if left else (-d.between(1, 1.8), 1.0),
        (dep * 0.4, dep * 0.4 + 4.6),
        (2 * s, gable(pitch, "x", 0.35)),
    )
    span = (x0 + tw, w) if left else (0.0, x0)
    porch = box("porch", "porch", span, (-d.between(1.8, 2.4), 0), (2.7, hip(14, "x", 0.25)))
    boxes = [main, tower, cross, porch]
    if d.chance(0.5):
        boxes.append(
            box(
                "rear", "general", (1, w - 2), (dep, dep + d.scaled(2.5, 4)), (s, hip(25, "x", 0.3))
            )
        )
    stacks = (chimney(main, 0.4, 0.6),) + ((chimney(main, 0.7, 0.75),) if d.chance(0.4) else ())
    door = (span[0] + span[1]) / 2 if d.chance(0.5) else (span[1] - 1.2 if left else span[0] + 1.2)
    dress = Dress(
        "sash",
        "sash",
        d.between(0.85, 1.0, 0.05),
        d.between(1.7, 1.9),
        0.7,
        (2.1, 2.5, 2.8),
        (0.0, 0.1, 0.2),
        bays=True,
        door_x=door,
        door="glazed",
        regular=0.85,
        patio=d.chance(0.2),
    )
    return Mass(tuple(boxes), dress, palette(d, "fjlg"), s, stacks, features(stacks, "tower"))


def colonial(d: Draw) -> Mass:
    """Return five bays, door in the middle, end chimneys, everything mirrored."""
    w, dep, s = d.scaled(11, 14.5), d.scaled(8.5, 10.5), 3.0
    main = box("main", "general", (0, w), (0, dep), (2 * s, gable(d.between(32, 38, 1), "x", 0.3)))
    boxes = [main]
    kind = d.pick(["none", "wing", "wings", "garage"], [0.35, 0.15, 0.2, 0.3])
    if kind in ("wing", "wings"):
        ww = d.scaled(3.2, 4.6)
        boxes.append(
            box("east", "general", (w, w + ww), (1.5, dep - 1.5), (s, gable(28, "x", 0.25)))
        )
        if kind == "wings":
            boxes.append(
                box("west", "general", (-ww, 0), (1.5, dep - 1.5), (s, gable(28, "x", 0.25)))
            )
    if kind == "garage":
        boxes.append(box("garage", "garage", (w, w + 6.4), (1.5, 8.0), (2.8, gable(30, "x", 0.25))))
    if d.chance(0.55):
        boxes.append(
            box(
                "portico",
                "porch",
                (w / 2 - 1.4, w / 2 + 1.4),
                (-1.5, 0),
                (2.7, gable(28, "y", 0.15)),
            )
        )
    if d.chance(0.3):
        boxes.append(
            box("back", "porch", (w / 2 - 2.5, w / 2 + 2.5), (dep, dep + 2.4), (2.6, flat(0.2)))
        )
    stacks = (chimney(main, 0.04, 0.5, 0.8), chimney(main, 0.96, 0.5, 0.8)) if d.chance(0.7) else ()
    dress = Dress(
        "sash",
        "sash",
        d.between(0.9, 1.05, 0.05),
        d.between(1.5, 1.7),
        0.75,
        (w / 5, w / 5, 2.9),
        (0.0, 0.0, 0.1),
        door_x=w / 2,
        sidelights=True,
        regular=1.0,
        patio=d.chance(0.3),
    )
    return Mass(tuple(boxes), dress, palette(d, "abck"), s, stacks, features(stacks))


def farmhouse(d: Draw) -> Mass:
    """Return a gabled main house, a gabled wing behind or beside it, a long porch in front."""
    w, dep, s = d.scaled(9, 12), d.scaled(6.5, 8), 2.9
    pitch = d.between(38, 45, 1)
    main = box("main", "general", (0, w), (0, dep), (2 * s - 0.1, gable(pitch, "x", 0.35)))
    ww = d.scaled(4.5, 5.5)
    x0 = d.pick([0.0, w - ww, (w - ww) / 2])
    wing = box(
        "wing",
        "general",
        (x0, x0 + ww),
        (dep - 2, dep + d.scaled(4, 6)),
        (2 * s - 0.1, gable(pitch, "y", 0.35)),
    )
    boxes = [main, wing]
    if d.chance(0.5):
        boxes.append(
            box(
                "kitchen",
                "general",
                (w, w + d.scaled(3.5, 5)),
                (1.0, dep),
                (s - 0.1, gable(pitch - 6, "x", 0.3)),
            )
        )
    porch_w = w if d.chance(0.6) else w * 0.6
    boxes.append(
        box(
            "porch",
            "porch",
            (w / 2 - porch_w / 2, w / 2 + porch_w / 2),
            (-2.1, 0),
            (2.5, shed(11, 0.3)),
        )
    )
    if d.chance(0.3):
        boxes.append(
            box("garage", "garage", (-6.2, 0), (1.0, 7.2), (2.7, gable(pitch - 6, "x", 0.3)))
        )
    stacks = (chimney(main, 0.5, 0.5, 0.8),) if d.chance(0.65) else ()
    dress = Dress(
        "sash",
        d.pick(["sash", "casement"]),
        d.between(0.85, 1.0, 0.05),
        d.between(1.4, 1.6),
        0.8,
        (2.2, 2.6, 2.8),
        (0.0, 0.1, 0.2),
        door_x=w / 2,
        regular=0.95,
    )
    return Mass(tuple(boxes), dress, palette(d, "akgf"), s, stacks, features(stacks))
