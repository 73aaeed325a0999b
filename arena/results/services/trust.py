"""Trustworthiness of a rating: agreement, sides, repeats, and the panel of experts."""

from collections import Counter
from dataclasses import fields, replace

import numpy as np

from arena.models import Study, Vote
from arena.pairing.order import MAIN
from arena.pairing.rules import sample_at, scenario_at
from arena.rating import influence
from arena.rating.comparisons import Comparisons, IntArray, restrict_to, select_votes, tally
from arena.rating.leaderboard import Leaderboard
from arena.rating.lines import count_text, unshown_text, whole_percent
from arena.rating.models import to_elo
from arena.rating.reliability import (
    Evidence,
    Repeats,
    agreement,
    evidence_of_repeats,
    raters,
    repeat_consistency,
)
from arena.rating.remarks import remark_on_ignored
from arena.rating.side import side_bias
from arena.rating.snapshot_document import BoardRemarks, PanelRater, StrengthCheck, Trust
from arena.results.queries.votes import AUTOMATIC, VoteSet
from arena.results.services.analysis import SCORES, VoteArrays

AGREEMENT_ROUNDS = 1000


def trust(arrays: VoteArrays, votes: VoteSet, *, seed: int) -> Trust:
    """All statistics about the votes themselves; parts that the votes do not determine are None.

    Args:
        arrays: The votes that count.
        votes: The same with hidden repeats and checks.
        seed: Of every draw.
    """
    rated = np.flatnonzero(tally(arrays.comparisons).sum(axis=1)).tolist()
    inner = restrict_to(arrays.comparisons, rated)
    samples = np.array([vote.sample for vote in votes.counted], dtype=np.int64)
    each = int(samples.max(initial=0)) + 1  # whose pictures are judged apart
    inner = replace(inner, scenario=inner.scenario * each + samples)
    if set(arrays.items) == {""}:  # nobody knows what was shown twice
        inner = replace(inner, scenario=np.arange(len(inner), dtype=np.int64))
    repeats = _repeats(arrays, votes)
    is_cast = np.array([vote.kind != AUTOMATIC for vote in votes.counted], dtype=np.bool_)
    by_hand = np.flatnonzero(is_cast)
    by_people = select_votes(inner, by_hand)
    return Trust(
        tie_share=float((by_people.score == 0.5).mean()) if len(by_people) else None,
        agreement=agreement(by_people, rounds=AGREEMENT_ROUNDS, seed=seed, samples=each),
        side=side_bias(by_people) if len(by_people) else None,
        repeats=repeats if repeats.number else None,
        raters=_panel(arrays, inner, by_hand, votes, repeats),
        strength=_check_strength(inner, votes),
        fragility=influence.votes_behind_first(inner, is_cast),
    )


def board_remarks(board: Leaderboard, arrays: VoteArrays, *more_warnings: str) -> BoardRemarks:
    """Return the remarks of a rating; none on pairs if votes have unknown clusters."""
    names = [line.name for line in board.lines]
    clusters = {"expert": {*arrays.judges} - {""}, "scenario": {*arrays.items} - {""}}
    unseen = [kind for kind in clusters if clusters[kind] and kind not in board.unit.kinds]
    judged = None if unseen else board.judged
    above = None
    if judged is not None:
        above = tuple((names[i], names[j]) for i, j in np.argwhere(judged.above).tolist())
    ignored = [kind for kind in unseen if len(clusters[kind]) > 1]
    return BoardRemarks(
        reasons=board.reasons,
        warnings=(*board.warnings, *remark_on_ignored(ignored), *more_warnings),
        tie_strength=board.tie_strength,
        experts=board.experts if clusters["expert"] else 0,
        scenarios=board.scenarios if clusters["scenario"] else 0,
        order=tuple(line.name for line in board.standings),
        parts={line.name: line.part for line in board.lines if line.part >= 0},
        above=None if board.is_few else above,
        p_values=None if judged is None or board.is_few else judged.judge_pairs(names),
        seems_above=above if board.is_few else None,
    )


def remark_on_ties(study: Study, votes: VoteSet, *, left_out: bool) -> str:
    """Return the table's estimand if pairs are counted as ties unshown, else an empty text.

    Args:
        study: What was planned.
        votes: That count.
        left_out: Whether settled pairs are left out.
    """
    settled = len(study.rules.get("identical", ()))
    if not settled:
        return ""
    ties = sum(vote.kind == AUTOMATIC for vote in votes.counted)
    where = "where their pictures differ" if left_out else "over all pairs of pictures"
    counted = f"{count_text(ties, 'tie|')}, as many a pair as others have votes on average"
    unshown = unshown_text(settled, "" if left_out else counted)
    sentence = f"The table says how contestants compare {where}: {unshown}."
    return f"{sentence} {_on_those_shown(study, votes)}".strip()


def _on_those_shown(study: Study, votes: VoteSet) -> str:
    """The tie share of alike pairs that experts were shown all the same."""
    shown = {
        (scenario_at(place), sample_at(place), frozenset((first, other)))
        for place, first, other in study.rules.get("alike_shown", ())
    }
    votes_shown = [
        vote.outcome == Vote.Outcome.EQUAL
        for vote in votes.counted
        if vote.kind == MAIN
        and (vote.item, vote.sample, frozenset((vote.left, vote.right))) in shown
    ]
    if not votes_shown:
        return ""
    return (
        f"Of {len(votes_shown)} votes on {len(shown)} such pairs that were shown all the same, "
        f"{sum(votes_shown)} are ties ({whole_percent(sum(votes_shown) / len(votes_shown))} %)."
    )


# --- Private -----------------------------------------------------------------------------------


def _check_strength(inner: Comparisons, votes: VoteSet) -> StrengthCheck | None:
    strengths = [vote.strength for vote in votes.counted]
    if not any(strengths):
        return None
    slightly, clearly = Vote.Strength.SLIGHTLY.value, Vote.Strength.CLEARLY.value
    check = StrengthCheck(slight=strengths.count(slightly), clear=strengths.count(clearly))
    is_slight = np.array(strengths) == slightly
    plain, weighed = influence.bradley_terry(inner), influence.bradley_terry(inner, is_slight)
    if plain is None or weighed is None:
        return check
    before, after = (np.argsort(-ratings, kind="stable").tolist() for ratings in (plain, weighed))
    return replace(
        check,
        change=float(np.abs(to_elo(weighed) - to_elo(plain)).max()),
        order=() if before == after else tuple(inner.names[index] for index in after),
    )


def _repeats(arrays: VoteArrays, votes: VoteSet) -> Repeats:
    """Each hidden repeat beside the first showing, from the same contestant's point of view."""
    first = {vote.matchup: vote for vote in votes.counted}
    number = {judge: index for index, judge in enumerate(arrays.judges)}
    rows = []
    for again in votes.repeats:
        before = first.get(again.repeat_of)
        if before is not None and again.judge in number:
            score = SCORES[again.outcome]
            same_side = score if again.left == before.left else 1.0 - score
            rows.append((SCORES[before.outcome], same_side, number[again.judge]))
    table = np.array(rows, dtype=np.float64).reshape(-1, 3)
    return repeat_consistency(table[:, 0], table[:, 1], table[:, 2].astype(np.int64))


def _panel(
    arrays: VoteArrays, inner: Comparisons, chosen: IntArray, votes: VoteSet, repeats: Repeats
) -> tuple[PanelRater, ...]:
    """A line an expert, by the votes that people gave (V,)."""
    experts = len(arrays.judges)
    strengths = influence.bradley_terry(inner)
    without = np.full((experts, len(inner.names)), np.nan)
    changes: list[int | None] = [None] * experts
    if strengths is not None and experts > 1:
        without = influence.without_each_expert(inner, strengths)
        changes = influence.rank_changes(strengths, without)
    names = {vote.judge: vote.judge_name for vote in votes.counted}
    panel = []
    lines = raters(select_votes(inner, chosen), ms=arrays.ms[chosen], without=without)
    steadiness = evidence_of_repeats(repeats, {line.expert: line.ties for line in lines})
    for line in lines:
        judge = arrays.judges[line.expert]
        checks = [vote for vote in votes.checks if vote.judge == judge]
        answered = [vote for vote in checks if vote.outcome in SCORES]
        own = (vote for vote in votes.counted if vote.judge == judge)
        aids = Counter(aid for vote in own for aid in vote.aids.split())
        panel.append(
            PanelRater(
                **{field.name: getattr(line, field.name) for field in fields(line)}
                | {"evidence": line.evidence + steadiness.get(line.expert, Evidence())},
                judge=judge,
                name=names[judge],
                moves=changes[line.expert],
                repeats=repeats.by_expert.get(line.expert, (0, 0)),
                checks=(len(answered), sum(vote.winner in votes.references for vote in answered)),
                checks_skipped=len(checks) - len(answered),
                aids=tuple(sorted(aids.items())),
            )
        )
    return tuple(panel)
