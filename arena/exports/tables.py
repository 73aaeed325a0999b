"""A snapshot as a table: what every writer, chart and page shows of it."""

from __future__ import annotations

from dataclasses import dataclass

from django.db.models import F

from arena.models import Snapshot, Standing

METHODS = {"bt": "Bradley-Terry on the Elo scale", "elo": "online Elo, median over resamples"}
UNITS = {
    "vote": "votes",
    "scenario": "scenarios",
    "expert": "experts",
    "two-way": "experts and scenarios",
}
UNKNOWN = "--"
SIMULATED = " (simulated)"


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One contestant's line.

    Attributes:
        model: The name people know, with "(simulated)" where that is so.
        variant: The recipe's name as it ends the model's name, empty without.
        rank, elo, lower, upper: None where the votes do not determine them.
    """

    model: str
    variant: str
    slug: str
    kind: str
    simulated: bool
    rank: int | None
    elo: float | None
    lower: float | None
    upper: float | None
    votes: int
    wins: int
    ties: int
    losses: int
    note: str

    @property
    def name(self) -> str:
        """The name alone, for pages that mark what is simulated by a badge."""
        return self.model.removesuffix(SIMULATED)

    @property
    def rank_text(self) -> str:
        """The rank, or two hyphens without one."""
        return UNKNOWN if self.rank is None else str(self.rank)

    @property
    def elo_text(self) -> str:
        """The rating as a whole number."""
        return UNKNOWN if self.elo is None else str(round(self.elo))

    @property
    def interval_text(self) -> str:
        """The interval as the paper prints it: -9/+11 around the printed rating."""
        if self.elo is None or self.lower is None or self.upper is None:
            return UNKNOWN
        elo = round(self.elo)
        return f"-{elo - round(self.lower)}/+{round(self.upper) - elo}"


@dataclass(frozen=True, slots=True, kw_only=True)
class LeaderboardTable:
    """A snapshot's lines in order, and all that must be said with them.

    Attributes:
        status: Why ratings or intervals are missing, empty if none is.
        early: The study was still open.
        left_out: Votes that do not count, by reason.
    """

    study: str
    rows: tuple[Row, ...]
    method: str
    rounds: int
    unit: str
    seed: int
    degenerate_rounds: int
    votes: int
    left_out: dict[str, int]
    votes_sha256: str
    status: str
    simulated: bool
    early: bool

    @property
    def method_text(self) -> str:
        """How the numbers came about, in one line."""
        return (
            f"{METHODS[self.method]}, 95 % intervals by {self.rounds} resamples of "
            f"{UNITS[self.unit]}, seed {self.seed}"
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences that no reader may miss."""
        said = []
        if self.simulated:
            said.append("Simulated: votes or contestants of this table are made by the machine.")
        if self.early:
            said.append("Early look: the study was still open.")
        if self.status:
            said.append(self.status)
        if self.degenerate_rounds:
            said.append(
                f"{self.degenerate_rounds} of {self.rounds} resamples determined no ratings and "
                "are left out of the intervals."
            )
        return tuple(said)


def leaderboard_table(snapshot: Snapshot) -> LeaderboardTable:
    """The table of a snapshot, best first; two queries."""
    standings = snapshot.standings.select_related("contestant").order_by(
        F("rating").desc(nulls_last=True), "contestant__slug"
    )
    return LeaderboardTable(
        study=snapshot.study.name,
        rows=tuple(_row(standing) for standing in standings),
        method=snapshot.method,
        rounds=snapshot.rounds,
        unit=snapshot.resampling_unit,
        seed=snapshot.seed,
        degenerate_rounds=snapshot.degenerate_rounds,
        votes=snapshot.votes_counted,
        left_out=dict(sorted(snapshot.votes_left_out.items())),
        votes_sha256=snapshot.votes_sha256,
        status=snapshot.status,
        simulated=snapshot.includes_simulated,
        early=snapshot.is_early,
    )


def _row(standing: Standing) -> Row:
    contestant = standing.contestant
    name, variant = contestant.name, contestant.variant
    last_word = name.rpartition(" ")[2]
    return Row(
        model=f"{name}{SIMULATED}" if contestant.is_simulated else name,
        variant=last_word if variant and last_word.lower() == variant.lower() else "",
        slug=contestant.slug,
        kind=contestant.kind,
        simulated=contestant.is_simulated,
        rank=standing.rank,
        elo=standing.rating,
        lower=standing.lower,
        upper=standing.upper,
        votes=standing.votes,
        wins=standing.wins,
        ties=standing.ties,
        losses=standing.losses,
        note=standing.note,
    )
