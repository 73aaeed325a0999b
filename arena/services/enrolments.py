"""Taking part by a link that is for everybody: places, consent, drop-outs, completion codes."""

from __future__ import annotations

import uuid
from datetime import datetime

import numpy as np
from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import Count
from django.utils import timezone
from django.utils.translation import gettext

from arena.errors import EnrolmentOver, NothingToPlan
from arena.models import EnrolledVoter, Enrolment, Matchup, Study
from arena.pairing.later import choose_for_newcomer as choose_units
from arena.pairing.later import follow_on
from arena.pairing.order import IntArray
from arena.pairing.rules import Grid, PlanRules, place_of
from arena.queries.studies.enrolments import (
    enrolment_by_token,
    find_silent,
    find_unfinished,
    has_free_place,
)
from arena.services.attention_checks import without_lost_checks
from arena.services.frames import Cells
from arena.services.handing_over import undecided_rows
from arena.services.people import create_person
from arena.services.plans import next_batch, pictures_of, rules_of, store
from augment.errors import Conflict
from augment.services.events import log_event
from augment.services.texts import one_line

LONGEST_CONSENT, LONGEST_ID = 5_000, 120


@transaction.atomic
def set_enrolment(
    *,
    study: Study,
    consent: str,
    asks_for: str,
    places: int,
    votes_each: int,
    drop_out_after_h: int | None,
    is_open: bool = True,
    actor: User | None = None,
) -> Enrolment:
    """Make the link of an open study, or change what it says; the link itself stays the same.

    Who has enrolled already keeps quota and place.

    Args:
        study: An open one.
        consent: What people agree to; their agreement is kept with a digest of this text.
        asks_for: What the id is called that they enter, "Your Prolific ID" for example.
        places: So many may take part at once; who drops out makes room.
        votes_each: The quota of everybody who enrols from now on.
        drop_out_after_h: Who is silent for so long and not done loses the place; None: nobody.
        is_open: Whether anybody may still enrol.
        actor: Who does so, for the log.

    Raises:
        Conflict: The study is not open, or a text is empty or too long.
        InvalidDocument: What is asked for is no line.
    """
    study = Study.objects.select_for_update().get(pk=study.pk)
    if study.state != Study.State.OPEN:
        raise Conflict(f"The study '{study.name}' is not open: nobody can enrol.")
    consent = consent.replace("\r\n", "\n").strip()
    if not 0 < len(consent) <= LONGEST_CONSENT:
        raise Conflict(f"What people agree to has 1 to {LONGEST_CONSENT} characters.")
    asks_for = one_line("asks_for", asks_for, what="enrolment", longest=LONGEST_ID)
    values = {
        "consent": consent,
        "asks_for": asks_for,
        "places": places,
        "votes_each": votes_each,
        "drop_out_after_h": drop_out_after_h,
        "is_open": is_open,
    }
    before = Enrolment.objects.filter(study=study).values(*values).first()
    enrolment, _ = Enrolment.objects.update_or_create(study=study, defaults=values)
    log_event(
        actor=actor,
        verb="set enrolment",
        object_kind="study",
        object_code=study.code,
        before=before,
        after=values,
    )
    return enrolment


@transaction.atomic
def enrol(*, token: str, external_id: str, agreed_sha256: str) -> EnrolledVoter:
    """Give a newcomer a place, an account and a quota of pairs.

    The pairs are a pure function of the study's seed and rules, of the number of this planning and
    of what was planned before; they are stored before the first showing.

    Args:
        token: Of the link.
        external_id: What they entered; one id has one place, however its letters are cased.
        agreed_sha256: Of the text that they agreed to, as it was shown.

    Raises:
        NotYours: No link has this token.
        EnrolmentOver: It takes nobody on: closed, the study too, or every place is taken.
        Conflict: The id is enrolled already, or another text was agreed to than holds now.
        InvalidDocument: The id is empty, too long or no line.
    """
    external_id = one_line("id", external_id, what="enrolment", longest=LONGEST_ID)
    found = enrolment_by_token(token)
    # What holds since the opening is read before the study is held: others wait only for the rest.
    fixed = _read_plan(found.study) if found.is_open else None
    study = Study.objects.select_for_update().get(pk=found.study_id)
    enrolment = Enrolment.objects.get(pk=found.pk)
    if fixed is None or not enrolment.is_open or study.state != Study.State.OPEN:
        raise EnrolmentOver("This study takes on nobody any more.")
    if agreed_sha256 != enrolment.consent_sha256:
        raise Conflict(
            gettext("The text was changed meanwhile. Please read it again before you agree.")
        )
    if enrolment.voters.filter(external_id__iexact=external_id).exists():
        raise Conflict(
            gettext(
                "“%(id)s” takes part already. Go on where you began, in the same browser, or ask "
                "who runs the study for a link of your own."
            )
            % {"id": external_id}
        )
    if not has_free_place(enrolment) and not drop_silent(enrolment=enrolment):
        raise EnrolmentOver("Every place of this study is taken.")
    return _take_on(study, enrolment, external_id, *fixed)


@transaction.atomic
def drop_silent(
    *, enrolment: Enrolment, now: datetime | None = None, actor: User | None = None
) -> int:
    """Give on the places of those who were silent for too long and are not done.

    Their votes stay; what they have not judged goes to whoever comes next, because newcomers get
    what is planned least. A pair that was reported stays, its report is about it.

    Returns:
        How many places became free.
    """
    study = Study.objects.select_for_update().get(pk=enrolment.study_id)
    at = now or timezone.now()
    gone = list(find_silent(enrolment, now=at))
    for voter in gone:
        _give_on(study, voter, at=at, actor=actor)
    return len(gone)


@transaction.atomic
def give_up_places(*, expert: User, actor: User | None = None) -> int:
    """Give on at once the places of somebody who comes no more and is not done; as `drop_silent`.

    Returns:
        How many places became free.
    """
    # Studies are held in the order of their numbers, as everybody does who holds several.
    places = EnrolledVoter.objects.filter(expert=expert, dropped_at=None)
    studies = list(
        Study.objects.select_for_update()
        .filter(state=Study.State.OPEN, pk__in=places.values("enrolment__study"))
        .order_by("pk")
    )
    given = 0
    for study in studies:
        for voter in find_unfinished(Enrolment.objects.get(study=study)).filter(expert=expert):
            _give_on(study, voter, at=timezone.now(), actor=actor)
            given += 1
    return given


# --- Private -----------------------------------------------------------------------------------


def _read_plan(study: Study) -> tuple[PlanRules, Cells]:
    """The rules with the pictures that they speak of."""
    cells = pictures_of(study)
    return without_lost_checks(rules_of(study), cells), cells


def _give_on(study: Study, voter: EnrolledVoter, *, at: datetime, actor: User | None) -> None:
    rows = undecided_rows(study, voter.expert)
    Matchup.objects.filter(pk__in=[row.pk for row in rows]).delete()
    EnrolledVoter.objects.filter(pk=voter.pk).update(dropped_at=at)
    log_event(
        actor=actor,
        verb="drop out",
        object_kind="person",
        object_code=voter.expert.person.code,
        after={"study": str(study.code), "withdrawn": len(rows)},
    )


def _take_on(
    study: Study, enrolment: Enrolment, external_id: str, rules: PlanRules, cells: Cells
) -> EnrolledVoter:
    person = create_person(
        username=f"voter-{uuid.uuid4().hex[:12]}",
        password=None,
        role="expert",
        pseudonym=_free_pseudonym(study),
    )
    number, grid = next_batch(study), rules.grid
    rng = np.random.default_rng([rules.seed, number])
    units = choose_units(grid, _judges(study, grid), enrolment.votes_each, rng)
    if not units:
        raise NothingToPlan(gettext("The study has no pair that could be shown."))
    planned, _ = follow_on(rules, grid, person.username, [], units, rng)
    store(study, planned, cells, [person], batch=number)
    study.experts.add(person)
    voter = EnrolledVoter.objects.create(
        enrolment=enrolment,
        expert=person,
        external_id=external_id,
        consent_sha256=enrolment.consent_sha256,
    )
    log_event(
        actor=person,
        verb="enrol",
        object_kind="study",
        object_code=study.code,
        after={"batch": number, "matchups": len(planned), "consent_sha256": voter.consent_sha256},
    )
    return voter


def _free_pseudonym(study: Study) -> str:
    """Voters of all studies are counted on; the study's code keeps two studies apart."""
    number = EnrolledVoter.objects.filter(enrolment__study=study).count() + 1
    return f"Voter {number} of {study.code.hex[:6]}"


def _judges(study: Study, grid: Grid) -> IntArray:
    """(P, S) how many experts have each unit; counted by the database, one query."""
    rows = {frozenset(pair): row for row, pair in enumerate(grid.pairs)}
    columns = {place: column for column, place in enumerate(grid.scenarios)}
    counts = np.zeros(grid.showable.shape, dtype=np.int64)
    names = (
        "scenario__slug",
        "left__contestant__slug",
        "right__contestant__slug",
        "right__sample",
    )
    shows_all = study.shows_all_samples
    counted = (
        study.matchups.filter(kind=Matchup.Kind.MAIN)
        .order_by()
        .values_list(*names)
        .annotate(n=Count("pk"))
    )
    for slug, left, right, sample, n in counted:
        place = place_of(slug, sample) if shows_all else slug
        counts[rows[frozenset((left, right))], columns[place]] += n
    return counts
