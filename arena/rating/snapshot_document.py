"""Content of a snapshot beside its standings: typed values and their one codec.

The names of the fields are the keys of the stored JSON document; `since` marks those that came
with a later version of it. None and empty mean that the votes do not determine a value, that
nobody asked for it, or that the version which rated did not know it yet. Keys of statistics that
are no longer computed are passed over.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cache
from typing import Annotated, Any, TypeVar, cast

from pydantic import PlainValidator, TypeAdapter, ValidationError

from arena.rating.agreement import AgreementLine
from arena.rating.influence import Fragility
from arena.rating.lines import Line
from arena.rating.ranking import PairP
from arena.rating.reliability import Agreement, Rater, Repeats
from arena.rating.side import SideBias
from arena.rating.verdict import verdict
from augment.errors import InvalidDocument


def read_text(stored: Any) -> str:
    """Return a kept sentence; versions before kept its text and the values of its places apart.

    Raises:
        ValueError: It is neither.
    """
    if isinstance(stored, dict):
        values = {name: _join(value) for name, value in stored["values"].items()}
        return str(stored["text"] % values)
    if not isinstance(stored, str):
        raise ValueError(f"a sentence or plain text is allowed, not {stored!r}")
    return stored


def _join(value: Any) -> Any:
    """A value in words: names by commas, groups of names by semicolons."""
    if not isinstance(value, list):
        return value
    between = "; " if any(isinstance(part, list) for part in value) else ", "
    return between.join(", ".join(part) if isinstance(part, list) else part for part in value)


Kept = Annotated[str, PlainValidator(read_text)]


Value = TypeVar("Value")

VERSION = 5
"""4 drew other resamples of single votes from a seed; 3 had not yet what ratings once were
adjusted for; 2 is also without adjusted p-values and the measures that came with them; 1 also
without the order of the board and without notes in the lines of types; a rating of version 0 kept
its standings alone."""

_SINCE_2, _SINCE_3, _SINCE_5 = {"since": 2}, {"since": 3}, {"since": 5}
"""Of fields that documents of earlier versions do not have, unless they say something."""
_WHERE_SET = {"since": VERSION + 1}
"""Of fields that came without a version of their own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardRemarks:
    """Remarks of a rating beside its lines; contestants by slug.

    Attributes:
        reasons: Why ratings or intervals are missing; None where only the status says so.
        warnings: What else to keep in mind.
        tie_strength: v of Davidson's model.
        order: Slugs, best first.
        parts: Whose ratings compare: those with the same number.
        above: The pairs that differ with all of them judged at once, the higher one first; None
            where votes are clustered in ways that the intervals do not know of.
        p_values: Of pairs, adjusted for all of them; None as `above`.
        seems_above: As `above` where that is None, because it rests on few experts or scenarios.
        settled: How many ties of pairs that nobody was shown count for whom; none for those
            without, None in ratings that did not count them apart.
    """

    reasons: tuple[Kept, ...] | None = None
    warnings: tuple[Kept, ...] = ()
    tie_strength: float | None = None
    experts: int = 0
    scenarios: int = 0
    order: tuple[str, ...] = field(default=(), metadata=_SINCE_2)
    parts: dict[str, int] = field(default_factory=dict)
    above: tuple[tuple[str, str], ...] | None = None
    p_values: tuple[PairP, ...] | None = field(default=None, metadata=_SINCE_3)
    seems_above: tuple[tuple[str, str], ...] | None = field(default=None, metadata=_WHERE_SET)
    settled: dict[str, int] | None = field(default=None, metadata=_WHERE_SET)

    @property
    def settled_ties(self) -> int | None:
        """Number of such ties, each for two contestants; None if it was not counted."""
        return None if self.settled is None else sum(self.settled.values()) // 2

    def answer(self, lines: Sequence[Line], slugs: Sequence[str], votes: int) -> str:
        """Say in one sentence who is better than whom.

        Args:
            lines: Best first.
            slugs: Theirs.
            votes: How many were cast.
        """
        place = {slug: number for number, slug in enumerate(slugs)}
        above = self.seems_above if self.above is None else self.above
        apart = None if above is None else [(place[a], place[b]) for a, b in above]
        return verdict(lines, votes, apart, is_few=self.above is None)


@dataclass(frozen=True, slots=True, kw_only=True)
class PanelRater(Rater):
    """An expert with what the votes of all say of them.

    Attributes:
        judge: Their code; `name` is the pseudonym.
        moves: By how many places a contestant moves at most without their votes.
        repeats: How many hidden repeats they answered, and how many of them alike.
        checks: How many attention checks they answered, and how many for the reference.
        checks_skipped: How many they skipped, which is neither; ratings before version 5 counted
            these among the answered ones.
        aids: In how many of the counted votes they looked with what.
    """

    judge: str
    name: str
    moves: int | None
    repeats: tuple[int, int]
    checks: tuple[int, int]
    checks_skipped: int = field(default=0, metadata=_SINCE_5)
    aids: tuple[tuple[str, int], ...] = field(default=(), metadata=_SINCE_5)


@dataclass(frozen=True, slots=True, kw_only=True)
class StrengthCheck:
    """Effect of counting a slight preference as three quarters of a win.

    Attributes:
        slight, clear: How many votes say so.
        change: Elo points by which a Bradley-Terry rating moves at most; None where the votes do
            not determine ratings.
        order: Slugs, best first, where the order is another one.
    """

    slight: int
    clear: int
    change: float | None = None
    order: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Trust:
    """Statistics about the votes themselves.

    Attributes:
        tie_share: From 0 to 1, of the votes that were cast; earlier ratings counted settled ties.
        strength: None where no vote has one.
        fragility: Votes on which the first place hangs; None where none change it.
    """

    tie_share: float | None = None
    agreement: Agreement | None = None
    side: SideBias | None = None
    repeats: Repeats | None = None
    raters: tuple[PanelRater, ...] = ()
    strength: StrengthCheck | None = field(default=None, metadata=_SINCE_5)
    fragility: Fragility | None = field(default=None, metadata=_WHERE_SET)


@dataclass(frozen=True, slots=True, kw_only=True)
class PairRecord:
    """Wins, ties and losses of `a` against `b`, and how often they were to be judged.

    Attributes:
        settled: How many of the ties nobody was shown; None where they were not counted apart.
    """

    a: str
    b: str
    wins: int
    ties: int
    losses: int
    both_miss: int
    planned: int | None
    settled: int | None = field(default=None, metadata=_WHERE_SET)

    @property
    def votes(self) -> int:
        """All of them."""
        return self.wins + self.ties + self.losses


@dataclass(frozen=True, slots=True, kw_only=True)
class TypeStanding:
    """A contestant among the votes on one scenario type; `few` are too few to read much from.

    Attributes:
        settled: How many of the votes are ties that nobody was shown; None as of pairs.
    """

    slug: str
    rating: float | None
    lower: float | None
    upper: float | None
    rank: int | None
    note: Kept | None = field(default=None, metadata=_SINCE_2)
    votes: int
    few: bool
    settled: int | None = field(default=None, metadata=_WHERE_SET)


@dataclass(frozen=True, slots=True, kw_only=True)
class TypeRating:
    """The rating of one scenario type on its own.

    Attributes:
        label: The type's name as people read it.
        reasons: Why ratings are missing; None where only the status says so.
        settled: How many of the votes are ties that nobody was shown; None as of pairs.
    """

    type: str
    label: str
    votes: int
    scenarios: int
    status: str
    reasons: tuple[Kept, ...] | None = None
    lines: tuple[TypeStanding, ...]
    settled: int | None = field(default=None, metadata=_WHERE_SET)


@dataclass(frozen=True, slots=True, kw_only=True)
class DisplacementSummary:
    """Distance of a contestant's shown augmentations from the references, over `n` objects.

    Attributes:
        at_t0_m, final_m: Means of objects of changes that move, of which median and mean are
            over time; None without any.
        wish_median_m, wish_mean_m: Of the distances to the wish; None without an intent.
    """

    slug: str
    median_m: float | None
    mean_m: float | None
    n: int
    missing: int
    surplus: int
    augmentations: int
    at_t0_m: float | None = field(default=None, metadata=_SINCE_5)
    final_m: float | None = field(default=None, metadata=_SINCE_5)
    wish_median_m: float | None = field(default=None, metadata=_WHERE_SET)
    wish_mean_m: float | None = field(default=None, metadata=_WHERE_SET)


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioCost:
    """Average use of a contestant for one scenario; None is unknown."""

    slug: str
    model: str
    model_class: str
    augmentations: int
    calls: float
    tokens: float | None
    usd: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """All of it; without arguments what a rating of version 0 kept.

    Attributes:
        models: What models contestants ask, by slug.
        judges: Pseudonyms by code.
        agreement: How metrics agree with the decided votes; none for votes from a file.
    """

    version: int = 0
    board: BoardRemarks = field(default_factory=BoardRemarks)
    trust: Trust = field(default_factory=Trust)
    pairs: tuple[PairRecord, ...] = ()
    types: tuple[TypeRating, ...] = ()
    displacement: tuple[DisplacementSummary, ...] = ()
    cost: tuple[ScenarioCost, ...] = ()
    models: dict[str, str] = field(default_factory=dict)
    judges: dict[str, str] = field(default_factory=dict)
    agreement: tuple[AgreementLine, ...] = field(default=(), metadata=_SINCE_5)


def read_results(document: Mapping[str, Any]) -> Results:
    """The results of a stored document; an empty one is of version 0.

    Raises:
        InvalidDocument: It is of a later version, or not what its version says.
    """
    version = document.get("version", 0)
    if version not in range(VERSION + 1):
        allowed = f"a version from 0 to {VERSION}, not {version!r}"
        raise InvalidDocument("rating", [("version", allowed)])
    return read_document(Results, document, what="rating")


def read_document(shape: type[Value], document: Mapping[str, Any], *, what: str) -> Value:
    """Return the dataclass whose fields a JSON object has, by their names.

    Raises:
        InvalidDocument: It is none that this version knows.
    """
    try:
        return cast(Value, _make_adapter(cast(Any, shape)).validate_python(document))
    except ValidationError as error:
        faults = [(".".join(map(str, fault["loc"])), fault["msg"]) for fault in error.errors()]
        raise InvalidDocument(what, faults) from error


def results_document(results: Results) -> dict[str, Any]:
    """The document of results, with the keys that their version has."""
    if not results.version:
        return {}
    document: dict[str, Any] = _document(results, results.version)
    return document


@cache
def _make_adapter(shape: Any) -> TypeAdapter[Any]:
    return TypeAdapter(shape)


def _document(value: Any, version: int) -> Any:
    if is_dataclass(value):
        return {
            field.name: _document(part, version)
            for field in fields(value)
            # What is set stays, whatever the version.
            if (part := getattr(value, field.name)) != field.default
            or version >= field.metadata.get("since", 0)
        }
    if isinstance(value, dict):
        return {str(key): _document(part, version) for key, part in value.items()}
    return [_document(part, version) for part in value] if isinstance(value, tuple) else value
