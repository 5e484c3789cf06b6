"""Methods, properties and classes of what is described: sensors and their readings by kinds, and fields of lights.

A description is the JSON schema of a thing's fields: names, units, ranges, defaults and documentation. Scene files go
by the same.
"""

from __future__ import annotations

import json
from typing import Any, Dict

from . import _relief

DESCRIPTIONS: Dict[str, Any] = json.loads(_relief.descriptions())

_PLACE = """Keywords:
`at`: metres. `yaw`, `pitch`, `roll`: radians, to the left, up, right side down; or `look_at`: a point.
`every`: steps from one capture to the next. `phase`: the step's number modulo `every` at which it is due."""

_LENS = """`K`: (fx, fy, cx, cy) or a matrix (3, 3), pixels, with `distortion`, OpenCV's k1 k2 p1 p2 k3 k4 k5 k6, or
with `fisheye`, k1 to k4, and `largest_degrees` from the axis; or `fov_y_degrees`, or `fov_x_degrees`, or `half_height`,
metres, of a parallel projection; or `lens` as scene files have it."""


def kinds(schema: Dict[str, Any]) -> Dict[str, Dict[str, Any]]:
    """Choices of a schema by their names, such as the kinds of sensors: those that have fields."""
    return {kind: own for choice in schema["oneOf"] for kind, own in choice.get("properties", {}).items()}


def keywords(schema: Dict[str, Any]) -> Dict[str, Dict[str, Any]]:
    """Fields of a thing as keywords: those of its noise stand among them."""
    found: Dict[str, Dict[str, Any]] = {}
    for name, field in schema["properties"].items():
        found.update(keywords(field) if field.get("type") == "object" else {name: field})
    return found


def told(name: str, field: Dict[str, Any]) -> str:
    """A line about a field: its name, unit, range and documentation."""
    least, most = field.get("minimum", field.get("exclusiveMinimum")), field.get("maximum")
    limits = [text for text in (least is not None and f"from {least:g}", most is not None and f"to {most:g}") if text]
    parts = [field.get("unit", ""), " ".join(limits)]
    about = ", ".join(part for part in parts if part)
    return f"`{name}`{f' ({about})' if about else ''}: {' '.join(field.get('description', '').split())}"


def _add_sensor(kind: str, schema: Dict[str, Any]) -> Any:
    def add(self: Any, name: str, **arguments: Any) -> Any:
        return self._add_sensor(kind, name, arguments)

    own = "\n".join(told(name, field) for name, field in keywords(schema).items())
    lens = f"\n{_LENS}" if "lens" in schema["properties"] else ""
    about = " ".join(schema.get("description", "").split())
    add.__name__ = f"add_{kind}"
    add.__doc__ = f"Mounts or places a sensor. {about}\n\n{_PLACE}{lens}\n{own}\n\nRaises ValueError and TypeError."
    return add


def _field(name: str, field: Dict[str, Any]) -> property:
    def read(self: Any) -> Any:
        return self._field(name)

    def write(self: Any, value: Any) -> None:
        self._set_field(name, value)

    return property(read, write, doc=told(name, field))


def _reading(kind: str, schema: Dict[str, Any]) -> type:
    def value(name: str, field: Dict[str, Any]) -> property:
        return property(lambda self: self._field(name), doc=field.get("description"))

    fields = {name: value(name, field) for name, field in schema["properties"].items()}
    about = {"__doc__": schema.get("description"), "__module__": "relief", "__slots__": ()}
    return type(reading_name(kind), (_relief.Reading,), {**fields, **about})


def reading_name(kind: str) -> str:
    """Name of the class of a kind's readings."""
    return f"{kind.title().replace('_', '')}Reading"


# Classes of readings, by the kinds of sensors; contacts are a list, and have a class of their own.
READINGS: Dict[str, type] = {
    kind: _reading(kind, schema) for kind, schema in DESCRIPTIONS["readings"].items() if kind != "collision"
}
for _kind, _class in READINGS.items():
    setattr(_relief, reading_name(_kind), _class)
    _relief.__all__.append(reading_name(_kind))
for _kind, _schema in kinds(DESCRIPTIONS["sensor"]).items():
    for _class in (_relief.Sim, _relief.Entity):
        setattr(_class, f"add_{_kind}", _add_sensor(_kind, _schema))
for _name, _schema in DESCRIPTIONS["light"]["properties"].items():
    setattr(_relief.LightEntity, _name, _field(_name, _schema))
# The same by its older name.
setattr(_relief.LightEntity, "enabled", _relief.LightEntity.on)
