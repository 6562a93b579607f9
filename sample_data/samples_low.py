"""Rules for the masses of low house styles: one storey, a split level, flat roofs."""

from __future__ import annotations

from samples_draw import Draw, Dress, Mass, box, chimney, features, flat, gable, hip, palette, shed

from facade_tools.artifacts.building import Box


def bungalow(d: Draw) -> Mass:
    """Return one storey under a hip or gable, a small entrance porch, at times a rear wing."""
    w, dep, h = d.scaled(10, 16), d.scaled(7.5, 10.5), d.between(2.6, 2.9)
    roof = hip if d.chance(0.55) else gable
    pitch = d.between(20, 30, 1)
    boxes = [box("main", "general", (0, w), (0, dep), (h, roof(pitch)))]
    door = d.pick([0.35, 0.5, 0.62]) * w
    if d.chance(0.35 + 0.4 * d.size):
        x0 = d.pick([0.0, w - 5.0])
        back = d.scaled(2.5, 4.5)
        boxes.append(
            box("wing", "general", (x0, x0 + 5.0), (dep - 1, dep + back), (h, roof(pitch, "y")))
        )
    if d.chance(0.6):
        half = d.between(1.2, 2.0)
        porch = box(
            "porch", "porch", (door - half, door + half), (-1.6, 0), (2.4, gable(25, "y", 0.2))
        )
        boxes.append(porch)
    if d.chance(0.3 + 0.5 * d.size):
        g = d.pick([3.4, 6.2])
        boxes.append(box("garage", "garage", (w, w + g), (1.0, 7.0), (2.6, hip(pitch))))
    stacks = (chimney(boxes[0], 0.7, 0.5),) if d.chance(0.4) else ()
    dress = Dress(
        d.pick(["sliding", "casement"], [0.6, 0.4]),
        "sliding",
        d.between(1.2, 1.8),
        d.between(1.0, 1.3),
        1.0,
        picture=d.chance(0.6),
        door_x=door,
        blank=(0.0, 0.1, 0.4),
    )
    return Mass(tuple(boxes), dress, palette(d, "abdfi"), 2.7, stacks, features(stacks))


def ranch_l(d: Draw) -> Mass:
    """Return a long low house with a wing towards the street and a garage at its end."""
    w, dep, h = d.scaled(12, 18), d.scaled(7.5, 9.5), d.between(2.6, 2.8)
    pitch = d.between(20, 28, 1)
    wing_w, wing_d = d.scaled(4.5, 6.5), d.between(1.8, 3.6)
    roof = gable if d.chance(0.7) else hip
    main = box("main", "general", (0, w), (0, dep), (h, roof(pitch)))
    wing = box("wing", "general", (0, wing_w), (-wing_d, dep * 0.6), (h, roof(pitch, "y")))
    g = 3.6 if d.size < 0.35 else d.between(5.8, 6.6)
    depth = d.between(6.0, 6.8)
    front = d.pick([-1.2, 0.0, 0.8])
    garage = box(
        "garage", "garage", (w, w + g), (front, front + depth), (h - 0.2, gable(pitch, "y"))
    )
    boxes: list[Box] = [main, wing, garage]
    door = wing_w + d.between(1.2, 1.8)
    if d.chance(0.75):
        boxes.append(
            box(
                "porch",
                "porch",
                (wing_w, min(wing_w + d.between(3, 5), w)),
                (-1.5, 0),
                (2.45, shed(9)),
            )
        )
    if d.chance(0.35):
        x0 = d.between(2, w - 6)
        boxes.append(box("patio", "porch", (x0, x0 + 4), (dep, dep + 2.8), (2.4, flat(0.2))))
    stacks = (chimney(main, 0.5, 0.5, 0.9),) if d.chance(0.5) else ()
    dress = Dress(
        d.pick(["sliding", "sash"], [0.7, 0.3]),
        "sliding",
        d.between(1.2, 1.8),
        d.between(1.0, 1.4),
        0.9,
        picture=d.chance(0.5),
        door_x=door,
        bays=d.chance(0.25),
        blank=(0.0, 0.1, 0.4),
    )
    return Mass(tuple(boxes), dress, palette(d, "acdfh"), 2.7, stacks, features(stacks))


def cape(d: Draw) -> Mass:
    """Return a storey and a steep roof, symmetric front, door in the middle, stack in the ridge."""
    w, dep, h = d.scaled(9.5, 13), d.scaled(7.5, 9), d.between(2.7, 3.0)
    main = box("main", "general", (0, w), (0, dep), (h, gable(d.between(40, 48, 1), "x", 0.25)))
    boxes = [main]
    if d.chance(0.4):
        ell = d.scaled(3.5, 5)
        boxes.append(
            box("ell", "general", (w, w + ell), (1.5, dep - 0.5), (h - 0.3, gable(38, "x", 0.25)))
        )
    if d.chance(0.3 + 0.4 * d.size):
        g = d.pick([3.6, 6.0], [0.6, 0.4])
        boxes.append(box("garage", "garage", (-g, 0), (1.2, 7.2), (2.5, gable(35, "y", 0.25))))
    if d.chance(0.25):
        boxes.append(
            box(
                "porch", "porch", (w / 2 - 1.4, w / 2 + 1.4), (-1.3, 0), (2.5, gable(35, "y", 0.15))
            )
        )
    stacks = (chimney(main, 0.5, 0.5, 0.9),) if d.chance(0.8) else ()
    dress = Dress(
        "sash",
        "sash",
        d.between(0.85, 1.0, 0.05),
        d.between(1.3, 1.5),
        0.8,
        (2.1, 2.4, 2.8),
        (0.0, 0.05, 0.2),
        door_x=w / 2,
        sidelights=d.chance(0.4),
        patio=d.chance(0.4),
    )
    return Mass(tuple(boxes), dress, palette(d, "abgk"), 3.0, stacks, features(stacks))


def craftsman(d: Draw) -> Mass:
    """Return a low gable to the street over a deep porch that spans the front."""
    w, dep, h = d.scaled(7.5, 10.5), d.scaled(10, 14), d.between(2.8, 3.0)
    pitch = d.between(22, 28, 1)
    main = box("main", "general", (0, w), (0, dep), (h, gable(pitch, "y", 0.6)))
    full = d.chance(0.6)
    x1 = w if full else round(w * 0.6, 1)
    porch = box("porch", "porch", (0, x1), (-d.between(1.8, 2.6), 0), (2.6, gable(pitch, "y", 0.4)))
    boxes = [main, porch]
    if d.chance(0.3):
        boxes.append(box("back", "porch", (1, w - 1), (dep, dep + 2), (2.4, hip(18, "x", 0.2))))
    if d.chance(0.25 + 0.3 * d.size):
        boxes.append(box("garage", "garage", (w, w + 3.5), (4, 10), (2.5, gable(pitch, "y", 0.4))))
    stacks = (chimney(main, 0.12, 0.35, 0.8),) if d.chance(0.6) else ()
    dress = Dress(
        d.pick(["sash", "casement"], [0.75, 0.25]),
        "sash",
        d.between(0.9, 1.1, 0.05),
        d.between(1.4, 1.6),
        0.75,
        (2.4, 2.6, 2.9),
        (0.0, 0.1, 0.25),
        paired=d.chance(0.6),
        door_x=d.pick([0.3, 0.5]) * w,
        door="craftsman",
    )
    return Mass(tuple(boxes), dress, palette(d, "dfhl"), 3.0, stacks, features(stacks))


def modern_flat(d: Draw) -> Mass:
    """Return flat roofs, an upper storey that is shorter than the lower one, wide glass."""
    w, dep, s = d.scaled(11, 17), d.scaled(8, 11), 3.1
    low = box("low", "general", (0, w), (0, dep), (s, flat(0.3)))
    part = d.between(0.5, 0.75, 0.05)
    left = d.chance(0.5)
    xs = (0.0, w * part) if left else (w * (1 - part), w)
    front = d.pick([0.0, 0.0, -1.0])
    high = box("high", "general", xs, (front, dep - d.between(0, 2)), (2 * s, flat(0.3)))
    boxes = [low, high]
    if d.chance(0.75):
        g = 3.6 if d.size < 0.3 else d.between(5.8, 6.6)
        gx = (w, w + g) if left else (-g, 0.0)
        boxes.append(box("garage", "garage", gx, (0.6, 7.0), (2.7, flat(0.2))))
    if d.chance(0.5):
        boxes.append(box("terrace", "porch", (1, w * 0.6), (dep, dep + 3), (2.7, flat(0.0))))
    door = w * part + 1.2 if left else w * (1 - part) - 1.2
    if d.chance(0.5):
        boxes.append(box("canopy", "porch", (door - 1.2, door + 1.2), (-1.4, 0), (2.6, flat(0.0))))
    dress = Dress(
        "fixed",
        d.pick(["casement", "sliding"]),
        d.between(1.8, 2.6),
        d.between(1.5, 1.9),
        0.6,
        (3.2, 3.4, 4.2),
        (0.05, 0.05, 0.35),
        door_x=door,
        door="flush",
        regular=0.75,
    )
    return Mass(tuple(boxes), dress, palette(d, "ehk"), s)


def split_garage(d: Draw) -> Mass:
    """Return half a house over its garage, two storeys, beside a single storey of living rooms."""
    s = 2.7
    high_w, low_w = d.scaled(6.4, 7.6), d.scaled(6.5, 9)
    dep, pitch = d.scaled(8, 9.5), d.between(20, 28, 1)
    roof = hip if d.chance(0.5) else gable
    high = box(
        "high",
        "general",
        (0, high_w),
        (0, dep),
        (2 * s, roof(pitch, "y" if roof is gable else "x")),
    )
    low = box(
        "low", "general", (high_w, high_w + low_w), (d.pick([0.0, 0.8]), dep), (s, roof(pitch))
    )
    g = d.pick([3.4, 5.8])
    out = d.between(0.4, 1.2)
    garage = box("garage", "garage", (0.3, 0.3 + g), (-out, 6.0), (2.5, shed(10)))
    boxes = [high, low, garage]
    door = high_w + d.between(1.2, 2.0)
    if d.chance(0.5):
        boxes.append(
            box(
                "porch",
                "porch",
                (door - 1.2, door + 1.2),
                (low.y - low.depth / 2 - 1.4, low.y - low.depth / 2),
                (2.35, shed(8)),
            )
        )
    if d.chance(0.5):
        boxes.append(
            box("deck", "porch", (high_w + 1, high_w + 5), (dep, dep + 2.5), (2.3, flat(0.15)))
        )
    stacks = (chimney(high, 0.97, 0.5),) if d.chance(0.3) else ()
    dress = Dress(
        d.pick(["sliding", "casement"], [0.65, 0.35]),
        "sliding",
        d.between(1.2, 1.7),
        d.between(1.0, 1.3),
        0.95,
        (2.7, 2.9, 3.4),
        (0.0, 0.15, 0.35),
        picture=d.chance(0.6),
        door_x=door,
    )
    return Mass(tuple(boxes), dress, palette(d, "abdhi"), s, stacks, features(stacks))
