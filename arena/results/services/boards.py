"""Boards: one rating over the votes of a series of studies, published as dated tables."""

import json
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict
from datetime import UTC, datetime

from django.contrib.auth.models import User
from django.db import IntegrityError, transaction
from django.db.models import Q
from django.utils import timezone

from arena.errors import StudyStillOpen
from arena.exports.files import sha256_hex
from arena.models import Board, BoardTable, Question, Study
from arena.models.people import fresh_token
from arena.rating import board_table
from arena.rating.leaderboard import Leaderboard, rate
from arena.rating.lines import Line, hide_ranks, says_no_order
from arena.rating.remarks import NOT_RANKED
from arena.rating.rules import METHOD_TEXTS, text_of_intervals
from arena.results.queries.votes import AUTOMATIC, Filters, VoteSet, last_vote_id, vote_set
from arena.results.services.analysis import count_settled_ties, vote_arrays
from arena.results.services.ratings import software_versions
from arena.results.services.trust import board_remarks
from arena.results.services.vote_files import vote_rows, votes_csv
from arena.studies.queries import author_pairs, find_by_name_or_code
from arena.studies.services.opening import preregistration_sha256
from augment.errors import Conflict
from augment.models import Benchmark, Contestant, Scenario, Submission
from augment.services import log_change, one_line
from augment.services.benchmarks import Split, list_remarks

LONGEST_NAME = 100

WriteFiles = Callable[[board_table.BoardTableDocument], dict[str, str]]
"""Makes the files of a table: their texts by their endings, "json" the document itself."""

# --- A board and its link ----------------------------------------------------------------------


@transaction.atomic
def make_board(
    *,
    name: str,
    study: Study,
    benchmark: Benchmark | None = None,
    provisional_above: int = board_table.PROVISIONAL_ABOVE,
    actor: User | None = None,
) -> Board:
    """Begin a board with its first study, whose scenarios and rules all batches share.

    Args:
        name: Of the board; batches have it in theirs, which experts see.
        study: The first one.
        benchmark: Whose test split it shows; None for scenarios of no benchmark.
        provisional_above: Points to either side; a wider interval makes a line provisional.
        actor: Who begins it, for the log.

    Raises:
        InvalidDocument: The name is empty, too long or not one line.
        Conflict: The name is taken, the study's votes can't be pooled with others, or it does not
            show the benchmark's test split.
    """
    name = one_line("name", name, what="board", longest=LONGEST_NAME)
    try:
        with transaction.atomic():
            board = Board.objects.create(
                name=name, benchmark=benchmark, provisional_above=provisional_above
            )
    except IntegrityError:
        raise Conflict(f"There is a board named '{name}' already.") from None
    board.studies.add(study)
    require_poolable(board, but_open=True)
    # Asked once: a benchmark may be retired, and its scenarios changed, while the board goes on.
    if benchmark is not None:
        # Of the test split alone: references of the practice split are public.
        items = benchmark.items.filter(split=Split.TEST)
        scenarios = Scenario.objects.filter(benchmark_items__in=items).order_by("slug")
        if _frozen_scenarios(study) != list(scenarios.values_list(*_SHOWN)):
            raise Conflict(
                f"'{study.name}' does not show just the scenarios and instructions of the test "
                f"split of {benchmark}: its votes can't be rated on this board."
            )
    log_change(board, "make", actor, after={"name": name, "study": str(study.code)})
    return board


def board_named(name_or_code: str) -> Board:
    """Return a board by its name or its code.

    Raises:
        UnknownName: There is none.
    """
    return find_by_name_or_code(Board.objects.all(), "board", name_or_code)


@transaction.atomic
def share_board(board: Board, *, is_shared: bool, actor: User | None = None) -> None:
    """Make the link by which anybody reads the board's tables, or take it back for good."""
    changed = Board.objects.filter(pk=board.pk, token__isnull=is_shared)
    if changed.update(token=fresh_token() if is_shared else None):
        log_change(board, "share results" if is_shared else "stop sharing results", actor)


# --- Tables ------------------------------------------------------------------------------------


def publish_table(
    board: Board, *, write: WriteFiles, now: datetime | None = None, actor: User | None = None
) -> BoardTable:
    """Rate the pooled votes and keep the table and its files for good, as the next number.

    Args:
        board: Whose.
        write: Makes the files.
        now: The table's date; the clock's unless given.
        actor: Who publishes, for the log.

    Raises:
        StudyStillOpen: One of the studies takes votes.
        Conflict: No study was closed since the newest table, no vote counts, the studies can't be
            pooled, or somebody else published meanwhile.
    """
    studies, newest = require_poolable(board), board.tables.first()
    before = newest.document if newest else None
    if before and {study.code for study in before.studies} >= {str(row.code) for row in studies}:
        raise Conflict("No study of the board was closed since its newest table.")
    number, now = (before.number if before else 0) + 1, now or timezone.now()
    document = make_document(board, studies, before, number=number, now=now)
    if not document.votes:
        raise Conflict("No study of the board has votes that count.")
    files = write(document)
    try:
        with transaction.atomic():
            table = BoardTable.objects.create(board=board, number=number, made_at=now, files=files)
            after = {"number": number, "votes": document.votes}
            log_change(board, "publish", actor, after=after)
    except IntegrityError:
        raise Conflict(f"Table {number} has just been published by somebody else.") from None
    return table


def require_poolable(board: Board, *, but_open: bool = False) -> list[Study]:
    """Return the board's studies in order, without cancelled ones.

    Args:
        board: Whose.
        but_open: Whether studies that take votes will do.

    Raises:
        StudyStillOpen: One of them takes votes.
        Conflict: They show different scenarios or ask different questions, or there is none.
    """
    rows = board.studies.exclude(state=Study.State.CANCELLED).order_by("opened_at", "pk")
    studies = list(rows)
    if not studies:
        raise Conflict("All studies of the board were cancelled: nothing can be rated.")
    first = studies[0]
    wanted = _frozen_scenarios(first)
    for study in studies:
        if study.state == Study.State.OPEN and not but_open:
            raise StudyStillOpen(study.name)
        if _frozen_scenarios(study) != wanted:
            raise Conflict(
                f"'{study.name}' does not show just the scenarios and instructions of "
                f"'{first.name}': its votes can't be rated on this board."
            )
        if study.questions[0] != first.questions[0]:
            raise Conflict(
                f"'{study.name}' asks something else than '{first.name}': their votes can't be "
                "rated together."
            )
    return studies


def make_document(
    board: Board,
    studies: Sequence[Study],
    before: board_table.BoardTableDocument | None,
    *,
    number: int,
    now: datetime,
) -> board_table.BoardTableDocument:
    """Rate the votes of closed studies; experts and scenarios are clusters over all of them.

    Args:
        board: Whose studies these are.
        studies: In order, the first one first.
        before: The newest table so far, which knows since when who is listed.
        number: Of the new table.
        now: When it is made.
    """
    sets = [
        vote_set(study, filters=Filters(authors=author_pairs(study)), last=last_vote_id(study))
        for study in studies
    ]
    votes = [vote for votes_of in sets for vote in votes_of.counted]
    by_slug = {who.slug: who for votes_of in sets for who in votes_of.competitors}
    founders = tuple(who.slug for who in sets[0].competitors)
    arrays = vote_arrays([by_slug[slug] for slug in sorted(by_slug)], votes)
    rated = rate(arrays.comparisons, founders=founders)
    remarks = board_remarks(rated, arrays)
    made_at = now.astimezone(UTC).isoformat(timespec="seconds")
    settled = count_settled_ties(votes)
    not_ranked = [NOT_RANKED] if says_no_order(rated.standings) else []
    cast = len(votes) - settled.total() // 2
    standings = hide_ranks(rated.standings) if not_ranked else rated.standings
    since = {line.slug: line.since for line in before.lines} if before else {}
    lines = tuple(
        _board_line(board, line, by_slug[line.name], since.get(line.name, made_at[:10]), settled)
        for line in board_table.anchor_lines(standings, founders)
    )
    judges = {vote.judge: vote.judge_name for vote in votes}
    return board_table.BoardTableDocument(
        board=board.name,
        number=number,
        made_at=made_at,
        benchmark=str(board.benchmark or ""),
        benchmark_sha256=board.benchmark.checksum if board.benchmark else "",
        question=str(Question(studies[0].questions[0]).label),
        method=_method_text(rated),
        answer=remarks.answer(lines, [line.slug for line in lines], cast),
        lines=lines,
        studies=tuple(map(_pool, studies, sets)),
        founders=founders,
        votes=cast,
        votes_sha256=sha256_hex(votes_csv(vote_rows(votes, judges))),
        left_out=dict(sorted(sum((Counter(x.left_out) for x in sets), Counter[str]()).items())),
        notes=(*list_remarks(board.benchmark), *rated.reasons, *remarks.warnings, *not_ranked),
        versions={name: str(version) for name, version in software_versions().items()},
        includes_simulated=any(who.is_simulated for who in by_slug.values())
        or any(vote.is_simulated for vote in votes),
        settled_ties=len(votes) - cast,
        provisional_above=float(board.provisional_above),
    )


# --- Private -----------------------------------------------------------------------------------


def _method_text(rated: Leaderboard) -> str:
    intervals = text_of_intervals(rated.intervals, rated.unit, rated.rounds)
    return f"{METHOD_TEXTS[rated.method]}, {intervals}"


_SHOWN = ("slug", "type", "instruction")


def _frozen_scenarios(study: Study) -> list[tuple[str, ...]]:
    """Return the study's scenarios with types and instructions, as frozen at its opening.

    Raises:
        Conflict: Nothing was frozen.
    """
    if not study.preregistration:
        raise Conflict(f"Nobody knows what '{study.name}' showed: it has no preregistration.")
    frozen = json.loads(study.preregistration)["scenarios"]
    return [tuple(scenario[name] for name in _SHOWN) for scenario in frozen]


def _pool(study: Study, votes: VoteSet) -> board_table.PooledStudy:
    return board_table.PooledStudy(
        name=study.name,
        code=str(study.code),
        closed_at=study.closed_at.astimezone(UTC).isoformat() if study.closed_at else "",
        votes=sum(vote.kind != AUTOMATIC for vote in votes.counted),
        preregistration=preregistration_sha256(study),
        challengers=tuple(study.rules.get("challengers", ())),
    )


def _board_line(
    board: Board, line: Line, who: Contestant, since: str, settled: Counter[str]
) -> board_table.BoardLine:
    card = who.card or {}
    submitted, withdrawn = _count_attempts(who)
    return board_table.BoardLine(
        slug=who.slug,
        kind=who.kind,
        is_simulated=who.is_simulated,
        since=since,
        authors=tuple(card.get("authors", ())),
        is_open=card.get("is_open"),
        settled_ties=settled[who.slug],
        is_provisional=board_table.is_provisional(line, board.provisional_above),
        submitted=submitted,
        withdrawn=withdrawn,
        **asdict(line)
        | {"name": who.name, "votes": line.votes - settled[who.slug]}
        | {"ties": line.ties - settled[who.slug]},
    )


def _count_attempts(contestant: Contestant) -> tuple[int | None, int | None]:
    """Return how many folders the sender of a submission sent and took back."""
    own = Submission.objects.filter(contestant=contestant).first()
    if own is None:
        return None, None
    # Where no sender is known, nobody knows whose the others are.
    others = Q(benchmark__slug=own.benchmark.slug, uploaded_by_id=own.uploaded_by_id or 0)
    sent = Submission.objects.filter(Q(pk=own.pk) | others)
    return sent.count(), sent.filter(decision=Submission.Decision.WITHDRAWN).count()
