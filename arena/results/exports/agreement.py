"""Which metric agrees with experts, as a table in files."""

from collections.abc import Sequence

from arena.exports.formats import (
    NUMBER,
    TEXT,
    WHOLE,
    Columns,
    Sheet,
    formats,
    sheet_of,
    table_formats,
)
from arena.models import Snapshot
from arena.rating.agreement import AgreementLine, Role, agreement_sentence, share_text
from arena.rating.lines import UNKNOWN, escape, latex_table
from augment.errors import Conflict

METHOD = (
    "a decided vote names a better side; a rater that calls both equal agrees by half; votes on "
    "pairs of which it knows nothing are left out of its share; intervals are clustered by expert "
    "and scenario"
)
_COUNTS = ("decided", "agrees", "ties", "differs", "unknown", "experts", "scenarios")
COLUMNS: Columns = {
    **{name: (name, TEXT) for name in ("rater", "role", "type")},
    **{
        name: (f"share.{part}", NUMBER)
        for name, part in (("share", "value"), ("lower", "lower"), ("upper", "upper"))
    },
    **{name: (name, WHOLE) for name in _COUNTS},
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
    """Return one row a rater, first on all votes, then by scenario type."""
    facts = {
        "study": snapshot.study.name,
        "rating": str(snapshot.code),
        "simulated": snapshot.includes_simulated,
        "early": snapshot.is_early,
        "answer": agreement_sentence(snapshot.results.agreement),
        "method": METHOD,
    }
    lines = snapshot.results.agreement
    return sheet_of(lines, COLUMNS, name="agreement", key="raters", number=".4f", facts=facts)


def agreement_latex(snapshot: Snapshot) -> bytes:
    """Return the lines on all votes."""
    lines = [line for line in snapshot.results.agreement if not line.type]
    marks = {"simulated": snapshot.includes_simulated, "early": snapshot.is_early}
    words = [word for word, holds in marks.items() if holds]
    caption = _caption(lines) + (f" ({', '.join(words)})" if words else "")
    text = latex_table(
        ([escape(line.rater), share_text(line.share), *map(str, _counts(line))] for line in lines),
        heads=("Rater", "Agrees (95% CI)", "Votes", "Called equal", "No value"),
        comments=(f"{snapshot.study.name}, rating {snapshot.code}: {METHOD}",),
        caption=caption,
        label="tab:agreement",
    )
    return text.encode()


FORMATS = table_formats(agreement_sheet) | formats(latex=agreement_latex)


# --- Private -----------------------------------------------------------------------------------


def _counts(line: AgreementLine) -> tuple[object, ...]:
    ties = UNKNOWN if line.role is Role.COIN else line.ties
    return line.known, ties, line.unknown


def _caption(lines: Sequence[AgreementLine]) -> str:
    """What is shown as TeX, on how many votes and clusters, beside ceiling and floor."""
    experts, coin = (
        next(line for line in lines if line.role is role) for role in (Role.EXPERTS, Role.COIN)
    )
    said = (
        "Agreement with the experts: share of decided votes with 95 % confidence intervals "
        f"clustered by expert and scenario ({coin.decided} votes of {coin.experts} experts on "
        f"{coin.scenarios} scenarios). Ceiling: experts with each other "
        f"{share_text(experts.share)}; floor: a coin {share_text(coin.share)}."
    )
    return escape(said)
