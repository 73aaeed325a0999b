"""A new study as the wire takes it: what the form has, with shares instead of percent."""

from __future__ import annotations

from typing import Any

from rest_framework import serializers

from arena.api.fields import FlagField, NumberField, StrictSerializer, TextField, WholeNumberField
from arena.pairing.target_lines import read_targets
from arena.services.shown_pictures import SampleRule
from arena.services.studies import PlanOptions

MOST_CHOSEN = 5_000
MOST_VOTES = 10_000
MOST_LINES = 2_000
HIGHEST_SEED = 2**63 - 1
WHO_AND_WHAT = (
    *("name", "contestants", "scenarios", "experts", "votes_per_expert", "seed"),
    "allow_simulated",
)
"""What `open_study` takes beside the options of the plan."""


def _slugs() -> serializers.ListField:
    return serializers.ListField(
        child=TextField(max_length=80), max_length=MOST_CHOSEN, help_text="Slugs."
    )


def _lines(words: str) -> serializers.ListField:
    return serializers.ListField(
        child=TextField(max_length=500, allow_blank=True),
        required=False,
        default=list,
        max_length=MOST_LINES,
        help_text=words,
    )


def _share(most: float) -> NumberField:
    return NumberField(required=False, default=0.0, min_value=0, max_value=most)


class StudyBody(StrictSerializer):
    """A new study; its rules are fixed from the moment it opens."""

    beside: tuple[str, ...] = ()
    """Fields of a longer body that go with the rules as they are."""

    name = TextField(max_length=120)
    contestants = _slugs()
    scenarios = _slugs()
    experts = serializers.ListField(
        child=TextField(max_length=150), max_length=MOST_CHOSEN, help_text="Usernames."
    )
    votes_per_expert = WholeNumberField(min_value=1, max_value=MOST_VOTES)
    seed = WholeNumberField(required=False, default=1, min_value=0, max_value=HIGHEST_SEED)
    repeat_share = _share(0.5)
    check_share = _share(0.5)
    overlap_share = _share(0.8)
    adaptive_share = _share(0.9)
    targets = _lines("“CONTESTANT NUMBER” or “CONTESTANT vs CONTESTANT NUMBER” each.")
    hypotheses = _lines("What is expected, a line each; frozen at the opening.")
    allow_both_miss = FlagField(required=False, default=False)
    allow_text = FlagField(required=False, default=False)
    allow_replay = FlagField(required=False, default=False)
    allow_measures = FlagField(required=False, default=True)
    allow_simulated = FlagField(required=False, default=False)
    settle_alike = FlagField(required=False, default=False)
    practice = FlagField(required=False, default=False)
    samples = serializers.ChoiceField(
        choices=[rule.value for rule in SampleRule], required=False, default=SampleRule.ONE.value
    )
    jobs = serializers.ListField(
        child=TextField(max_length=120),
        required=False,
        default=list,
        max_length=MOST_CHOSEN,
        help_text="Names or codes of the jobs whose augmentations are shown; none for all.",
    )

    def rules(self) -> dict[str, Any]:
        """What `open_study` is called with, once the body is valid.

        Raises:
            NothingToPlan: A target can't be read.
        """
        given = dict(self.validated_data)
        who = {name: given.pop(name) for name in (*WHO_AND_WHAT, *self.beside)}
        appearances, pair_votes = read_targets(given.pop("targets"))
        options = PlanOptions(
            appearances=appearances,
            pair_votes=pair_votes,
            hypotheses=tuple(given.pop("hypotheses")),
            jobs=tuple(given.pop("jobs")),
            samples=SampleRule(given.pop("samples")),
            **given,
        )
        return who | {"options": options}
