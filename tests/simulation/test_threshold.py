"""Where a planner fails along a sweep, and the hardest value that somebody else solves."""

from augment.simulation.threshold import Trial, TriedValue, find_edges, find_hardest, is_lawful


def tried(value: float, tested: str, **others: float) -> TriedValue:
    """A value: "+" where the planner passes, "-" where it fails, "" undriven; others' scores."""
    own = [
        Trial(driver="own", score=0.9 * (tested == "+"), is_lawful=tested == "+", is_tested=True)
    ]
    helped = [
        Trial(driver=name, score=score, is_lawful=score > 0.0) for name, score in others.items()
    ]
    return TriedValue(value=value, trials=tuple((own if tested else []) + helped))


def test_edges_lie_where_the_outcome_changes() -> None:
    for outcomes, edges in (
        *(("--++", ((3.0, 2.0),)), ("++--", ((2.0, 3.0),)), ("+-+", ((1.0, 2.0), (3.0, 2.0)))),
        *(("++", ()), ("--", ()), ("", ())),
    ):
        values = [tried(float(n), outcome) for n, outcome in enumerate(outcomes, start=1)]
        assert find_edges(values) == edges
        assert find_edges(values[::-1]) == edges, "whatever their order"


def test_what_was_not_driven_is_no_edge() -> None:
    assert find_edges([tried(1.0, "-"), tried(2.0, ""), tried(3.0, "+")]) == ((3.0, 1.0),)


def test_the_hardest_is_failed_by_the_planner_and_solved_with_the_least_score() -> None:
    values = [
        tried(1.0, "-", idm=0.0, pdm=0.0),  # nobody solves it
        tried(2.0, "-", idm=0.0, pdm=0.6),
        tried(3.0, "-", idm=0.9, pdm=0.3),  # the best of several lawful drives counts
        tried(4.0, "+", idm=0.1),  # the planner passes it
        tried(5.0, "", idm=0.2),  # the planner has not driven it
    ]
    hardest = find_hardest(values)
    assert hardest.value == 2.0
    assert find_hardest([values[0], *values[3:]]) is None


def test_of_equally_hard_ones_the_furthest_from_what_the_planner_passes_is_kept() -> None:
    hardest = find_hardest([tried(1.0, "+"), tried(2.0, "-", pdm=0.5), tried(3.0, "-", pdm=0.5)])
    assert hardest.value == 3.0


def test_a_lawful_drive_hits_nobody_stays_on_the_road_and_gets_on() -> None:
    parts = ("no_ego_at_fault_collisions", "drivable_area_compliance", "ego_is_making_progress")
    for changed, lawful in (
        ({}, True),
        ({"driving_direction_compliance": 0.5}, True),
        ({"no_ego_at_fault_collisions": 0.5}, False),
        ({"drivable_area_compliance": 0.0}, False),
        ({"ego_is_making_progress": 0.0}, False),
    ):
        assert is_lawful(dict.fromkeys(parts, 1.0) | changed) is lawful
