"""Rules of made-up studies, and what must hold for every plan."""

from collections import Counter, defaultdict

from arena.pairing.order import CHECK, MAIN, REPEAT
from arena.pairing.plan import Check, Entry, MatchupPlan, PlannedMatchup, PlanRules

CONTESTANTS = (
    *("interplan", "gpt-4o-otm", "gemini-vqa", "gemini-tqa", "llama-tqa"),
    *("gemini-fc", "llama-fc", "gemini-otm", "llama-otm"),
)
"""Those of the paper's study of 5,760 votes by nine experts on 50 scenarios."""


def paper_rules(seed: int, *, votes: int = 640, experts: int = 9, **more: object) -> PlanRules:
    """A study of the paper's size, or one with other numbers and other rules."""
    scenarios = [f"scenario-{number:02}" for number in range(50)]
    given: dict[str, object] = {
        "repeat_share": 0.05,
        "check_share": 0.02,
        "checks": tuple(
            Check(scenario=scenario, good="reference", broken="attention-check")
            for scenario in scenarios
        ),
    }
    return PlanRules(
        entries=tuple(
            Entry(scenario=scenario, contestant=name, picture=f"{scenario} {name}")
            for scenario in scenarios
            for name in CONTESTANTS
        ),
        experts=tuple(f"expert-{number}" for number in range(1, experts + 1)),
        votes_per_expert=votes,
        seed=seed,
        **{**given, **more},  # type: ignore[arg-type]
    )


def by_expert(made: MatchupPlan) -> dict[str, list[PlannedMatchup]]:
    """Every expert's showings in order."""
    found: dict[str, list[PlannedMatchup]] = defaultdict(list)
    for matchup in made.matchups:
        found[matchup.expert].append(matchup)
    return found


def pair(matchup: PlannedMatchup) -> frozenset[str]:
    return frozenset((matchup.left, matchup.right))


def appearances(made: MatchupPlan) -> Counter[str]:
    """In how many main matchups each contestant is shown."""
    mains = [matchup for matchup in made.matchups if matchup.kind == MAIN]
    return Counter(name for matchup in mains for name in (matchup.left, matchup.right))


def smallest_gap(mine: list[PlannedMatchup]) -> int:
    """How many others lie at least between two showings of a scenario; many if none has two."""
    last: dict[str, int] = {}
    gaps = [10_000]
    for matchup in mine:
        if matchup.scenario in last:
            gaps.append(matchup.position - last[matchup.scenario] - 1)
        last[matchup.scenario] = matchup.position
    return min(gaps)


def smallest_distance(mine: list[PlannedMatchup]) -> int:
    """How many places at least lie between a pair and its repeat."""
    return min(
        (matchup.position - matchup.repeats for matchup in mine if matchup.repeats is not None),
        default=len(mine),
    )


def chi_square_of_sides(made: MatchupPlan) -> float:
    """Of the left share of every contestant against one half; about 1 a contestant by lot."""
    left: Counter[str] = Counter()
    shown: Counter[str] = Counter()
    for matchup in made.matchups:
        if matchup.kind != CHECK:
            left[matchup.left] += 1
            shown.update((matchup.left, matchup.right))
    return sum((left[name] - shown[name] / 2) ** 2 / (shown[name] / 4) for name in shown)


def check_extras(asked: PlanRules, made: MatchupPlan) -> None:
    """Positions, repeats, checks and sides of every expert are as the rules say."""
    for mine in by_expert(made).values():
        mains = [matchup for matchup in mine if matchup.kind == MAIN]
        repeats = [matchup for matchup in mine if matchup.kind == REPEAT]
        checks = [matchup for matchup in mine if matchup.kind == CHECK]
        assert [matchup.position for matchup in mine] == list(range(1, len(mine) + 1))
        assert len(mains) == asked.votes_per_expert
        assert len({(pair(matchup), matchup.scenario) for matchup in mains}) == len(mains)
        assert len(repeats) == round(asked.repeat_share * len(mains))
        assert len({matchup.repeats for matchup in repeats}) == len(repeats)
        for matchup in repeats:
            first = mine[(matchup.repeats or 0) - 1]
            assert first.kind == MAIN
            assert first.position < matchup.position
            shown = (first.scenario, first.left, first.right)
            assert shown == (matchup.scenario, matchup.right, matchup.left)
        wanted = round(asked.check_share * len(mains))
        assert len(checks) == min(wanted, len(asked.checks))
        assert len({matchup.scenario for matchup in checks}) == len(checks)
        broken = Counter(matchup.left == "attention-check" for matchup in checks)
        assert abs(broken[True] - broken[False]) <= 1
        first_left = Counter(pair(m) for m in mains if m.left == min(m.left, m.right))
        times = Counter(pair(matchup) for matchup in mains)
        assert all(abs(2 * first_left[key] - times[key]) <= 1 for key in times)
        assert smallest_gap(mine) >= made.scenario_gap
