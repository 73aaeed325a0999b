"""What the notes of a scene say to people, and where they are kept."""

from __future__ import annotations

from augment.models import BaseScene
from augment.scene.recording import Note, SceneNoteKind, notes_from_document
from augment.simulation.planning import FALLBACK_LIMIT_MPS
from augment.simulation.traffic import FALLBACK_MPS


def notes_of(scene: BaseScene) -> list[str]:
    """Every loss and assumption of a stored scene, as a sentence."""
    return [said_of(note) for note in notes_from_document(scene.notes)]


def said_of(note: Note) -> str:
    """A loss or assumption as a sentence."""
    values = {
        "number": note.number or 0,
        "of": note.of or 0,
        "value": "" if note.value is None else f"{note.value:g}",
        "names": ", ".join(note.names),
        "ego": f"{FALLBACK_LIMIT_MPS:g}",
        "others": f"{FALLBACK_MPS:g}",
    }
    return _TEXTS[note.kind] % values


_TEXTS: dict[SceneNoteKind, str] = {
    SceneNoteKind.NO_SPEED_LIMITS: (
        "No speed limits in this source: a drive assumes %(ego)s m/s for the ego and %(others)s"
        " m/s for others."
    ),
    SceneNoteKind.SOME_SPEED_LIMITS: (
        "%(number)s of %(of)s lanes have no speed limit: a drive assumes %(ego)s m/s for the ego"
        " and %(others)s m/s for others there."
    ),
    SceneNoteKind.SPEED_LIMITS_IGNORED: (
        "The speed limit of %(number)s lanes is a constant %(value)s m/s that means nothing; it"
        " was left out."
    ),
    SceneNoteKind.NO_LIGHTS: (
        "No traffic lights in this source: their state is unknown everywhere."
    ),
    SceneNoteKind.NO_WALKWAYS: "No sidewalks in this source.",
    SceneNoteKind.NO_DRIVABLE_AREAS: (
        "No drivable areas in this source: what can be driven on is the lanes alone."
    ),
    SceneNoteKind.NO_CONNECTIVITY: (
        "This source does not say which lane leads to which: no lane has a successor."
    ),
    SceneNoteKind.NO_INTERSECTIONS: (
        "No intersections in this source: where lanes part, they are lanes, not connectors, and"
        " have neither turn type nor light."
    ),
    SceneNoteKind.NO_BOX_SIZES: (
        "No box sizes in this source: every object has the usual size of its class."
    ),
    SceneNoteKind.SOME_BOX_SIZES: (
        "%(number)s of %(of)s objects have no box size: the usual size of their class was taken."
    ),
    SceneNoteKind.EGO_SIZE_ASSUMED: (
        "The ego's size is not in this source: %(value)s m long was assumed."
    ),
    SceneNoteKind.EGO_SIZE_SWAPPED: (
        "The ego's length and width were swapped in this source; they were put right."
    ),
    SceneNoteKind.NO_EGO_MOTION: (
        "The ego's own motion was not recorded: a drive is measured against an IDM drive."
    ),
    SceneNoteKind.SPEEDS_DIFFERENCED: (
        "No speeds in this source: they were taken from the recorded places."
    ),
    SceneNoteKind.LANE_WIDTHS_ASSUMED: (
        "%(number)s of %(of)s lanes have no boundaries on both sides: where nothing beside them"
        " told the width, %(value)s m was assumed."
    ),
    SceneNoteKind.TRAFFIC_SIDE_ASSUMED: (
        "No two oncoming lanes lie side by side: that people drive on the %(names)s is what the"
        " place says."
    ),
    SceneNoteKind.BICYCLE_LANES_LEFT_OUT: ("%(number)s bicycle lanes of the map were left out."),
    SceneNoteKind.OBJECTS_LEFT_OUT: (
        "%(number)s objects were left out, which no class here fits: %(names)s."
    ),
    SceneNoteKind.CLASSES_MERGED: ("Finer classes of this source count as ours: %(names)s."),
    SceneNoteKind.MAP_PARTS_LEFT_OUT: (
        "%(number)s parts of the map have no place here and were left out: %(names)s."
    ),
    SceneNoteKind.FAR_PARTS_LEFT_OUT: (
        "Parts of the map and objects more than %(value)s m from the ego were left out."
    ),
    SceneNoteKind.LIGHTS_REPEATED: (
        "%(number)s lights are programmed, not recorded: their state is that of the cycle at t0."
    ),
    SceneNoteKind.BOUNDARIES_TURNED: (
        "%(number)s boundaries ran against their lane and were turned."
    ),
    SceneNoteKind.TURN_TYPES_CORRECTED: (
        "The turn type of %(number)s connectors contradicts their shape; the shape was believed."
    ),
    SceneNoteKind.LONG_TIME_STEP: (
        "Steps of this recording lie %(value)s s apart; a drive looks between them."
    ),
    SceneNoteKind.ROUTE: (
        "The source's route leads over %(number)s roadblocks: %(names)s. A drive follows the"
        " recorded way instead."
    ),
    SceneNoteKind.ROUTE_NOT_IN_MAP: (
        "%(number)s of %(of)s roadblocks of the route are not in the map: %(names)s."
    ),
    SceneNoteKind.MISSION_GOAL: (
        "The mission's goal lies %(names)s m ahead of the ego and to its left; no drive is"
        " measured by it."
    ),
    SceneNoteKind.SCENARIO_TAGS: ("Scenario tags of this moment: %(names)s."),
    SceneNoteKind.INTERPLAN_LEFT_OUT: (
        "What interPlan says besides and is not used here: %(names)s."
    ),
    SceneNoteKind.NON_COMMERCIAL: (
        "The data's licence, %(names)s, does not allow commercial use."
    ),
}
