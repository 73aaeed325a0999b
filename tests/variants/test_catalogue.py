"""Every variant on every scenario of the catalogue, over real HTTP against the stand-in.

Call counts and their order are those of the paper: m modifier, r reviewer, e engineer, v viewer.
"""

import math

import pytest

from augment.fake_llm.server import FakeServer
from augment.metrics.displacement import displacement
from augment.prompts.calls import Tools
from augment.variants.pipeline import EditTask, Outcome, OutcomeStatus
from augment.variants.recipes import RECIPES, find_recipe
from tests.baselines.test_rule_placer import placed
from tests.checks.worlds import findings
from tests.fixtures.shelf import HARD_SLUGS, SLUGS, entry, shown_scene
from tests.variants.playing import MemoryTranscript, play, stand_in_model

CALLS_OF_GOOD = {
    **{"otm": "m", "fc": "mm", "tqa": "mr", "vqa": "meve", "geo": "m", "fc-plus": "mm"},
    **{"fc+tqa": "mmr", "fc+vqa": "mmeve", "fc+geo": "mm"},
    **{"fc-plus+tqa": "mmr", "fc-plus+vqa": "mmeve", "fc-plus+geo": "mm"},
}
CALLS_OF_LOW = {"tqa": "mrmr", "vqa": "mevemeve", "fc+tqa": "mmrmmr", "fc+vqa": "mmevemmeve"}
UNMET = {
    slug: intent.unmet
    for slug in HARD_SLUGS
    if (intent := entry(slug).intent) is not None and intent.unmet
}


def played(
    server: FakeServer, model: str, variant: str, slug: str
) -> tuple[Outcome, MemoryTranscript]:
    task = EditTask(scene=shown_scene(slug), instruction=entry(slug).instruction)
    transcript = MemoryTranscript()
    with stand_in_model(server, model) as modifier:
        return play(find_recipe(variant), task, modifier, transcript), transcript


def order(transcript: MemoryTranscript) -> str:
    return "".join(call.role[0] for call in transcript.calls)


def test_every_recipe_is_played() -> None:
    assert CALLS_OF_GOOD.keys() == RECIPES.keys()


@pytest.mark.slow
@pytest.mark.timeout(400)
@pytest.mark.parametrize("variant", CALLS_OF_GOOD)
def test_every_variant_does_the_scenarios(server: FakeServer, variant: str) -> None:
    reviewed = RECIPES[variant].review is not None
    # What is put together of two known parts shows on a quarter of them.
    for slug in SLUGS[::4] if "+" in variant else SLUGS:
        outcome, transcript = played(server, "fake-good", variant, slug)
        assert outcome.status is OutcomeStatus.DONE, slug
        assert outcome.is_accepted is (True if reviewed else None), slug
        # The stand-in looks up no place for a wish that it does not understand.
        looks_up = not outcome.modification.is_empty
        calls = CALLS_OF_GOOD[variant]
        doubted = "geo" in variant and any(
            one.is_fault for one in findings(shown_scene(slug), outcome.modification)
        )
        if doubted:
            calls *= 2  # what is doubtful and was asked for costs a round, in which it is kept
        assert order(transcript) == (calls if looks_up else calls.replace("mm", "m")), slug
        _is_complete(transcript, variant, looks_up=looks_up, doubted=doubted)
        _is_where_it_belongs(outcome, slug)


@pytest.mark.parametrize(
    "slug", ["lime-street-sticks-out", "cannery-row-swap", "viaduct-merge-pile-up"]
)
def test_moves_removals_and_far_places_come_through(server: FakeServer, slug: str) -> None:
    outcome, _ = played(server, "fake-good", "otm", slug)
    reference = entry(slug).reference
    assert outcome.modification.removed == reference.removed
    assert [one.id for one in outcome.modification.moved] == [one.id for one in reference.moved]
    found = displacement(outcome.modification, reference)
    assert (found.missing, found.surplus) == ((), ())
    assert min(found.distances_m) < 0.5


@pytest.mark.parametrize("variant", ["tqa", "vqa"])
@pytest.mark.parametrize(
    ("model", "slug"),
    [
        *(("fake-refuse-prose", slug) for slug in UNMET),
        *(("fake-good", slug) for slug in [*UNMET][:2]),
    ],
)
def test_a_wish_that_can_t_be_met_is_refused_and_reviewers_accept_that(
    server: FakeServer, model: str, slug: str, variant: str
) -> None:
    outcome, transcript = played(server, model, variant, slug)
    assert (outcome.status, outcome.modification) == (OutcomeStatus.REFUSED, None)
    assert UNMET[slug] in outcome.reason
    assert order(transcript) == CALLS_OF_GOOD[variant]


@pytest.mark.parametrize("variant", CALLS_OF_LOW)
def test_a_low_rating_costs_one_more_round(server: FakeServer, variant: str) -> None:
    outcome, transcript = played(server, "fake-qa-low", variant, SLUGS[0])
    assert (order(transcript), outcome.is_accepted) == (CALLS_OF_LOW[variant], True)
    _is_where_it_belongs(outcome, SLUGS[0])


def _is_complete(
    transcript: MemoryTranscript, variant: str, *, looks_up: bool, doubted: bool
) -> None:
    """Every call has its raw answer; tools, rounds and reviews are noted behind their calls."""
    assert all(call.reply is not None and call.reply.model for call in transcript.calls)
    assert len({call.prompt_version for call in transcript.calls}) == 1
    kinds = [note.kind.value for note in transcript.notes]
    way = RECIPES[variant]
    assert ("tool_call" in kinds) is (looks_up and way.tools is not Tools.NONE)
    rest = [kind for kind in kinds if kind != "tool_call"]
    rounds = kinds.count("round")
    assert rest == ([] if way.review is None else ["round", "review"] * rounds + ["kept"])
    assert rounds == (way.review is not None) * (1 + doubted)


def _is_where_it_belongs(outcome: Outcome, slug: str) -> None:
    """Everything within half a metre of where the rules put it, whatever was in between."""
    meant = placed(slug).modification.added
    assert len(outcome.modification.added) == len(meant)
    for agent in outcome.modification.added:
        gaps = [math.hypot(one.x_m - agent.x_m, one.y_m - agent.y_m) for one in meant]
        assert min(gaps) < 0.5
