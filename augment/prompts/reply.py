"""From what models answer to a Modification, ratings, questions, verdicts, decisions or an intent.

In: the text of an answer, and the `Scene` that it is about. Out: typed values, or
`ReplyUnreadable`, whose sentences can go back to the model; nothing else is ever raised.

Frame: ego frame of the scene.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BeforeValidator, ConfigDict, Field

from augment.errors import InvalidDocument, InvalidModification, ReplyUnreadable
from augment.geometry.frames import wrap
from augment.prompts import vectors
from augment.prompts.blocks import (
    LONGEST_ANSWER,
    Strict,
    last_object,
    refuses,
    validate,
    without_nulls,
    without_thoughts,
)
from augment.prompts.extent import find_spans
from augment.scene.codec import intent_from_parts
from augment.scene.density import fit_boxes
from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent
from augment.scene.intent import Intent
from augment.scene.planned_motion import EGO_ID, PlannedMotion, PointPath
from augment.scene.planned_mover import check_motions

MOST_AGENTS = 64
# A small model fills each list of a block by schema until it is cut off.
_MOST_ADDED, _MOST_MOVED, _MOST_LANES, _MOST_SPEEDS = 10, 4, 8, 6
LONGEST_NOTES = 4000
NOTHING_TO_PLACE = "it asks for nothing that can be placed"
FEWEST_QUESTIONS, MOST_QUESTIONS = 3, 8
LONGEST_ENTRY = 1000
MOST_FEEDBACK = 20
_MOST_PROBLEMS = 8
_HEADS = "Insights|Summary|Modification Dict|Modification Calculations|Modified Vectors"

_LISTS = frozenset({"add", "move", "remove"})
_ASKED = frozenset({"requests", "moves", "removals", "purpose"})
_BY_SCHEMA = _LISTS | {"block", "unchanged"}
_TYPES = tuple(kind for kind in AgentType if kind is not AgentType.EGO_VEHICLE)


def _insist_on_object(kind: object) -> object:
    """Return the type of an object that may be placed; the ego is none.

    Raises:
        ValueError: It is another; the sentence lists those that may.
    """
    if kind not in _TYPES:
        raise ValueError(f"Input should be one of {', '.join(_TYPES)}")
    return kind


_Schema = dict[str, Any]
_NULL: _Schema = {"type": "null"}
_Item = TypeVar("_Item")
_Id = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]{0,31}$")]
_Size = Annotated[float, Field(ge=0.1, le=20.0)]
_OR_NONE = BeforeValidator(lambda items: [] if items is None else items)
_Several = Annotated[list[_Item], Field(max_length=MOST_AGENTS), _OR_NONE]
_Words = Annotated[str, Field(min_length=1, max_length=LONGEST_ENTRY)]
_Rating = Annotated[int, Field(ge=1, le=5)]


class _Agent(Strict):
    id: _Id
    type: Annotated[AgentType, Field(strict=False), BeforeValidator(_insist_on_object)]
    x_m: float
    y_m: float
    heading_rad: float = Field(ge=-2.0 * math.pi, le=2.0 * math.pi)
    width_m: _Size
    length_m: _Size
    speed_mps: float = Field(ge=0.0, le=60.0)
    lane: str | None
    walk_to: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None
    motion: Annotated[PlannedMotion | None, BeforeValidator(without_nulls)] = None

    @property
    def path_m(self) -> tuple[tuple[float, float], ...]:
        """The points that its motion leads over."""
        path = None if self.motion is None else self.motion.path
        return path.points_m if isinstance(path, PointPath) else ()


class _Block(Strict):
    add: _Several[_Agent] = []
    move: _Several[_Agent] = []
    remove: _Several[_Id] = []
    unchanged: _Words | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadReply:
    """A modifier's answer that was understood.

    Attributes:
        notes: The answer's own Insights and Summary.
        mended: Whether its JSON had comments, trailing commas, or null for a list.
        is_refusal: Whether it changes nothing and names no action either; an answer to a
            follow-up may take back all that was placed.
    """

    modification: Modification
    notes: str
    mended: bool = False
    is_refusal: bool = False


class Correction(Strict):
    """One problem, the reason behind it, and what to do about it."""

    problem: _Words
    reason: _Words
    corrective_action: _Words

    @property
    def sentence(self) -> str:
        """The three on one line."""
        words = f"{self.problem} Reason: {self.reason} Corrective action: {self.corrective_action}"
        return " ".join(words.split())


class Ratings(Strict):
    """From 1, wrong throughout, to 5, nothing to improve."""

    compliance: _Rating
    realism: _Rating
    logical_consistency: _Rating

    @property
    def mean(self) -> float:
        """Computed here, never by the model."""
        return (self.compliance + self.realism + self.logical_consistency) / 3.0


_Feedback = Annotated[list[Correction], Field(max_length=MOST_FEEDBACK), _OR_NONE]
_Remarks = Annotated[list[_Words], Field(max_length=MOST_FEEDBACK), _OR_NONE]


class RatedReview(Strict):
    """Review of a modification by the text reviewer.

    Remarks are too small to be corrected: for the record, nobody is told. So are the reviewer's
    own words, empty where he left them out.
    """

    ratings: Ratings
    feedback: _Feedback
    remarks: _Remarks = []
    summary: str = ""
    questions: str = ""
    answers: str = ""


class _QuestionBlock(Strict):
    questions: Annotated[
        list[_Words], Field(min_length=FEWEST_QUESTIONS, max_length=MOST_QUESTIONS)
    ]


class EngineerVerdict(Strict):
    """Decision of the engineer: with feedback it is not accepted; remarks change nothing."""

    verdict: Literal["accept", "feedback"]
    feedback: _Feedback
    remarks: _Remarks = []


def _read_choice(word: object) -> object:
    """Return a judge's word as it was asked for, also of "Picture A" or "Equal"."""
    plain = word.strip(" .").lower().removeprefix("picture ") if isinstance(word, str) else word
    return {"a": "A", "b": "B"}.get(plain, plain) if isinstance(plain, str) else plain


class JudgeAnswer(Strict):
    """Picture that a judge found better, and the reason; nobody asks again for a better form."""

    model_config = ConfigDict(extra="ignore")

    better: Annotated[Literal["A", "B", "equal"], BeforeValidator(_read_choice)]
    reason: str | None = None


def read_reply(
    answer: str, scene: Scene, *, radius_m: float = vectors.DEFAULT_RADIUS_M, sections: str = ""
) -> ReadReply:
    """Return the modification that the answer asks for, an empty one of a refusal.

    Args:
        answer: The raw text of the model.
        scene: The scene it was asked about.
        radius_m: No object may lie further than this ahead, behind or to a side.
        sections: What the model wrote before, where the answer is a block by `block_schema`.

    Raises:
        ReplyUnreadable: Whatever is wrong with the answer.
    """
    # A block by schema stands for the one in the sections.
    whole = f"{sections}\n\n{answer}"
    written, keys = (answer if "{" in answer else whole), _BY_SCHEMA if sections else _LISTS
    try:
        document, mended = last_object(written, keys)
    except ReplyUnreadable:
        if not refuses(whole):
            raise
        notes = answer_notes(whole) or without_thoughts(whole).strip()[:LONGEST_NOTES]
        return ReadReply(modification=Modification(), notes=notes, is_refusal=True)
    names = vectors.short_names(scene)
    block = validate(_Block, _unwrap(document, names) if sections else document)
    problems = _find_problems(block, names, radius_m)
    if problems:
        raise ReplyUnreadable(problems[:_MOST_PROBLEMS])
    modification = fit_boxes(scene, _modification(block, scene, names))
    actions = _sections(sections or answer, _HEADS).get("Modification Dict", "")
    return ReadReply(
        modification=modification,
        notes=block.unchanged or answer_notes(sections or answer),
        mended=mended or any(document.get(key, ()) is None for key in _LISTS),
        is_refusal=modification.is_empty and "{" not in actions,
    )


def block_schema(scene: Scene, *, radius_m: float) -> dict[str, object]:
    """Return the JSON schema of a modifier's block: ids are those that its prompt shows.

    Every field is required, as strict endpoints insist: what may be left out is null instead. It
    changes something or says why not, for a small model's lists are empty by mere likelihood.
    """
    names = vectors.short_names(scene)
    lanes = [names.lanes[name] for name in find_spans(scene, radius_m)]
    others = [names.agents[agent.id] for agent in scene.agents]
    number: _Schema = {"type": "number"}
    point = _list_schema(number, 2, 2)
    of_lane = _one_of(lanes)
    start = [
        _object_schema(kind=_one_of(["time"]), after_s=number),
        _object_schema(kind=_one_of(["ego_distance"]), within_m=number),
        _object_schema(
            kind=_one_of(["place"]),
            agent_id=_one_of([EGO_ID, *others]),
            **dict.fromkeys(("x_m", "y_m", "within_m"), number),
        ),
    ]
    along = _object_schema(
        kind=_one_of(["lanes"]), lane_ids=_list_schema(of_lane, 1, _MOST_LANES), change_m=number
    )
    over = _object_schema(
        kind=_one_of(["points"]),
        points_m=_list_schema(point, 1, 40),
        keeps_heading={"type": "boolean"},
    )
    motion = _object_schema(
        start={"anyOf": start},
        path={"anyOf": [*([along] if lanes else []), over, _NULL]},
        speeds=_list_schema(point, 0, _MOST_SPEEDS),
    )
    numbers = ("x_m", "y_m", "heading_rad", "width_m", "length_m", "speed_mps")
    body = dict.fromkeys(numbers, number) | {
        "lane": {"anyOf": [*([of_lane] if lanes else []), _NULL]}
    }
    walker = {"type": _one_of([AgentType.PEDESTRIAN])} | body
    walker["walk_to"] = {"anyOf": [point, _NULL]}
    mover = {"type": _one_of(_TYPES)} | body | {"motion": {"anyOf": [_NULL, motion]}}

    def agent(**named: _Schema) -> _Schema:
        return {"anyOf": [_object_schema(**named, **fields) for fields in (mover, walker)]}

    lists = {"add": (agent(), _MOST_ADDED)}
    if others:
        chosen = _one_of(others)
        lists |= {"move": (agent(id=chosen), _MOST_MOVED), "remove": (chosen, len(others))}
    changes = [
        _object_schema(
            **{
                name: _list_schema(items, int(name == first), most)
                for name, (items, most) in [*lists.items()][index:]
            }
        )
        for index, first in enumerate(lists)
    ]
    unchanged = _object_schema(unchanged={"type": "string"})
    return _object_schema(block={"anyOf": [*changes, unchanged]})


def answer_notes(answer: str) -> str:
    """Return the sections Insights and Summary of an answer, shortened; empty without them."""
    bodies = _sections(answer, _HEADS)
    notes = [bodies.get("Insights", ""), bodies.get("Summary", "")]
    return "\n\n".join(part for part in notes if part)[:LONGEST_NOTES]


def read_ratings(answer: str, *, accepted_from: float) -> RatedReview:
    """Return the text reviewer's ratings and feedback.

    Args:
        answer: The raw text.
        accepted_from: The mean below which there must be feedback.

    Raises:
        ReplyUnreadable: A rating is missing or no whole number from 1 to 5, or there is nothing
            that the modifier could be told.
    """
    document, _ = last_object(answer, frozenset({"ratings", "feedback"}))
    review = validate(RatedReview, document)
    if review.ratings.mean < accepted_from and not review.feedback:
        rule = f"feedback: must not be empty where the mean rating is below {accepted_from:g}"
        raise ReplyUnreadable([rule])
    parts = _sections(answer, "Summary|Questions|Answers|Ratings|Review")
    heads = ("summary", "questions", "answers")
    return review.model_copy(update={head: parts.get(head.title(), "") for head in heads})


def read_questions(answer: str) -> tuple[str, ...]:
    """Return the engineer's questions to the viewer.

    Raises:
        ReplyUnreadable: They are missing, too few or too many.
    """
    document, _ = last_object(answer, frozenset({"questions"}))
    return tuple(validate(_QuestionBlock, document).questions)


def read_verdict(answer: str) -> EngineerVerdict:
    """Return the engineer's verdict.

    Raises:
        ReplyUnreadable: It is missing, or it and the feedback contradict each other.
    """
    document, _ = last_object(answer, frozenset({"verdict", "feedback"}))
    verdict = validate(EngineerVerdict, document)
    if (verdict.verdict == "accept") == bool(verdict.feedback):
        rule = 'feedback: must be empty with "accept" and must not be empty with "feedback"'
        raise ReplyUnreadable([rule])
    return verdict


def read_sight(answer: str, count: int) -> dict[int, str]:
    """Return the viewer's answer to each question by its number, without unanswered ones.

    Raises:
        ReplyUnreadable: No line begins with the number of a question.
    """
    if len(answer) > LONGEST_ANSWER:
        raise ReplyUnreadable([f"the answer is longer than {LONGEST_ANSWER} characters"])
    seen: dict[int, str] = {}
    parts = re.split(
        r"^[ \t*#_(]*([0-9]{1,2})[ \t]*\\?[.):](?![0-9])",
        without_thoughts(answer),
        flags=re.MULTILINE,
    )
    for number, text in zip(map(int, parts[1::2]), parts[2::2], strict=True):
        words = " ".join(text.split()).strip(" *")
        if 1 <= number <= count and number not in seen and words:
            seen[number] = words[:LONGEST_ENTRY]
    if not seen:
        raise ReplyUnreadable(["no line begins with the number of a question"])
    return seen


def read_judge(answer: str) -> JudgeAnswer:
    """Return a judge's decision.

    Raises:
        ReplyUnreadable: There is none.
    """
    document, _ = last_object(answer, frozenset({"better"}))
    return validate(JudgeAnswer, document)


def read_intent(answer: str) -> Intent:
    """Return the intent of a reader's answer; that nothing can be placed is one too.

    Raises:
        ReplyUnreadable: There is no block, or it breaks the schema or contradicts itself.
    """
    document, _ = last_object(answer, _ASKED | {"beyond"})
    if document.get("beyond") and not any(document.get(name) for name in _ASKED):
        document = {**document, "unmet": NOTHING_TO_PLACE}
    try:
        return intent_from_parts(without_nulls(document))
    except InvalidDocument as fault:
        problems = fault.problems[:_MOST_PROBLEMS]
    raise ReplyUnreadable(
        [f"{ascii(path).strip(chr(39))[:80]}: {text}" for path, text in problems]
    )


# Private


def _one_of(words: Sequence[str]) -> _Schema:
    return {"type": "string", "enum": [str(word) for word in words]}


def _list_schema(items: _Schema, least: int, most: int) -> _Schema:
    return {"type": "array", "items": items, "minItems": least, "maxItems": most}


def _object_schema(**fields: _Schema) -> _Schema:
    return {
        "type": "object",
        "properties": fields,
        "required": [*fields],
        "additionalProperties": False,
    }


def _find_problems(block: _Block, names: vectors.ShortNames, radius_m: float) -> list[str]:
    problems = []
    if block.unchanged and (block.add or block.move or block.remove):
        problems.append("unchanged: a block that changes something has none")
    for agent in [*block.add, *block.move]:
        ends = (agent.x_m, agent.y_m, *(agent.walk_to or ()))
        far_m = 2.0 * radius_m  # who moves may leave what is shown
        if max(map(abs, ends)) > radius_m:
            problems.append(f"{agent.id}: x and y must lie between -{radius_m:g} and {radius_m:g}")
        if any(abs(value) > far_m for point in agent.path_m for value in point):
            problems.append(f"{agent.id}: points_m must lie between -{far_m:g} and {far_m:g}")
        if agent.lane is not None and agent.lane not in names.lane_ids:
            problems.append(f"{agent.id}: its lane is none of the scene's; null means none")
        if agent.walk_to is not None and agent.type != AgentType.PEDESTRIAN:
            problems.append(f"{agent.id}: only a PEDESTRIAN has walk_to")
        if agent.walk_to is not None and agent.motion is not None:
            problems.append(f"{agent.id}: it has walk_to or a motion, not both")
    return problems


def _unwrap(document: dict[str, object], names: vectors.ShortNames) -> object:
    """Return the block of `block_schema`, its added agents numbered from the first new id on."""
    block = document["block"] if document.keys() == {"block"} else document
    added = block.get("add") if isinstance(block, dict) else None
    first = int(names.next_agent.removeprefix("Agent"))
    for number, agent in enumerate(added if isinstance(added, list) else [], start=first):
        if isinstance(agent, dict):
            agent.setdefault("id", f"Agent{number}")
    return block


def _modification(block: _Block, scene: Scene, names: vectors.ShortNames) -> Modification:
    """Return the change in the scene's own ids; its faults are told in the short ones."""
    shown = vectors.with_short_ids(scene, names)
    change = Modification(
        added=tuple(_agent(agent) for agent in block.add),
        # The same entry twice means what it means once.
        moved=tuple(dict.fromkeys(map(_agent, block.move))),
        removed=tuple(dict.fromkeys(block.remove)),
    )
    try:
        check_motions(shown, change)
    except InvalidModification as error:
        raise ReplyUnreadable([str(error)]) from None
    if {agent.id for agent in change.added} & names.agents.keys():
        raise ReplyUnreadable(
            [f"an added agent's id is taken: number them from {names.next_agent}"]
        )
    return vectors.with_scene_ids(change, names)


def _agent(agent: _Agent) -> TrafficAgent:
    return TrafficAgent(
        **agent.model_dump(exclude={"heading_rad", "lane", "walk_to", "motion"}),
        heading_rad=wrap(agent.heading_rad),
        lane_id=agent.lane,
        motion=agent.motion,
        walk_to_m=None if agent.walk_to is None else (agent.walk_to[0], agent.walk_to[1]),
    )


def _sections(answer: str, heads: str) -> dict[str, str]:
    """Return the text under each of some headings of an answer."""
    parts = re.split(rf"^[ \t#*_]*({heads})[ \t#*_]*:[ \t*_]*", answer, flags=re.MULTILINE)
    bodies = zip(parts[1::2], parts[2::2], strict=True)
    return {head: body.strip()[:LONGEST_NOTES] for head, body in bodies}
