"""The reader of a map alone, with an ego that is put on a lane of it."""

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np

from augment import foreign
from augment.foreign import fault_at
from augment.formats.opendrive.maps import map_around
from augment.formats.opendrive.network import RoadNetwork
from augment.formats.reading import Log, LogReader, Moment, Reading
from augment.scene.entities import EGO_LENGTH_M, EGO_WIDTH_M


class OpenDrive(LogReader):
    """The reader of OpenDRIVE; an item is the ego's place, "@ROAD,LANE,S"."""

    name = "opendrive"
    title = "OpenDRIVE map, 1.4 to 1.8 (.xodr file)"
    suffix, marker = ".xodr", b"<OpenDRIVE"
    goes_with_others = True

    def logs(self, path: Path, item: str | None) -> Iterator[Log]:
        """The one with the ego at a place; for None at the first that is offered."""
        network = RoadNetwork(path)
        place = item or next(_offer_places(network), None)
        if place is None:
            reasons = ["no lane that cars drive on", *network.doubts.notes]
            raise fault_at(path.name, "; ".join(reasons))
        road_id, lane_id, s_m = parse_place(place)
        pose = network.road(road_id).lane_pose(lane_id, s_m)
        yield Log(
            times_s=np.zeros(1),
            ego=np.array([[pose.x_m, pose.y_m, pose.heading_rad, 0.0]]),
            ego_size_m=(EGO_LENGTH_M, EGO_WIDTH_M),
            tracks=(),
            map_at=lambda _: map_around(network, pose, self.reach_m),
            world=f"OpenDRIVE frame of {path.stem[:80]}",
            title=f"OpenDRIVE map {path.stem[:80]}",
            licence="no licence named",
            is_free=True,
            item=place,
            notes=[f"The ego was put on lane {lane_id} of road {road_id}, at s = {s_m:g} m."],
        )

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Yield a place for an ego on each lane that is driven on."""
        for place in _offer_places(RoadNetwork(path)):
            yield Moment(item=place)

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """Return the scene at one place."""
        if frame:
            raise fault_at("frame", f"{frame} is not there; a map has frame 0 alone")
        return next(self.logs(path, item)).reading_at(0, name, self.reach_m)


def parse_place(item: str) -> tuple[str, int, float]:
    """Return road, lane and station of a place "@ROAD,LANE,S".

    Raises:
        InvalidDocument: It is none.
    """
    parts = item.removeprefix("@").rsplit(",", 2)
    if len(parts) != 3 or not item.startswith("@"):
        raise fault_at("ego", f"{item[:40]!r} is no place; needs ROAD,LANE,S, as 1,-1,25")
    place = "ego's place"
    return parts[0], foreign.read_whole(parts[1], place), foreign.read_number(parts[2], place)


# Private


def _offer_places(network: RoadNetwork) -> Iterator[str]:
    """Yield the middle of each lane, of connecting roads last."""
    elements = network.elements.items()
    outer = (name for name, road in elements if road.get("junction", "-1") == "-1")
    inner = (name for name, road in elements if road.get("junction", "-1") != "-1")
    for name in chain(outer, inner):
        for road in network.doubts.read_all("roads", network.road, [(name,)]):
            s_m = round(road.line.length_m / 2.0, 1)
            for lane_id, lane in road.sections[road.section_at(s_m)].lanes.items():
                if lane.is_driven:
                    yield f"@{name},{lane_id},{s_m:g}"
