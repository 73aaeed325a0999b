"""Handing over what an expert has not judged to others."""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from datetime import datetime

import numpy as np
from axes.models import AccessAttempt, AccessFailureLog, AccessLog
from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import Count
from django.utils import timezone
from django.utils.translation import gettext

from arena.errors import EnrolmentOver, NothingToPlan, StudyNotOpen
from arena.models import EnrolledVoter, Enrolment, Invitation, Matchup, Person, Study
from arena.pairing.later import choose_for_newcomer as choose_units
from arena.pairing.later import deal, follow_on, units_of
from arena.pairing.rules import Grid, IntArray, PlannedMatchup, PlanRules, place_of
from arena.people.queries import experts as expert_accounts
from arena.people.queries import forgotten_name
from arena.people.services import check_may_change, create_person, log_person, sign_out
from arena.services.frames import Cells
from arena.studies.queries import enrolment_by_token, find_silent, find_unfinished, has_free_place
from arena.studies.services.drafts import rename_in_drafts
from arena.studies.services.pictures import without_lost_checks
from arena.studies.services.planning import (
    next_batch,
    pictures_of,
    planned_so_far,
    rules_of,
    store,
    votes_left,
)
from augment.errors import Conflict, UnknownName
from augment.services.events import log_event
from augment.services.texts import one_line


@transaction.atomic
def hand_over(
    *, study: Study, username: str, to: Sequence[str], actor: User | None = None
) -> dict[str, int]:
    """Let others judge what an expert has not judged, re-planned in one go.

    Every pair keeps its votes. The rows of the undecided matchups give way to new ones with fresh
    tokens, behind what the takers have; their sides are balanced anew. The expert's votes stay, as
    do pairs that the expert has reported without judging them: the report is about them. So do
    pairs whose hidden repeat has a vote already, which only votes out of order can lead to.

    Args:
        study: An open one.
        username: Whose matchups are handed over.
        to: Usernames of experts; who is new to the study joins it.
        actor: Who hands over, for the log.

    Returns:
        How many votes each taker is to give, by username.

    Raises:
        StudyNotOpen: The study takes no votes.
        UnknownName: Somebody is no expert, or does not vote in the study.
        Conflict: The takers are simulated where the study does not allow it, or include the giver.
        NothingToPlan: Nothing is left to hand over, or nobody can take a pair.
    """
    study = Study.objects.select_for_update().get(pk=study.pk)
    if study.state != Study.State.OPEN:
        raise _not_open(study)
    giver, takers = _giver(study, username), _takers(study, username, to)
    cells, known, number = pictures_of(study), planned_so_far(study), next_batch(study)
    rules = without_lost_checks(rules_of(study), cells)
    grid = rules.grid
    rng = np.random.default_rng([rules.seed, number])
    open_rows = undecided_rows(study, giver)
    names = [taker.username for taker in takers]
    units = units_of(grid, [_as_planned(row) for row in open_rows])
    later = _shares(votes_left(study, giver), names)
    if not units and not any(later.values()):
        raise NothingToPlan(f"{username} has nothing left to hand over.")
    dealt = deal(grid, known, names, units, rng)
    planned = [
        one
        for name in names
        for one in follow_on(rules, grid, name, known[name], dealt[name], rng)[0]
    ]
    Matchup.objects.filter(pk__in=[row.pk for row in open_rows]).delete()
    store(study, planned, cells, takers, batch=number)
    study.experts.add(*takers)
    _move_votes_to_plan(study, username, later)
    taken = {name: len(dealt[name]) + later[name] for name in names}
    log_event(
        actor=actor,
        verb="hand over",
        object_kind="study",
        object_code=study.code,
        before={"expert": username, "matchups": [_line(row) for row in open_rows]},
        after={"batch": number, "votes": taken},
    )
    return taken


# --- Who ---------------------------------------------------------------------------------------


def _not_open(study: Study) -> StudyNotOpen:
    return StudyNotOpen(f"The study '{study.name}' is {study.state}: nothing is handed over.")


def _giver(study: Study, username: str) -> User:
    found = study.experts.filter(username=username).first()
    if found is None:
        known = sorted(study.experts.values_list("username", flat=True))
        raise UnknownName("expert of this study", username, known)
    return found


def _takers(study: Study, username: str, to: Sequence[str]) -> list[User]:
    known = {user.username: user for user in expert_accounts()}
    if not to:
        raise Conflict("Name at least one expert who takes over.")
    if username in to:
        raise Conflict(f"{username} can't take over their own pairs.")
    for name in to:
        if name not in known:
            raise UnknownName("expert", name, sorted(known))
    takers = [known[name] for name in sorted(set(to))]
    simulated = [user.username for user in takers if user.person.is_simulated]
    if simulated and not study.allow_simulated:
        raise Conflict(f"Simulated: {', '.join(simulated)}. This study does not allow them.")
    return takers


# --- Handing over ------------------------------------------------------------------------------


def undecided_rows(study: Study, giver: User) -> list[Matchup]:
    """What an expert has not judged and nobody has reported, held until it is re-planned.

    A vote holds its matchup's row until it is stored, and a report until then as well: having
    waited for them, look again.
    """
    untouched = (
        study.matchups.filter(expert=giver, votes=None, reports=None)
        .exclude(repeated_by__reports__isnull=False)
        .exclude(repeated_by__votes__isnull=False)
    )
    rows = list(
        untouched.select_for_update(of=("self",))
        .select_related("study", "scenario", "left__contestant", "right__contestant")
        .order_by("position")
    )
    still = set(untouched.values_list("pk", flat=True))
    return [row for row in rows if row.pk in still]


def _as_planned(row: Matchup) -> PlannedMatchup:
    scenario = row.scenario.slug
    if row.study.shows_all_samples:
        scenario = place_of(scenario, 1 if row.kind == Matchup.Kind.CHECK else row.right.sample)
    return PlannedMatchup(
        expert="",
        position=row.position,
        scenario=scenario,
        left=row.left.contestant.slug,
        right=row.right.contestant.slug,
        draw_probability=row.draw_probability,
        kind=row.kind,
    )


def _line(row: Matchup) -> list[str | int]:
    """One withdrawn matchup in the log."""
    shown = row.left.contestant.slug, row.right.contestant.slug
    return [row.position, row.kind, row.scenario.slug, *shown]


def _shares(votes: int, names: Sequence[str]) -> dict[str, int]:
    """Votes that are still to be planned, shared out equally."""
    return {
        name: votes // len(names) + (index < votes % len(names))
        for index, name in enumerate(names)
    }


def _move_votes_to_plan(study: Study, giver: str, later: dict[str, int]) -> None:
    if not study.votes_to_plan:
        return
    waiting = {**study.votes_to_plan, giver: 0}
    for name, votes in later.items():
        waiting[name] = waiting.get(name, 0) + votes
    study.votes_to_plan = waiting
    study.save(update_fields=["votes_to_plan"])


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


@transaction.atomic
def forget_identity(*, user: User, actor: User) -> None:
    """Remove name, address and pseudonym of an account for good; its votes stay.

    Who came by an enrolment link and is not done loses the place, as nobody can sign in any more.
    Ratings that are frozen keep the pseudonym that stood there when they were made.

    Raises:
        Conflict: It is one's own, or the actor administrates no more.
    """
    check_may_change(user, actor)
    known_as, name = user.get_username(), forgotten_name(user.person)
    User.objects.filter(pk=user.pk).update(
        username=name, first_name="", last_name="", email="", is_active=False, last_login=None
    )
    user.refresh_from_db()
    user.set_unusable_password()
    user.save(update_fields=["password"])
    Person.objects.filter(user=user).update(pseudonym=f"Former person {name[5:]}", preferences={})
    Invitation.objects.filter(expert=user, revoked_at=None).update(revoked_at=timezone.now())
    _rename_in_plans(known_as, name)  # holds the studies, which comes before what is in them
    give_up_places(expert=user, actor=actor)
    EnrolledVoter.objects.filter(expert=user).update(external_id="")
    rename_in_drafts(known_as, name)
    for failures in (AccessAttempt, AccessFailureLog, AccessLog):
        failures.objects.filter(username=known_as).delete()
    sign_out(user)
    log_person(user, "forget identity", actor)


def _rename_in_plans(known_as: str, name: str) -> None:
    """Studies keep in their rules whom they were planned for, by name."""
    for study in Study.objects.select_for_update().order_by("pk"):
        experts = study.rules.get("experts", [])
        if known_as not in experts and known_as not in study.votes_to_plan:
            continue
        named = {known_as: name}
        if experts:
            study.rules["experts"] = [named.get(one, one) for one in experts]
        study.votes_to_plan = {
            named.get(one, one): votes for one, votes in study.votes_to_plan.items()
        }
        study.save(update_fields=["rules", "votes_to_plan"])
