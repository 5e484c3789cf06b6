"""The parts of the type stubs that are made of descriptions. Run by itself it writes them anew."""

import json
import re
from pathlib import Path

from relief.described import DESCRIPTIONS, READINGS, keywords, kinds, reading_name

STUBS = Path(__file__).resolve().parents[1] / "relief/_relief.pyi"


def camel(name):
    return "".join(part.capitalize() for part in name.split("_"))


class Stubs:
    """Types of fields, and the classes that they need."""

    def __init__(self):
        self.classes = {}

    def dictionary(self, name, schema):
        """A TypedDict of a struct's fields."""
        required = schema.get("required", [])
        lines = [f"class {name}(TypedDict{'' if required else ', total=False'}):"]
        for field, own in schema["properties"].items():
            kind = self.type(own, f"{name}{camel(field)}")
            lines.append(f"    {field}: {kind if field in required or not required else f'NotRequired[{kind}]'}")
        self.classes.setdefault(name, "\n".join(lines))
        return name

    def type(self, schema, name, given=True):
        """Type of a value that is given, or read."""
        if schema.get("see") == "colour":
            return "_Color" if given else "_Rgb"
        choices = schema.get("anyOf", []) + schema.get("oneOf", [])
        own = schema.get("type", [])
        own = [own] if isinstance(own, str) else own
        if "enum" in schema or choices and all("const" in choice for choice in choices):
            names = schema.get("enum") or [choice["const"] for choice in choices]
            return f"Literal[{', '.join(json.dumps(one) for one in names if one is not None)}]"
        for kind, python in (("boolean", "bool"), ("integer", "int"), ("number", "float"), ("string", "str")):
            if kind in own:
                is_open = "null" in own and not schema.get("infinite") and not given
                return f"Optional[{python}]" if is_open else python
        if "array" in own:
            return self.array(schema, name, given)
        if "properties" in schema:
            return self.dictionary(name, schema)
        types = []
        for choice in choices:
            if "const" in choice:
                types.append(f"Literal[{json.dumps(choice['const'])}]")
            elif choice.get("type") == "object" and len(choice.get("properties", {})) == 1:
                ((key, value),) = choice["properties"].items()
                if value.get("type") == "number":
                    types.append("float")
                elif "properties" in value and "required" not in value:
                    types.append(f"Literal[{json.dumps(key)}]")
                inner = self.type(value, f"{name}{camel(key)}")
                wrapper = f"{name}{camel(key)}Choice"
                self.classes.setdefault(wrapper, f"class {wrapper}(TypedDict):\n    {key}: {inner}")
                types.append(wrapper)
            elif choice.get("type") != "null":
                types.append(self.type(choice, name, given))
        return f"Union[{', '.join(types)}]" if len(types) > 1 else types[0]

    def array(self, schema, name, given):
        items = schema.get("items") or schema["prefixItems"][0]
        one = self.type(items, name)
        count = schema.get("minItems") if schema.get("minItems") == schema.get("maxItems") else None
        if one.startswith("Literal"):
            return "Union[str, Sequence[str], NDArray[Any]]"
        if count is None:
            return f"Sequence[{one}]"
        if not given:
            return f"Tuple[{', '.join([one] * count)}]"
        return "_Point" if (one, count) == ("float", 3) else f"Union[Sequence[{one}], NDArray[Any]]"


def arguments(name, fields, stubs, base="TypedDict"):
    lines = [f"class {name}({base}, total=False):"]
    part = name.removesuffix("Arguments")
    lines += [f"    {field}: Optional[{stubs.type(own, part + camel(field))}]" for field, own in fields.items()]
    return "\n".join(lines)


def parts():
    """Text of each part by its name."""
    stubs, own, methods = Stubs(), [], []
    for kind, schema in kinds(DESCRIPTIONS["sensor"]).items():
        name = f"_{camel(kind)}Arguments"
        base = "_LensArguments" if "lens" in schema["properties"] else "_SensorArguments"
        own.append(arguments(name, keywords(schema), stubs, base))
        methods.append(f"    def add_{kind}(self, name: str, **arguments: Unpack[{name}]) -> Sensor: ...")
    light = DESCRIPTIONS["light"]["properties"]
    first = {"point": ("intensity", "range"), "spot": ("intensity", "range"), "directional": ("intensity",)}
    for kind, named in first.items():
        fields = {n: f for n, f in light.items() if kind in f.get("kinds", [kind]) and n not in named}
        own.append(arguments(f"_{camel(kind)}Light", fields, stubs))
    properties = []
    for name, field in [*light.items(), ("enabled", light["on"])]:
        read, given = stubs.type(field, f"_Light{camel(name)}", given=False), stubs.type(field, f"_Light{camel(name)}")
        if "inverse_square" in str(field):
            read, given = "Tuple[float, float, float]", 'Union[_Point, Literal["inverse_square"]]'
        properties += ["    @property", f"    def {name}(self) -> {read}: ..."]
        properties += [f"    @{name}.setter", f"    def {name}(self, value: {given}) -> None: ..."]
    weather = DESCRIPTIONS["weather"]["properties"]
    own.append(arguments("_WeatherArguments", weather, stubs))
    shown = [f"    {name}: {stubs.type(field, name, given=False)}" for name, field in weather.items()]
    own.append("\n".join(["class _Weather(TypedDict):", *shown]))
    readings = []
    for kind in READINGS:
        schema = DESCRIPTIONS["readings"][kind]
        about = " ".join(schema["description"].split())
        readings += [f"class {reading_name(kind)}(Reading):", f'    """{about}"""', ""]
        for name, field in schema["properties"].items():
            readings += ["    @property", f"    def {name}(self) -> {stubs.type(field, name, given=False)}: ..."]
        readings.append("")
    kinds_of_sensors = ", ".join(json.dumps(kind) for kind in kinds(DESCRIPTIONS["sensor"]))
    return {
        "arguments": "\n\n".join([*stubs.classes.values(), *own]),
        "methods": "\n".join(methods),
        "light": "\n".join(properties),
        "readings": "\n".join(readings[:-1]),
        "kinds": f"_SensorKind = Literal[{kinds_of_sensors}]",
    }


def written(text):
    """The stubs with their described parts made anew."""
    for name, part in parts().items():
        pattern = re.compile(rf"( *# described: {name}\n).*?( *# end of described\n)", re.DOTALL)
        text, count = pattern.subn(lambda found, part=part: f"{found[1]}{part}\n{found[2]}", text)
        assert count, name
    return text


if __name__ == "__main__":
    STUBS.write_text(written(STUBS.read_text(encoding="utf-8")), encoding="utf-8")
