"""Agreement of metrics with experts, as a table in files."""

from collections.abc import Sequence

from arena.exports.formats import Columns, Dtype, Sheet, formats, make_sheet, table_formats
from arena.exports.latex import escape, latex_table
from arena.models import Question, Snapshot
from arena.rating.agreement import AgreementLine, LineRole, agreement_sentence, share_text
from arena.rating.lines import UNKNOWN
from augment.errors import Conflict

METHOD = (
    "a decided vote names a better side; a rater that calls both equal agrees by half; votes on "
    "pairs of which it knows nothing are left out of its share; intervals are clustered by expert "
    "and scenario"
)
_COUNTS = ("decided", "agrees", "ties", "differs", "unknown", "experts", "scenarios")
COLUMNS: Columns = {
    **Dtype.TEXT.columns("question", "rater", "role", "type"),
    **{
        name: (f"share.{part}", Dtype.NUMBER)
        for name, part in (("share", "value"), ("lower", "lower"), ("upper", "upper"))
    },
    **Dtype.WHOLE.columns(*_COUNTS),
}
"""`type` is empty in lines on all scenario types; shares go from 0 to 1."""


def agreement_rating(snapshot: Snapshot) -> Snapshot:
    """Return a rating that has such a table.

    Raises:
        Conflict: It has none.
    """
    if not snapshot.results.agreement:
        raise Conflict(
            "This rating does not say which metric agrees with experts: no vote on pictures is "
            "decided, or an earlier version made it. Rate again."
        )
    return snapshot


def agreement_sheet(snapshot: Snapshot) -> Sheet:
    """Return one row a rater: by question, first on all votes, then by scenario type."""
    by_question = agreement_by_question(snapshot)
    facts = {
        "study": snapshot.study.name,
        "rating": str(snapshot.code),
        "simulated": snapshot.includes_simulated,
        "early": snapshot.is_early,
        "answers": {
            question: agreement_sentence(lines) for question, lines in by_question.items()
        },
        "method": METHOD,
    }
    lines = snapshot.results.agreement
    return make_sheet(lines, COLUMNS, name="agreement", key="raters", number=".4f", facts=facts)


def agreement_latex(snapshot: Snapshot) -> bytes:
    """Return a table a question, of the lines on all votes."""
    by_question = agreement_by_question(snapshot)
    return "\n".join(_latex(snapshot, name, lines) for name, lines in by_question.items()).encode()


def agreement_by_question(snapshot: Snapshot) -> dict[str, list[AgreementLine]]:
    """Return the lines of a rating by what was asked, the primary question first."""
    by_question: dict[str, list[AgreementLine]] = {}
    for line in snapshot.results.agreement:
        by_question.setdefault(line.question, []).append(line)
    return by_question


FORMATS = table_formats(agreement_sheet) | formats(latex=agreement_latex)


# --- Private -----------------------------------------------------------------------------------


def _latex(snapshot: Snapshot, question: str, lines: Sequence[AgreementLine]) -> str:
    whole = [line for line in lines if not line.type]
    caption = f"{Question(question).label} {_caption(whole)}"
    return latex_table(
        ([escape(line.rater), share_text(line.share), *map(str, _counts(line))] for line in whole),
        heads=("Rater", "Agrees (95 % CI)", "Votes", "Called equal", "No value"),
        comments=(f"{snapshot.study.name}, rating {snapshot.code}: {METHOD}",),
        caption=escape(caption + (f" ({', '.join(snapshot.marks)})" if snapshot.marks else "")),
        label=f"tab:agreement-{question}",
    )


def _counts(line: AgreementLine) -> tuple[object, ...]:
    return line.known, UNKNOWN if line.role is LineRole.COIN else line.ties, line.unknown


def _caption(lines: Sequence[AgreementLine]) -> str:
    """Return the caption: numbers of votes and clusters, experts' own agreement, a coin's."""
    experts, coin = (
        next(line for line in lines if line.role is role)
        for role in (LineRole.EXPERTS, LineRole.COIN)
    )
    return (
        "Share of decided votes on which a rater agrees with the expert, with 95 % confidence "
        f"intervals clustered by expert and scenario ({coin.decided} votes, {coin.experts} "
        f"experts, {coin.scenarios} scenarios). Experts with each other: "
        f"{share_text(experts.share)}, no ceiling, for they err as well; "
        f"floor: a coin, {share_text(coin.share)}."
    )
