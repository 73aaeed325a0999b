"""The reader of a map alone, with an ego that is put on a lane of it."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from augment import foreign
from augment.foreign import fault_at
from augment.formats.opendrive.maps import map_around
from augment.formats.opendrive.network import RoadNetwork
from augment.formats.reading import Log, LogReader, Moment, Reading
from augment.geometry.frames import Pose
from augment.scene.entities import EGO_LENGTH_M, EGO_WIDTH_M

PLACES_EVERY_M = 2.0


class OpenDrive(LogReader):
    """The reader of OpenDRIVE; an item is the ego's place, "@ROAD,LANE,S"."""

    name = "opendrive"
    title = "OpenDRIVE map, 1.4 to 1.8 (.xodr file)"
    suffix, marker = ".xodr", b"<OpenDRIVE"
    goes_with_others = True

    def logs(self, path: Path, item: str | None) -> Iterator[Log]:
        """The one with the ego at a place; for None at the first that is offered."""
        yield self._put_ego(path, item)[0]

    def _put_ego(self, path: Path, item: str | None) -> tuple[Log, RoadNetwork, Pose]:
        network = RoadNetwork(path)
        place = item or next(_offer_places(network), None)
        if place is None:
            reasons = ["no lane that cars drive on", *network.doubts.notes]
            raise fault_at(path.name, "; ".join(reasons))
        road_id, lane_id, s_m = parse_place(place)
        pose = network.road(road_id).lane_pose(lane_id, s_m)
        log = Log(
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
        return log, network, pose

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Yield a place for an ego on each lane that is driven on."""
        for place in _offer_places(RoadNetwork(path)):
            yield Moment(item=place)

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """Return the scene at one place."""
        if frame:
            raise fault_at("frame", f"{frame} is not there; a map has frame 0 alone")
        log, network, pose = self._put_ego(path, item)
        reading = log.reading_at(0, name, self.reach_m)
        return replace(reading, places=_list_places(network, pose, self.reach_m))


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


def _list_places(
    network: RoadNetwork, ego: Pose, reach_m: float
) -> dict[str, list[tuple[float, float, float]]]:
    """Return s, x and y in the ego frame along each lane that is driven on, by "ROAD,LANE"."""
    places = defaultdict[str, list[tuple[float, float, float]]](list)
    for road in network.roads_near(ego.x_m, ego.y_m, reach_m):
        for section in road.sections:
            s_m = np.arange(section.start_m, section.end_m, PLACES_EVERY_M)
            # Within the section after rounding, at its very end too.
            s_m = np.append(s_m + 0.0005, section.end_m - 0.001).round(3)
            for lane_id, (right_m, left_m) in road.edges_at(section, s_m).items():
                if section.lanes[lane_id].is_driven:
                    local = ego.to_local(road.places_at(s_m, (right_m + left_m) / 2.0)[:, :2])
                    near = np.hypot(*local.T) <= reach_m
                    rows = np.column_stack([s_m, local.round(1)])[near]
                    places[f"{road.id},{lane_id}"] += map(tuple, rows.tolist())
    return dict(places)


def _offer_places(network: RoadNetwork) -> Iterator[str]:
    """Yield the middle of each lane, of connecting roads last."""
    roads = network.elements
    for name in sorted(roads, key=lambda name: roads[name].get("junction", "-1") != "-1"):
        for road in network.doubts.read_all("roads", network.road, [(name,)]):
            s_m = round(road.line.length_m / 2.0, 1)
            for lane_id, lane in road.sections[road.section_at(s_m)].lanes.items():
                if lane.is_driven:
                    yield f"@{name},{lane_id},{s_m:g}"
