"""One number an augmentation by each metric: more is better, unknown is missing."""

import math

import pytest

from augment.metrics.displacement import MISS_M, displacement
from augment.models import Augmentation, Contestant
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.judging.metric_scores import MetricScores, metric_scores
from tests.drives import driven
from tests.scenes import cone, vehicle
from tests.study_rows import contestant, picture, scenario

REFERENCE = Modification(added=(vehicle("Agent2", 20.0, 0.0), cone("Agent3", 30.0, 0.0)))


@pytest.mark.parametrize(
    ("made", "error_m"),
    [
        (REFERENCE, 0.0),
        (Modification(added=(vehicle("Agent2", 21.0, 0.0), cone("Agent3", 33.0, 0.0))), 2.0),
        (
            Modification(added=(vehicle("Agent2", 90.0, 0.0), cone("Agent3", 30.0, 0.0))),
            MISS_M / 2,
        ),
        (Modification(added=(vehicle("Agent2", 20.0, 0.0),)), MISS_M / 2),
        (Modification(added=(*REFERENCE.added, cone("Agent4", 9.0, 0.0))), MISS_M / 3),
        (None, MISS_M),
    ],
    ids=["same", "off", "far", "missing", "surplus", "unreadable"],
)
def test_one_number_says_how_far_a_change_is_off(
    made: Modification | None, error_m: float
) -> None:
    assert displacement(made, REFERENCE).error_m == pytest.approx(error_m)
    assert displacement(Modification(), Modification()).error_m == 0.0


@pytest.mark.django_db
def test_more_is_better_and_what_is_unknown_is_missing() -> None:
    place = scenario("place")
    place.reference = modification_to_document(REFERENCE)
    place.save()
    rows = {slug: picture(place, contestant(slug)) for slug in ("good", "bad", "none")}
    rows["reference"] = picture(place, contestant("reference", Contestant.Kind.REFERENCE))
    twice = Modification(added=(vehicle("Agent2", 25.0, 0.0), vehicle("Agent3", 25.5, 0.0)))
    changes = {"good": REFERENCE, "bad": twice, "reference": REFERENCE}
    for slug, change in changes.items():
        document = modification_to_document(change)
        Augmentation.objects.filter(pk=rows[slug].pk).update(modification=document)
    Augmentation.objects.filter(pk=rows["none"].pk).update(
        state=Augmentation.State.UNREADABLE, modification=None
    )
    driven(rows["good"].job, after=0.25)
    rows["good"].simulations.update(interplan_score=0.75)

    found = {scores.name: scores for scores in metric_scores([row.pk for row in rows.values()])}

    def of(metric: str, slug: str) -> float | None:
        scores: MetricScores = found[metric]
        return scores.by_code.get(str(rows[slug].code))

    assert of("Displacement", "good") == 0.0
    assert of("Displacement", "none") == -MISS_M
    assert of("Displacement", "reference") is None
    good, bad = of("Checks", "good"), of("Checks", "bad")
    assert good is not None
    assert bad is not None
    assert good > bad
    assert of("Checks", "none") == -math.inf
    assert of("Driving score (nuPlan)", "good") == -0.25
    assert of("Driving score (interPlan)", "good") == -0.75
    assert of("Driving score (nuPlan)", "none") is None
