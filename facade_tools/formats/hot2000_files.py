"""HOT2000 house files (.h2k, XML) and their extract (JSON Lines) to one survey record."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element

from ..errors import InvalidInput
from . import xmltree
from .xmltree import number, text

COMPASS = ("S", "SE", "E", "NE", "N", "NW", "W", "SW")  # the format's codes 1 to 8, in order
FOUNDATIONS = ("Basement", "Crawlspace", "Slab", "Walkout")


@dataclass(frozen=True, slots=True)
class Wall:
    """A wall entry: one level, or a part of one; `adjacent` to an enclosed space. Metres."""

    label: str
    adjacent: bool
    height: float
    perimeter: float


@dataclass(frozen=True, slots=True)
class Window:
    """`count` equal windows; metres, tilt in degrees (90 = vertical), facing by compass."""

    parent: str
    count: float
    height: float
    width: float
    tilt: float
    facing: str
    style: str | None


@dataclass(frozen=True, slots=True)
class Foundation:
    """Floor on the ground: area (m²), perimeter and the exposed part of it (m)."""

    area: float
    perimeter: float
    exposed: float


@dataclass(frozen=True, slots=True)
class House:
    """What a HOT2000 file says about the outside of a house."""

    id: str
    plan_shape: str
    storeys: str
    front: str
    area_above: float | None
    walls: tuple[Wall, ...]
    windows: tuple[Window, ...]
    foundations: tuple[Foundation, ...]
    ceilings: tuple[str, ...]


# --- the extract: one JSON object a line --------------------------------------------------------


def house_from_json(row: Mapping[str, Any]) -> House:
    """Return the survey of one line; raises InvalidInput with the pointer of what is missing."""
    try:
        return House(
            id=str(row["id"]),
            plan_shape=str(row["plan_shape"]),
            storeys=str(row["storeys"]),
            front=str(row["front"]),
            area_above=_number(row.get("area_above")),
            walls=tuple(
                Wall(str(w["label"]), _true(w["adjacent"]), _n(w["height"]), _n(w["perimeter"]))
                for w in row["walls"]
            ),
            windows=tuple(map(_window_from_json, row["windows"])),
            foundations=tuple(filter(None, map(_foundation, row["foundations"]))),
            ceilings=tuple(str(c["type"]) for c in row["ceilings"]),
        )
    except KeyError as error:
        name = str(error.args[0])
        raise InvalidInput(f"has no {name!r}; expected a HOT2000 house", pointer="/") from None
    except (TypeError, ValueError, AttributeError) as error:
        raise InvalidInput(f"is no HOT2000 house: {error}", pointer="/") from None


def _window_from_json(row: Mapping[str, Any]) -> Window:
    return Window(
        str(row["parent"]),
        _n(row["n"]),
        _n(row["h"]),
        _n(row["w"]),
        _n(row.get("tilt", 90.0)),
        str(row.get("facing", "")),
        None if row.get("style") is None else str(row["style"]),
    )


def _foundation(row: Mapping[str, Any]) -> Foundation | None:
    exposed = _number(row.get("exposed_perimeter")) or 0.0
    if _true(row.get("isRectangular")):
        length, width = _number(row.get("length")), _number(row.get("width"))
        if not length or not width:
            return None
        return Foundation(length * width, 2.0 * (length + width), exposed)
    area, perimeter = _number(row.get("area")), _number(row.get("perimeter"))
    return Foundation(area, perimeter, exposed) if area and perimeter else None


def _true(value: Any) -> bool:
    return str(value).lower() in ("true", "1")


def _number(value: Any) -> float | None:
    return number(str(value)) if value is not None else None


def _n(value: Any) -> float:
    found = _number(value)
    return 0.0 if found is None else found


# --- the house file: XML ------------------------------------------------------------------------


def house_from_xml(data: bytes) -> House:
    """Return the survey of one .h2k file; raises InvalidInput where it is not one."""
    root = xmltree.parse(data)
    house = root.find("House")
    if root.tag != "HouseFile" or house is None:
        raise InvalidInput("has no <HouseFile><House>; expected a HOT2000 house file")
    said = house.find("Specifications")
    components = house.find("Components")
    if said is None or components is None:
        raise InvalidInput("has no <Specifications> or <Components>; expected a HOT2000 house")
    area = said.find("HeatedFloorArea")
    styles = _window_styles(root)
    return House(
        id=text(root, "ProgramInformation/File/Identification"),
        plan_shape=text(said, "PlanShape/English"),
        storeys=text(said, "Storeys/English"),
        front=_direction(said),
        area_above=None if area is None else number(area.get("aboveGrade")),
        walls=tuple(map(_wall, components.findall("Wall"))),
        windows=tuple(_windows(components, styles)),
        foundations=tuple(
            filter(None, (_ground_floor(e) for name in FOUNDATIONS for e in components.iter(name)))
        ),
        ceilings=tuple(text(c, "Construction/Type/English") for c in components.findall("Ceiling")),
    )


def _direction(element: Element) -> str:
    found = element.find("FacingDirection")
    code = number(found.get("code")) if found is not None else None
    return COMPASS[int(code) - 1] if code and 1 <= code <= 8 else ""


def _wall(element: Element) -> Wall:
    measures = element.find("Measurements")
    get = (lambda _: None) if measures is None else measures.get
    adjacent = _true(element.get("adjacentEnclosedSpace"))
    return Wall(text(element, "Label"), adjacent, _n(get("height")), _n(get("perimeter")))


def _window_styles(root: Element) -> dict[str, str]:
    """Return the style by the code entry's id: of the standard list, else of a user's own."""
    styles = {}
    for code in root.iterfind("Codes/Window//Code"):
        style = text(code, "Layers/Type/English") or text(code, "Layers/WindowStyle/English")
        if style:
            styles[code.get("id", "")] = style
    return styles


def _windows(components: Element, styles: Mapping[str, str]) -> Iterator[Window]:
    """Yield the windows in their order; a stranger's elements may be nested without end."""
    left = [(child, "") for child in reversed(components)]
    while left:
        element, parent = left.pop()
        if element.tag == "Window":
            yield _window(element, parent, styles)
            continue
        inner = parent if element.tag == "Components" else element.tag
        left += [(child, inner) for child in reversed(element)]


def _window(element: Element, parent: str, styles: Mapping[str, str]) -> Window:
    measures = element.find("Measurements")
    tilt = element.find("Measurements/Tilt")
    kind = element.find("Construction/Type")
    get = (lambda _: None) if measures is None else measures.get
    return Window(
        parent,
        _n(element.get("number")),
        _n(get("height")) / 1000.0,
        _n(get("width")) / 1000.0,
        90.0 if tilt is None else _n(tilt.get("value")),
        _direction(element),
        None if kind is None else styles.get(kind.get("idref", "")),
    )


def _ground_floor(element: Element) -> Foundation | None:
    measures = element.find("Floor/Measurements")
    if measures is None:
        return None
    return _foundation(
        {**measures.attrib, "exposed_perimeter": element.get("exposedSurfacePerimeter")}
    )
