import json
import math
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
from itertools import dropwhile

import pytest
from jsonschema import Draft202012Validator

from augment.errors import ReplyUnreadable
from augment.metrics.displacement import displacement
from augment.prompts.reply import (
    block_schema,
    read_judge,
    read_questions,
    read_ratings,
    read_reply,
    read_sight,
    read_verdict,
)
from augment.prompts.vectors import short_names, with_short_ids
from augment.scene.entities import TrafficAgent
from augment.scene.planned_motion import PlannedMotion
from tests.fixtures.shelf import HARD_SLUGS, MOVING_SLUGS, SLUGS, entry, shown_scene
from tests.scenes import scene, vehicle
from tests.variants.playing import GOOD, agent, block, rating

NUMBERS = ("x_m", "y_m", "heading_rad", "width_m", "length_m", "speed_mps")
PARKED = vehicle("Agent2", 21.4, 0.9, lane_id="Lane1")
BUSY = scene(agents=(vehicle("Agent7", 40.0, 0.0),))


def problems(text: str) -> list[str]:
    with pytest.raises(ReplyUnreadable) as raised:
        read_reply(text, BUSY)
    return raised.value.problems


def test_an_answer_in_five_sections_is_read() -> None:
    read = read_reply(GOOD, scene())
    assert read.modification.added == (PARKED,)
    assert not read.mended


def test_a_refusal_is_read_with_none_in_its_sections_and_keeps_its_reason() -> None:
    refusal = (
        "Insights: There is no bus stop in this scene.\n\nSummary: none\n\n"
        f"Modification Dict: none\n\nModification Calculations: none\n\n"
        f"Modified Vectors:\n{block()}"
    )
    read = read_reply(refusal, scene())
    assert read.modification.is_empty
    assert read.notes == "There is no bus stop in this scene.\n\nnone"


def test_a_heading_is_wrapped() -> None:
    (added,) = read_reply(block(agent(heading_rad=4.0)), scene()).modification.added
    assert added.heading_rad == pytest.approx(4.0 - 2.0 * math.pi)


DRAFT = block(agent(x_m=3.0))


def along(*lane_ids: str) -> dict[str, object]:
    return {"kind": "lanes", "lane_ids": lane_ids}


def at(name: str) -> dict[str, object]:
    return {"kind": "place", "agent_id": name, "x_m": 1.0, "y_m": 2.0}


def test_the_last_block_with_the_keys_counts() -> None:
    for text in (
        block(agent()),
        f"```\n{block(agent())}\n```",
        f"```JSON\r\n{block(agent())}\r\n```",
        f"Draft:\n```json\n{DRAFT}\n```\nFinal:\n```json\n{block(agent())}\n```\nDone.",
        f"<think>```json\n{DRAFT}\n```</think>{GOOD}",
        f"{DRAFT}\nor rather {block(agent())} as {{asked}}",
        GOOD + '\n```json\n{"note": "no more"}\n```',
        GOOD + "\n```text\nnothing\n```",
        f"  ```json\n{block(agent())}\n  ```",
        f"```json\n{block(agent())}",
        f"```markdown\nSummary: x\n```json\n{block(agent())}\n```\n```",
        f'```markdown\nThe "add": one car\n```json\n{block(agent())}\n```\n```',
        f"<THINK>```json\n{DRAFT}\n```</THINK >{GOOD}",
        f'```json\n{{"remove": []}}\n```\n```json\n{{"add": [{json.dumps(agent())}]}}\n```',
        GOOD + '\n```json\n{"Action": "add"}\n```',
        f"```python\nx = 19.0 + 2.4\n```\nModified Vectors:\n```json {block(agent())} ```",
    ):
        assert read_reply(text, scene()).modification.added == (PARKED,)


@pytest.mark.parametrize(
    "text",
    [
        GOOD.replace('"lane": "Lane1"}', '"lane": "Lane1",}'),
        GOOD.replace("]}", "] , }"),
        GOOD.replace('"move": [],', '"move": [], // nothing "moves": 1\n'),
        GOOD.replace('"move": []', '/* none, */ "move": []'),
        GOOD.replace('"remove": []', '"remove": [], // the end\n'),
        GOOD.replace('"move": []', '# "move": 1\n"move": []'),
        GOOD.replace('"move": []', '"move": null').replace('"remove": []', '"remove": null'),
    ],
)
def test_comments_and_trailing_commas_are_mended(text: str) -> None:
    read = read_reply(text, scene())
    assert read.modification.added == (PARKED,)
    assert read.mended


def test_mending_leaves_strings_alone() -> None:
    street = scene()
    odd = replace(street.lanes[0], id="a//b,}")
    with pytest.raises(ReplyUnreadable, match="none of the scene's"):
        read_reply(block(agent(lane="a//b,}")) + ",", replace(street, lanes=(odd,)))


def test_what_can_not_be_read_is_refused_with_its_reason() -> None:
    for text, problem in (
        ("I would put it 21.4 m ahead.", "no fenced JSON block"),
        (GOOD[:-30], "the JSON block breaks"),
        (GOOD.replace("21.4", "19.0 + 2.4"), "the JSON block breaks"),
        (GOOD.replace('"x_m": 21.4', '"x_m": 21,4'), "the JSON block breaks"),
        (GOOD.replace('"x_m": 21.4', '"x_m": NaN'), "NaN is not a number"),
        (GOOD.replace('"x_m": 21.4', '"x_m": 1e999'), "add.0.x_m: Input should be a finite"),
        (GOOD.replace('"x_m": 21.4', '"x_m": ' + "9" * 5000), "too many digits"),
        (GOOD.replace('"x_m": 21.4', '"x_m": "21.4"'), "add.0.x_m: Input should be a valid"),
        (GOOD.replace('"x_m": 21.4', '"x_m": true'), "add.0.x_m: Input should be a valid"),
        (GOOD.replace('"y_m": 0.9', '"x_m": 0.9'), "'x_m' stands twice"),
        (block(agent(x_m=...)), "add.0.x_m: Field required"),
        (block(agent(colour="red")), "add.0.colour: Extra inputs are not permitted"),
        (block(agent(type="EGO_VEHICLE")), "add.0.type: Input should be one of VEHICLE, BUS,"),
        (block(agent(type=["BUS"])), "add.0.type: Input should be one of VEHICLE, BUS,"),
        (GOOD + '\n```json\n{"remove": ["Agent7"]}\n```', "there are several blocks"),
        (GOOD.replace('"', "'"), "is not JSON: keys and texts stand in double quotes"),
        ("```js\n{add: [], move: [], remove: []}\n```", "keys and texts stand in double quotes"),
        (block(agent(speed_mps=-1.0)), "add.0.speed_mps: Input should be greater than"),
        (block(agent(lane="Lane9")), "Agent2: its lane is none of the scene's"),
        (block(agent(walk_to=[1.0, 2.0])), "Agent2: only a PEDESTRIAN has walk_to"),
        (block(agent(type="PEDESTRIAN", walk_to=[1.0])), "add.0.walk_to"),
        (block(agent(), agent()), "named more than once: Agent2"),
        (block(agent(), unchanged="No bus stop."), "unchanged: a block that changes something"),
        (block(agent(id="Agent7")), "Agent7 is in the scene already"),
        (block(agent(id="Agent1")), "Agent1 is in the scene already"),
        (block(agent(id="Agent 2; drop")), "add.0.id: String should match"),
        (block(remove=["Agent9"]), "Agent9 is not in the scene; its agents: Agent7"),
        (block(remove=["Agent1"]), "Agent1 is the ego"),
        (block(*[agent(id=f"Agent{n}") for n in range(8, 73)]), "add: List should have at most"),
        ('{"add": ' + "[" * 100_000, "nested too deeply"),
        ('{"add": "' + "x" * 200_000 + '"}', "longer than 200000 characters"),
    ):
        assert problem in "\n".join(problems(text))


def test_a_broken_final_block_is_not_replaced_by_an_earlier_draft() -> None:
    final = block(agent()).replace("21.4", "19.0 + 2.4")
    assert "breaks" in problems(f"```json\n{DRAFT}\n```\n```json\n{final}\n```")[0]


def test_odd_ids_of_a_scene_are_known_by_their_short_forms() -> None:
    odd = scene(agents=(vehicle("truck <7>", 40.0, 0.0, lane_id="Lane1"),))
    assert read_reply(block(remove=["Agent2"]), odd).modification.removed == ("truck <7>",)
    with pytest.raises(ReplyUnreadable, match="its agents: Agent2") as raised:
        read_reply(block(remove=["Agent5"]), odd)
    assert "truck" not in str(raised.value)


@pytest.mark.parametrize("axis", [0, 1], ids=["x", "y"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("value_m", "is_read"), [(79.99, True), (80.0, True), (80.01, False), (400.0, False)]
)
@pytest.mark.parametrize("what", ["place", "walk", "moved walk"])
def test_neither_a_place_nor_the_end_of_a_walk_lies_beyond_the_radius(
    axis: int, sign: float, value_m: float, is_read: bool, what: str
) -> None:
    point = [3.0, 3.0]
    point[axis] = sign * value_m
    text = {
        "place": block(agent(x_m=point[0], y_m=point[1])),
        "walk": block(agent(type="PEDESTRIAN", walk_to=point)),
        "moved walk": block(move=[agent(id="Agent7", type="PEDESTRIAN", walk_to=point)]),
    }[what]
    if is_read:
        (made,) = read_reply(text, BUSY).modification.changed
        assert (made.walk_to_m or (made.x_m, made.y_m)) == tuple(point)
    else:
        assert "x and y must lie between -80 and 80" in problems(text)[0]


@pytest.mark.parametrize(
    ("value_m", "is_read"), [(0.09, False), (0.1, True), (20.0, True), (20.01, False)]
)
@pytest.mark.parametrize("key", ["width_m", "length_m"])
def test_a_size_is_between_a_door_and_a_long_bus(key: str, value_m: float, is_read: bool) -> None:
    text = block(agent(**{key: value_m}))
    if is_read:
        (added,) = read_reply(text, scene()).modification.added
        assert getattr(added, key) == value_m
    else:
        assert f"add.0.{key}: Input should be" in problems(text)[0]


def test_a_new_agent_takes_no_id_that_the_scene_uses_under_another_name() -> None:
    """The prompt calls it Agent2; in the scene it would stand there twice."""
    street = scene(agents=(vehicle("parked-7", 40.0, 0.0),))
    with pytest.raises(ReplyUnreadable) as raised:
        read_reply(block(agent(id="parked-7")), street)
    assert raised.value.problems == ["an added agent's id is taken: number them from Agent3"]
    (added,) = read_reply(block(agent(id="Agent3")), street).modification.added
    assert added.id == "Agent3"


@pytest.mark.parametrize(
    ("motion", "problem"),
    [
        (3, "add.0.motion: Input should be an object"),
        ({"colour": 1}, "add.0.motion.colour: Unexpected keyword argument"),
        ({"start": {"within_m": 3}}, "add.0.motion.start: Unable to extract tag using disc"),
        ({"start": {"kind": "hush" * 99}},
         "add.0.motion.start.kind: Input should be 'time', 'ego_distance', 'place'"),
        ({"start": {"kind": "time", "after_s": -1}}, "start.time.after_s: Input should be great"),
        ({"start": at("Agent9")}, "Agent2: it waits for Agent9, who is none of Agent1, Agent7"),
        ({"speeds": [["2", 0]]}, "add.0.motion.speeds.0.0: Input should be a valid number"),
        ({"speeds": {}}, "add.0.motion.speeds: Input should be a valid list"),
        ({"speeds": [[2, 0], [1, 0]]}, "add.0.motion: speeds: 1 s does not follow 2 s"),
        ({"path": along()}, "path.lanes.lane_ids: List should have at least 1 item"),
        ({"path": along("Lane9")}, "Agent2: Lane9 is no lane of the scene; its lanes: Lane1, Lan"),
        ({"path": along("Lane1", "Lane2")}, "Lane2 neither follows Lane1 nor runs beside it"),
        ({"path": {"kind": "points", "points_m": [[160, 0], [160.01, 0]]}},
         "Agent2: points_m must lie between -160 and 160"),
    ],
)  # fmt: skip
def test_an_unreadable_motion_is_refused_with_its_reason(motion: object, problem: str) -> None:
    (said,) = problems(block(agent(motion=motion)))
    assert problem in said
    assert "hush" not in said


def test_nobody_has_a_walk_and_a_motion() -> None:
    both = agent(type="PEDESTRIAN", walk_to=[1.0, 2.0], motion={"speeds": [[0, 2]]})
    assert problems(block(both)) == ["Agent2: it has walk_to or a motion, not both"]


def test_null_is_absent_in_motions_and_empty_in_reviews() -> None:
    text = block(agent(motion={"start": None, "path": None, "speeds": None}))
    assert read_reply(text, scene()).modification.added[0].motion == PlannedMotion()
    assert read_verdict('{"verdict": "accept", "feedback": null}').feedback == []


READERS: list[Callable[[str], object]] = [
    partial(read_ratings, accepted_from=4.0),
    read_questions,
    read_verdict,
    partial(read_sight, count=4),
]


def test_sections_are_kept_and_the_block_counts() -> None:
    text = "Summary: A road.\n\n**Questions:**\n1. Where?\n\nAnswers:\n1. There.\n\nRatings: 5\n\n"
    review = read_ratings(text + "Review:\n" + rating(5, 5, 4), accepted_from=4.0)
    said = (review.summary, review.questions, review.answers)
    assert said == ("A road.", "1. Where?", "1. There.")
    assert review.ratings.mean == pytest.approx(14 / 3)


def test_a_viewers_lines_are_read_by_their_numbers() -> None:
    for said, read in (
        ("1. In Lane1.\n2. cannot see", {1: "In Lane1.", 2: "cannot see"}),
        ("**1.** Lane1\n 2) no\n3: yes", {1: "Lane1", 2: "no", 3: "yes"}),
        ("1. first\n1. second\n9. far", {1: "first"}),
        ("<think>1. wrong</think>\n1. right", {1: "right"}),
        ("1. In which lane?\n   - Lane1\n2\\. no", {1: "In which lane? - Lane1", 2: "no"}),
        ("(1) yes, at\n1.5 m\n2.\nno", {1: "yes, at 1.5 m", 2: "no"}),
    ):
        assert read_sight(said, 3) == read


def test_a_judges_word_is_understood_in_other_spellings_and_guessed_in_none() -> None:
    for said, better in (
        *(("A", "A"), ("b ", "B"), ("Picture A", "A"), ("picture B.", "B"), ("Equal", "equal")),
        *((word, None) for word in ("left", "A or B", "", 1, None, ["A"])),
    ):
        text = json.dumps({"better": said, "reason": "x" * 3000, "confidence": 0.8})
        if better:
            assert read_judge(text).better == better
        else:
            with pytest.raises(ReplyUnreadable, match="better: Input should be"):
                read_judge(text)


@pytest.mark.parametrize("reader", READERS)
def test_a_good_answer_of_another_kind_is_none(reader: Callable[[str], object]) -> None:
    with pytest.raises(ReplyUnreadable):
        reader(json.dumps({"add": [], "move": [], "remove": []}))


@pytest.mark.parametrize("slug", [*SLUGS[::10], *HARD_SLUGS[::10], *MOVING_SLUGS[::3]])
def test_references_can_be_written_by_the_schema(slug: str) -> None:
    shown, wanted = shown_scene(slug), entry(slug).reference
    names = short_names(shown)
    short = with_short_ids(wanted, names)

    def fields(one: TrafficAgent, *, is_new: bool) -> dict[str, object]:
        written = {name: getattr(one, name) for name in NUMBERS}
        written |= {"type": one.type.value, "lane": one.lane_id}
        if one.walk_to_m is not None:
            written["walk_to"] = list(one.walk_to_m)
        else:
            written["motion"] = asdict(one.motion) if one.motion else None
        return written if is_new else {"id": one.id} | written

    document = {
        "add": [fields(one, is_new=True) for one in short.added],
        "move": [fields(one, is_new=False) for one in short.moved],
        "remove": list(short.removed),
    }
    schema = block_schema(shown, radius_m=80.0)
    Draft202012Validator.check_schema(schema)
    usable = [*document][: 3 if shown.agents else 1]
    filled = dropwhile(lambda name: not document[name], usable)
    change = {name: document[name] for name in filled} or {"unchanged": "It can't."}
    written = json.loads(json.dumps({"block": change}))
    keeps_to = Draft202012Validator(schema).is_valid
    assert keeps_to(written)
    assert not keeps_to({"block": {name: [] for name in usable}})
    # The draft among the sections does not count.
    sections = f"Insights: It can.\n\nModified Vectors:\n```json\n{block(agent())}\n```"
    read = read_reply(json.dumps(written), shown, sections=sections)
    assert displacement(read.modification, wanted).missing == ()


def test_a_block_by_schema_that_changes_nothing_says_why() -> None:
    why = {"block": {"unchanged": "There is no bus stop."}}
    assert Draft202012Validator(block_schema(scene(), radius_m=80.0)).is_valid(why)
    read = read_reply(json.dumps(why), scene(), sections="It can't.")
    assert (read.is_refusal, read.notes) == (True, "There is no bus stop.")
    with pytest.raises(ReplyUnreadable):
        read_reply(json.dumps(why | {"add": [agent()]}), scene(), sections="It can't.")


def test_the_same_change_said_twice_counts_once() -> None:
    moved = agent(id="Agent7", x_m=38.0)
    read = read_reply(block(move=[moved, moved], remove=[]), BUSY)
    assert [one.x_m for one in read.modification.moved] == [38.0]
