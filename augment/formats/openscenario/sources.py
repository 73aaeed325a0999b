"""An OpenSCENARIO file with the files that it names: its map, and its catalogs.

Nothing is followed out of the folder of the file, or of the zip that it came in.
"""

import glob
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path, PurePosixPath
from xml.etree.ElementTree import Element

from augment import foreign
from augment.foreign import Doubts, fault_at
from augment.formats.documents import read_xml
from augment.formats.opendrive.network import RoadNetwork
from augment.formats.openscenario.parameters import resolve
from augment.scene.entities import AgentType
from augment.scene.planned_motion import EGO_ID

_CATALOG = b"<Catalog "
_REFERRING = (
    *("ManeuverGroup", "RouteRef", "AssignRouteAction", "TrajectoryRef", "FollowTrajectoryAction"),
)
"""What may name an entry of a catalog in place of its content, but for entities."""
_DEEPEST, _MOST_ENTRIES = 3, 1_000
"""Entries in each other, as of a route in a maneuver, and in all."""
_IGNORED = ("EntitySelection", "VariableDeclaration", "MonitorDeclaration", "TrafficDefinition")
_MOST_FILES, _LONGEST_PATH, _NO = 500, 250, ("false", "0")
_DEPTHS = ("*", "*/*", "*/*/*", "*/*/*/*", "*/*/*/*/*")
_CLASSES = foreign.name_all(
    {
        AgentType.VEHICLE: "car van truck trailer semitrailer train tram",
        AgentType.BICYCLE: "bicycle motorbike",
        AgentType.BUS: "bus",
        AgentType.BARRIER: "barrier guardRail",
        AgentType.PEDESTRIAN: "pedestrian wheelchair",
        AgentType.GENERIC_OBJECT: "animal obstacle pole railing soundBarrier streetLamp other",
    }
)
"""By the category; whatever else is an object too, with a note."""
SCENERY = ("building", "roadMark", "none", "wind", "patch", "gantry", "etc", "vegetation", "tree")
_KINDS = {
    "Vehicle": "vehicleCategory",
    "Pedestrian": "pedestrianCategory",
    "MiscObject": "miscObjectCategory",
}
EGO_NAMES = ("Ego", "ego", "EGO", "hero", EGO_ID)


@dataclass(frozen=True, slots=True, kw_only=True)
class Entity:
    """Somebody or something of a scenario.

    Attributes:
        centre_m: From its point of reference to its middle, ahead and to the left.
        size_m: Length and width, zeros where the file does not tell them.
        is_ego: Whether the file says so itself.
    """

    name: str
    type: AgentType
    centre_m: tuple[float, float]
    size_m: tuple[float, float]
    is_ego: bool


def is_catalog(path: Path) -> bool:
    """Return whether a file looks like a catalog, which is no scenario."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return _CATALOG in file.read(10_000).replace(b"\0", b"")


def _is_path(text: str) -> bool:
    return text.isprintable() and len(text.encode()) < _LONGEST_PATH


class ScenarioSource:
    """A scenario file, its parameters replaced.

    Attributes:
        doubts: About what of it was not understood.
    """

    def __init__(self, path: Path) -> None:
        self._path, self.doubts, self._entries = path, Doubts(), 0
        # In the sandbox the path is relative to the folder that holds what was sent.
        self._folder = (path.parent if path.is_absolute() else Path()).resolve()
        root = read_xml(path, what=foreign.WHAT)
        header = root.find("FileHeader")
        version = "" if header is None else f"{header.get('revMajor')}.{header.get('revMinor')}"
        if root.tag != "OpenSCENARIO" or version not in ("1.0", "1.1", "1.2", "1.3"):
            text = f"is {root.tag[:40]!r} of version {version[:20]!r}, not OpenSCENARIO 1.0 to 1.3"
            raise fault_at(path.name, text)
        if root.find("Storyboard") is None:
            raise fault_at(path.name, "has no Storyboard: it is a catalog or a distribution")
        self.root = resolve(root, {}, self.doubts)
        self._fill_references(self.root)
        # Also those of catalogs.
        if header is not None and header.get("description", "").startswith("CARLA:"):
            self._take_as_carla()
        for tag in _IGNORED:
            self.doubts.assume(f"{tag} was left out", len([*self.root.iter(tag)]))
        stops = len(self.root.findall(".//Act/StopTrigger//Condition"))
        self.doubts.assume("The condition that stops an act was left out", stops)
        counts = [element.get("maximumExecutionCount", "1") for element in self.root.iter()]
        repeated = sum(count.strip() != "1" for count in counts)
        self.doubts.assume("What may happen several times happens once", repeated)
        relative = [e.get("continuous", _NO[0]) for e in self.root.iter("RelativeTargetSpeed")]
        kept = sum(text.lower() not in _NO for text in relative)
        self.doubts.assume("A speed that is kept relative to somebody is taken once", kept)
        conditions = self.root.findall(".//Story//StartTrigger//EntityCondition/*")
        along = [e.get("coordinateSystem", "entity") != "entity" for e in conditions]
        along += [e.get("alongRoute", _NO[0]).lower() not in _NO for e in conditions]
        self.doubts.assume("A distance along roads is taken as the one between places", sum(along))

    def _fill_references(self, root: Element, depth: int = 0) -> None:
        for holder in [part for part in root.iter() if part.tag in _REFERRING]:
            for reference in holder.findall("CatalogReference"):
                with self.doubts.about("references to catalogs"):
                    self._entries += 1
                    name = reference.get("entryName", "")
                    if depth == _DEEPEST or self._entries > _MOST_ENTRIES:
                        raise fault_at(f"catalog entry {name[:40]}", "lies too deep")
                    entry = self.resolve_reference(reference)
                    self._fill_references(entry, depth + 1)
                    holder.append(entry)

    def _take_as_carla(self) -> None:
        """Turn CARLA's own frame, which counts y to the right, and its own player's ways to ours.

        It looks at no edges, a condition that held once goes on to, and a step in speed lasts as
        many seconds or metres as its value says. No file has the words for these.
        """
        for part in self.root.iterfind("Storyboard/Story//*"):
            if part.tag == "Condition":
                part.set("conditionEdge", "carla:latched")
            elif part.tag == "SpeedActionDynamics" and part.get("dynamicsShape") == "step":
                part.set("dynamicsShape", "carla:hold")
        worlds = [*self.root.iter("WorldPosition")]
        for world in worlds:
            # Without a heading a vertex has that of the way on.
            for name in sorted(world.attrib.keys() & {"y", "h"}):
                with self.doubts.about("world positions"):
                    value = foreign.read_number(world.get(name), f"WorldPosition.{name}")
                    world.set(name, repr(-value))
        self.doubts.assume("World positions are CARLA's, with y to the right", len(worlds) > 0)

    def open_map(self) -> RoadNetwork:
        """Return the map that the scenario names.

        Raises:
            InvalidDocument: It names none, it is not there, or it can't be read.
        """
        logic = self.root.iterfind("RoadNetwork/LogicFile")
        name = next((file.get("filepath", "") for file in logic), "")
        if not name:
            raise fault_at("RoadNetwork", "names no LogicFile: a scene needs a map")
        suffix = "" if name.lower().endswith(".xodr") else ".xodr"
        file = self._find(f"{name}{suffix}")
        if file is None:
            text = f"the map {name[:80]!r} is not beside the scenario: put it there, or both in a"
            reasons = [f"{text} zip", *self.doubts.notes]
            raise fault_at("RoadNetwork.LogicFile", "; ".join(reasons))
        return RoadNetwork(file)

    def entities(self) -> dict[str, Entity]:
        """Return everybody by name; who can't be read, or is scenery, is a doubt."""
        objects = self.root.findall("Entities/ScenarioObject")
        entities = self.doubts.read_all("entities", self._read_entity, ((o,) for o in objects))
        return self.doubts.index_last("entities", [(entity.name, entity) for entity in entities])

    def resolve_reference(self, reference: Element) -> Element:
        """Return the entry of a catalog that is referred to, with its parameters' values.

        Raises:
            InvalidDocument: There is no such catalog or entry.
        """
        catalog, entry = reference.get("catalogName", ""), reference.get("entryName", "")
        known = [c for c in self._catalogs if c.get("name") == catalog]
        place = f"catalog {catalog[:40]}"
        if not known:
            raise fault_at(
                place, "is not in the folder of the scenario, or the zip that it came in"
            )
        entries = {child.get("name"): child for found in known[::-1] for child in found}
        assigned = {
            row.get("parameterRef", "").removeprefix("$"): row.get("value", "")
            for row in reference.findall("ParameterAssignments/ParameterAssignment")
        }
        return resolve(foreign.look_up(entries, entry, place), {}, self.doubts, assigned)

    def _find(self, name: str) -> Path | None:
        if not _is_path(name):
            return None
        wanted = PurePosixPath(name.replace("\\", "/"))
        return next(iter(self._list_files([str(wanted.parent)], glob.escape(wanted.name))), None)

    def _list_files(self, folders: Iterable[str], pattern: str) -> list[Path]:
        """Files like that in folders as seen from the scenario, then anywhere inside."""
        named = (f.replace("\\", "/") for f in folders if _is_path(f))
        told = [(self._path.parent / name).resolve() for name in named]
        inside = [f.relative_to(self._folder) for f in told if f.is_relative_to(self._folder)]
        places = [*(f"{glob.escape(str(f))}/*" for f in inside), *_DEPTHS]
        found = (islice(self._folder.glob(f"{p[:-1]}{pattern}"), _MOST_FILES) for p in places)
        files = dict.fromkeys(file.resolve() for row in found for file in sorted(row))
        return [f for f in files if f.is_relative_to(self._folder) and f.is_file()]

    @cached_property
    def _catalogs(self) -> list[Element]:
        """The catalogs that the file names, then others in the folder; as their files are."""
        rows, catalogs = self.root.iterfind("CatalogLocations/*/Directory"), []
        for file in self._list_files([row.get("path", "") for row in rows], "*.xosc"):
            if is_catalog(file):
                with self.doubts.about("catalogs"):
                    catalogs += read_xml(file, what=foreign.WHAT).findall("Catalog")
        return catalogs

    def _read_entity(self, element: Element) -> Entity | None:
        name = element.get("name", "")
        place = f"entity {name[:40]}"
        reference = element.find("CatalogReference")
        bodies = [*element] if reference is None else [self.resolve_reference(reference)]
        body = next((child for child in bodies if child.tag in _KINDS), None)
        if body is None:
            raise fault_at(place, f"needs one of {', '.join(_KINDS)} or a CatalogReference")
        category = body.get(_KINDS[body.tag], "") or body.tag.lower()
        if category in SCENERY:
            self.doubts.assume(f"A {category} was left out: it is scenery")
            return None
        text = f"The category {category[:40]} is not known: an object"
        self.doubts.assume(text, category not in _CLASSES)
        self.doubts.assume("A trailer was left out", body.find("Trailer") is not None)
        centre, size = body.find("BoundingBox/Center"), body.find("BoundingBox/Dimensions")
        ahead_m, left_m, length_m, width_m = (
            0.0 if box is None else foreign.read_number(box.get(n, "0"), f"{place}.{n}")
            for box, n in ((centre, "x"), (centre, "y"), (size, "length"), (size, "width"))
        )
        return Entity(
            name=name,
            type=_CLASSES.get(category, AgentType.GENERIC_OBJECT),
            centre_m=(ahead_m, left_m),
            size_m=(length_m, width_m),
            is_ego=body.find("Properties/Property[@value='ego_vehicle']") is not None,
        )
