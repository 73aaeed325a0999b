"""What the text description of a study holds, from its opening on."""

import pytest
from django.utils.translation import override

from arena.models import Study
from arena.studies.services.planning import plan_batch
from arena.studies.services.taking_part import hand_over
from arena.voting.queries.showings import as_shown, describe_in_words
from augment.models import Augmentation
from tests.described import a_described_study, draw_changes, said_of, with_text
from tests.study_rows import cast_of, matchups_of, vote

pytestmark = pytest.mark.django_db


def read_by(study: Study, username: str) -> list[tuple[list[str], list[str]]]:
    return [
        (shown["text"]["a"], shown["text"]["b"])
        for shown in (as_shown(row) for row in matchups_of(study, username))
    ]


def right_for(study: Study, username: str) -> list[tuple[list[str], list[str]]]:
    return [(said_of(row.left), said_of(row.right)) for row in matchups_of(study, username)]


def test_every_showing_keeps_what_its_two_pictures_show() -> None:
    study = a_described_study()
    assert read_by(study, "eva") == right_for(study, "eva")
    assert read_by(study, "finn") == right_for(study, "finn")


def test_pairs_that_are_handed_over_or_planned_later_have_theirs() -> None:
    made = cast_of(experts=("eva", "finn"), scenarios=12)
    draw_changes()
    study = with_text(made, votes=10, adaptive=50)
    hand_over(study=study, username="finn", to=["eva"])
    for matchup in matchups_of(study, "eva"):
        vote(matchup)
    assert plan_batch(study=study, expert=matchups_of(study, "eva")[0].expert)
    assert study.matchups.filter(batch__gt=0).exists()
    assert read_by(study, "eva") == right_for(study, "eva")


def test_what_is_edited_later_does_not_change_what_was_read() -> None:
    study = a_described_study()
    before = read_by(study, "eva")
    Augmentation.objects.update(modification={})
    assert read_by(study, "eva") == before


# --- The words ---------------------------------------------------------------------------------

LINE = {
    **{"change": "changed", "kind": "VEHICLE", "ahead_m": 12.0, "left_m": -1.5},
    **{"heading_deg": 0, "along_deg": None, "speed_mps": 0.0, "walk_to_m": None},
}
WALK = {"kind": "PEDESTRIAN", "heading_deg": -90, "speed_mps": None, "walk_to_m": [12.0, -5.0]}
BAR = {"kind": "BARRIER", "heading_deg": None, "speed_mps": None}


@pytest.mark.parametrize(
    ("changes", "english", "german"),
    [
        (
            {},
            "Vehicle, 12.0 m ahead, 1.5 m right, facing as the ego does, standing",
            "Fahrzeug, 12.0 m voraus, 1.5 m rechts, gleich gerichtet wie das Ego-Fahrzeug, steht",
        ),
        (
            {"ahead_m": -3.2, "left_m": 2.0, "heading_deg": 180, "speed_mps": 8.3, "kind": "BUS"},
            "Bus, 3.2 m behind, 2.0 m left, facing the opposite way, moving at 8.3 m/s",
            "Bus, 3.2 m dahinter, 2.0 m links, entgegengesetzt gerichtet, fährt mit 8.3 m/s",
        ),
        (
            {"left_m": 0.0},
            "Vehicle, 12.0 m ahead, in line with the ego, facing as the ego does, standing",
            "Fahrzeug, 12.0 m voraus, in einer Linie mit dem Ego-Fahrzeug, "
            "gleich gerichtet wie das Ego-Fahrzeug, steht",
        ),
        (
            {"heading_deg": 30, "kind": "BICYCLE"},
            "Bicycle, 12.0 m ahead, 1.5 m right, facing 30° to the left, standing",
            "Fahrrad, 12.0 m voraus, 1.5 m rechts, 30° nach links gerichtet, steht",
        ),
        (
            WALK,
            "Pedestrian, 12.0 m ahead, 1.5 m right, facing right, "
            "walking to 12.0 m ahead, 5.0 m right",
            "Person zu Fuß, 12.0 m voraus, 1.5 m rechts, nach rechts gerichtet, "
            "geht bis 12.0 m voraus, 5.0 m rechts",
        ),
        (
            BAR | {"along_deg": 90},
            "Barrier, 12.0 m ahead, 1.5 m right, lying across",
            "Absperrung, 12.0 m voraus, 1.5 m rechts, quer liegend",
        ),
        (
            BAR | {"along_deg": -30, "change": "gone"},
            "No longer there: Barrier, 12.0 m ahead, 1.5 m right, turned 30° to the right",
            "Nicht mehr da: Absperrung, 12.0 m voraus, 1.5 m rechts, 30° nach rechts gedreht",
        ),
        (
            BAR | {"kind": "TRAFFIC_CONE"},
            "Traffic cone, 12.0 m ahead, 1.5 m right",
            "Leitkegel, 12.0 m voraus, 1.5 m rechts",
        ),
    ],
)
def test_a_line_is_said_in_both_languages(
    changes: dict[str, object], english: str, german: str
) -> None:
    with override("en"):
        assert describe_in_words([LINE | changes]) == [english]
    with override("de"):
        assert describe_in_words([LINE | changes]) == [german]
