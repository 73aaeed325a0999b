"""Changes of who takes part: pairs handed over, enrolment by link, drop-outs, forgetting."""

import re
import uuid
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

from axes.models import AccessAttempt, AccessFailureLog, AccessLog
from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import QuerySet
from django.utils import timezone
from django.utils.translation import gettext

from arena.errors import EnrolmentOver, NothingToPlan, StudyNotOpen
from arena.models import EnrolledVoter, Enrolment, Matchup, Person, Study, StudyDraft
from arena.pairing.later import choose_for_newcomer, deal, judges, main_units
from arena.people import services
from arena.people.queries import experts as expert_accounts
from arena.people.queries import forgotten_name, may_be_let_in
from arena.studies.queries import expert_named, find_silent, find_unfinished
from arena.studies.services.opening import find_named
from arena.studies.services.planning import Planning, list_planned
from augment.errors import Conflict
from augment.services import is_readable_line, log_change, one_line

LONGEST_CONSENT, LONGEST_ID = 5_000, 120
_PLACEHOLDER = re.compile(r"\{\{|\}\}|\$\{")
"""What platforms replace by an id, such as `{{%PROLIFIC_PID%}}` or `${workerId}`."""

# --- Handing over ------------------------------------------------------------------------------


@transaction.atomic
def hand_over(
    *, study: Study, username: str, to: Sequence[str], actor: User | None = None
) -> dict[str, int]:
    """Let others judge what an expert has not judged; return each taker's votes by username.

    The rows of the undecided matchups give way to new ones with fresh tokens, behind what the
    takers have; their sides are balanced anew. The expert's votes stay, and so do pairs that the
    expert has reported without judging them, and pairs whose hidden repeat has a vote already.

    Args:
        study: An open one.
        username: Whose matchups are handed over.
        to: Usernames of experts; who is new to the study joins it.
        actor: Who hands over, for the log.

    Raises:
        StudyNotOpen: The study takes no votes.
        UnknownName: Somebody is no expert, or does not vote in the study.
        Conflict: The takers are simulated where the study does not allow it, or include the giver.
        NothingToPlan: Nothing is left to hand over, or nobody can take a pair.
    """
    study = Study.objects.select_for_update().get(pk=study.pk)
    if study.state != Study.State.OPEN:
        raise StudyNotOpen(f"The study '{study.name}' is {study.state}: nothing is handed over.")
    giver = expert_named(study, username)
    takers = _find_takers(study, username, to)
    names = [taker.username for taker in takers]
    planning, dealt_before = Planning.begin(study), list_planned(study)
    rows = lock_undecided(study, giver)
    positions = {row.position for row in rows}
    open_pairs = [pair for pair in dealt_before[username] if pair.position in positions]
    units = main_units(planning.grid, open_pairs)
    if not units:
        raise NothingToPlan(f"{username} has nothing left to hand over.")
    dealt = deal(planning.grid, dealt_before, names, units, planning.rng)
    planned = [
        pair for name in names for pair in planning.follow(name, dealt_before[name], dealt[name])
    ]
    # What they show is kept before they go.
    planning.store(planned, takers)
    Matchup.objects.filter(pk__in=[row.pk for row in rows]).delete()
    study.experts.add(*takers)
    taken = {name: len(dealt[name]) for name in names}
    withdrawn = [
        [row.position, row.kind, row.scenario.slug]
        + [side.contestant.slug for side in (row.left, row.right)]
        for row in rows
    ]
    log_change(
        study,
        "hand over",
        actor,
        before={"expert": username, "matchups": withdrawn},
        after={"batch": planning.number, "votes": taken},
    )
    return taken


def _find_takers(study: Study, username: str, to: Sequence[str]) -> list[User]:
    if not to or username in to:
        raise Conflict(f"Name at least one expert, other than {username}, who takes over.")
    takers = find_named("expert", to, {user.username: user for user in expert_accounts()})
    simulated = [user.username for user in takers if user.person.is_simulated]
    if simulated and not study.allow_simulated:
        raise Conflict(f"Simulated: {', '.join(simulated)}. This study does not allow them.")
    return takers


def lock_undecided(study: Study, giver: User) -> list[Matchup]:
    """Return an expert's unjudged, unreported matchups, locked until re-planned.

    A vote or a report holds its matchup's row until it is stored: after waiting, look again.
    """
    untouched = (
        study.matchups.filter(expert=giver, votes=None, reports=None)
        .exclude(repeated_by__reports__isnull=False)
        .exclude(repeated_by__votes__isnull=False)
    )
    rows = list(
        untouched.select_for_update(of=("self",))
        .select_related("scenario", "left__contestant", "right__contestant")
        .order_by("position")
    )
    still = set(untouched.values_list("pk", flat=True))
    return [row for row in rows if row.pk in still]


# --- Enrolment by a link for everybody ---------------------------------------------------------


@transaction.atomic
def set_enrolment(
    *, study: Study, rules: Mapping[str, Any], actor: User | None = None
) -> Enrolment:
    """Make the link of an open study, or change what it says; the link itself stays the same.

    Who has enrolled already keeps quota and place.

    Args:
        study: An open one.
        rules: Columns of Enrolment: consent, asks_for, places, votes_each, drop_out_after_h,
            completes_with and is_open. Agreements are kept with a digest of the consent.
        actor: Who does so, for the log.

    Raises:
        Conflict: The study is not open, or a text is empty or too long.
        InvalidDocument: What is asked for is no line.
    """
    study = Study.objects.select_for_update().get(pk=study.pk)
    if study.state != Study.State.OPEN:
        raise Conflict(f"The study '{study.name}' is not open: nobody can enrol.")
    consent = rules["consent"].replace("\r\n", "\n").strip()
    if not 0 < len(consent) <= LONGEST_CONSENT:
        raise Conflict(f"What people agree to has 1 to {LONGEST_CONSENT} characters.")
    asks_for = one_line("asks_for", rules["asks_for"], what="enrolment", longest=LONGEST_ID)
    values = {**rules, "consent": consent, "asks_for": asks_for}
    before = Enrolment.objects.filter(study=study).values(*values).first()
    enrolment, _ = Enrolment.objects.update_or_create(study=study, defaults=values)
    log_change(study, "set enrolment", actor, before=before, after=values)
    return enrolment


def check_id(text: str) -> str:
    """Return the id or name of a voter, or an id of a platform, without blanks around it.

    Raises:
        Conflict: It is empty, too long or no line, or the platform has left its placeholder.
    """
    text = text.strip()
    if len(text) > LONGEST_ID or not is_readable_line(text) or _PLACEHOLDER.search(text):
        problem = gettext(
            "“%(id)s” is no ID: 1 to %(most)s printable characters are needed, and no placeholder "
            "that the platform has left. Please tell who runs the study."
        )
        raise Conflict(problem % {"id": text, "most": LONGEST_ID})
    return text


def find_returning(enrolment: Enrolment, name: str, session: str) -> EnrolledVoter | None:
    """Return who comes again from a platform.

    An id alone is no key: others may know it. The platform's session is known to nobody else.
    """
    voters = enrolment.voters.select_related("expert__person").exclude(platform_session="")
    voter = voters.filter(external_id__iexact=name, platform_session=session).first()
    return voter if voter is not None and may_be_let_in(voter.expert) else None


@transaction.atomic
def enrol(*, token: str, external_id: str, agreed_sha256: str, **platform: str) -> EnrolledVoter:
    """Give a newcomer a place, an account and a quota of pairs.

    Args:
        token: Of the link.
        external_id: What they entered; one id has one place, however its letters are cased.
        agreed_sha256: Of the text that they agreed to, as it was shown.
        platform: Further ids by their columns of EnrolledVoter.

    Raises:
        EnrolmentOver: It is closed, the study too, or every place is taken.
        Conflict: The id is no id or enrolled already, or another text was agreed to than holds
            now.
    """
    external_id = check_id(external_id)
    study = Study.objects.select_for_update().get(enrolment__token=token)
    enrolment = study.enrolment
    if not enrolment.is_open or study.state != Study.State.OPEN:
        raise EnrolmentOver("This study takes on nobody any more.")
    if agreed_sha256 != enrolment.consent_sha256:
        raise Conflict(
            gettext("The text was changed meanwhile. Please read it again before you agree.")
        )
    if enrolment.voters.filter(external_id__iexact=external_id).exists():
        text = gettext(
            "“%(id)s” takes part already. Go on where you began, in the same browser, or ask "
            "who runs the study for a link of your own."
        )
        raise Conflict(text % {"id": external_id})
    taken = enrolment.voters.filter(dropped_at=None).count()
    if taken >= enrolment.places and not drop_silent(enrolment=enrolment):
        raise EnrolmentOver("Every place of this study is taken.")
    return _take_on(study, enrolment, {"external_id": external_id, **platform})


def _take_on(study: Study, enrolment: Enrolment, ids: Mapping[str, str]) -> EnrolledVoter:
    # Voters of all studies are counted on; the study's code keeps two studies apart.
    number = EnrolledVoter.objects.filter(enrolment__study=study).count() + 1
    person = services.create_person(
        username=f"voter-{uuid.uuid4().hex[:12]}",
        password=None,
        role="expert",
        pseudonym=f"Voter {number} of {study.code.hex[:6]}",
    )
    planning = Planning.begin(study)
    counts = judges(planning.grid, list_planned(study))
    units = choose_for_newcomer(planning.grid, counts, enrolment.votes_each, planning.rng)
    if not units:
        raise NothingToPlan(gettext("The study has no pair that could be shown."))
    planned = planning.follow(person.username, [], units)
    planning.store(planned, [person])
    study.experts.add(person)
    voter = EnrolledVoter.objects.create(
        enrolment=enrolment, expert=person, consent_sha256=enrolment.consent_sha256, **ids
    )
    after = {
        "batch": planning.number,
        "matchups": len(planned),
        "consent_sha256": voter.consent_sha256,
    }
    log_change(study, "enrol", person, after=after)
    return voter


@transaction.atomic
def drop_silent(*, enrolment: Enrolment, now: datetime | None = None) -> int:
    """Free the places of those who were silent for too long and are not done.

    Their votes stay; newcomers get what they have not judged, because it is planned least.

    Returns:
        How many places became free.
    """
    study = Study.objects.select_for_update().get(pk=enrolment.study_id)
    at = now or timezone.now()
    silent = list(find_silent(enrolment, now=at))
    for voter in silent:
        _drop(study, voter, at=at, actor=None)
    return len(silent)


def give_up_places(*, expert: User, actor: User | None = None) -> None:
    """Free at once the places of somebody who comes no more and is not done."""
    # Studies are locked in the order of their keys, as everywhere.
    places = EnrolledVoter.objects.filter(expert=expert, dropped_at=None)
    studies = Study.objects.select_for_update().filter(
        state=Study.State.OPEN, pk__in=places.values("enrolment__study")
    )
    for study in list(studies.order_by("pk")):
        for voter in find_unfinished(study).filter(expert=expert):
            _drop(study, voter, at=timezone.now(), actor=actor)


def _drop(study: Study, voter: EnrolledVoter, *, at: datetime, actor: User | None) -> None:
    rows = lock_undecided(study, voter.expert)
    Matchup.objects.filter(pk__in=[row.pk for row in rows]).delete()
    EnrolledVoter.objects.filter(pk=voter.pk).update(dropped_at=at)
    after = {"study": str(study.code), "withdrawn": len(rows)}
    log_change(voter.expert.person, "drop out", actor, after=after)


# --- Forgetting --------------------------------------------------------------------------------


@transaction.atomic
def forget_identity(*, user: User, actor: User) -> None:
    """Remove name, address and pseudonym of an account for good; its votes stay.

    Who came by an enrolment link and is not done loses the place. Ratings that are frozen keep
    the pseudonym that stood there when they were made.

    Raises:
        Conflict: It is one's own, or the actor is no admin any more.
    """
    services.check_may_change(user, actor)
    known_as, name = user.get_username(), forgotten_name(user.person)
    User.objects.filter(pk=user.pk).update(
        username=name, first_name="", last_name="", email="", is_active=False, last_login=None
    )
    user.refresh_from_db()
    user.set_unusable_password()
    services.end_links(user)
    Person.objects.filter(user=user).update(pseudonym=f"Former person {name[5:]}", preferences={})
    # Locks the studies, which comes before what is in them.
    _rename_expert(Study.objects.all(), "rules", known_as, name)
    give_up_places(expert=user, actor=actor)
    EnrolledVoter.objects.filter(expert=user).update(
        external_id="", platform_study="", platform_session=""
    )
    _rename_expert(StudyDraft.objects.all(), "entered", known_as, name)
    for failures in (AccessAttempt, AccessFailureLog, AccessLog):
        failures.objects.filter(username=known_as).delete()
    services.end_sessions(services.SIGNED_IN, {str(user.pk)})
    log_change(user.person, "forget identity", actor)


def _rename_expert(rows: QuerySet[Any], column: str, known_as: str, name: str) -> None:
    """Replace a name among the experts that documents in a column choose."""
    for row in rows.select_for_update().order_by("pk"):
        document = getattr(row, column)
        experts = document.get("experts", [])
        if known_as in experts:
            document["experts"] = [name if entry == known_as else entry for entry in experts]
            row.save(update_fields=[column])
