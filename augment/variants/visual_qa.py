"""Visual QA: an engineer asks, a viewer looks at the rendered picture, the engineer decides.

The viewer gets the picture and the questions alone. The picture is drawn by the one renderer, with
ids and metres in it, under the ids that the engineer's vectors use; its window depends on the
scene and on what is reviewed, never on a reference.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from augment.errors import ModelRefused, ReplyUnreadable, ReviewUnusable
from augment.prompts import fill_review
from augment.prompts.names import short_names
from augment.prompts.review import read_questions, read_sight, read_verdict
from augment.prompts.texts import model_message
from augment.render.camera import WIDTH_PX, camera_for
from augment.render.reviewed import draw_for_review
from augment.scene.entities import Modification, Scene
from augment.variants.respondents import Inquiry, Messages
from augment.variants.review import Review, Submission, Verdict
from augment.variants.transcript import ModelRole


def review_picture(submission: Submission) -> Verdict:
    """The engineer's verdict on what the viewer sees.

    Raises:
        ReviewUnusable: One of the two declined or can't be read, not even asked once more.
        ModelFault: The wire broke for good.
    """
    limits = submission.limits
    engineer = Inquiry(
        respondents=submission.respondents,
        role=ModelRole.ENGINEER,
        again=fill_review.review_re_ask_messages,
        max_tokens=limits.max_tokens,
        re_asks=limits.re_asks,
    )
    messages = fill_review.engineer_messages(
        submission.scene,
        submission.instruction,
        submission.modification,
        radius_m=limits.radius_m,
        earlier=submission.told,
    )
    try:
        questions, asked, reply = engineer.read(messages, read_questions)
        viewer = replace(engineer, role=ModelRole.VIEWER)
        seen = _seen(submission, questions, viewer)
        said: Messages = (*asked, model_message(reply.text))
        verdict, _, _ = engineer.read(
            fill_review.verdict_messages(said, questions, seen), read_verdict
        )
    except ReplyUnreadable as unreadable:
        raise ReviewUnusable("; ".join(unreadable.problems)) from unreadable
    except ModelRefused as refused:
        raise ReviewUnusable(f"a reviewer declined: {refused}") from refused
    return Verdict(
        is_accepted=verdict.is_accepted,
        score=(float(verdict.is_accepted),),
        feedback=tuple(entry.sentence for entry in verdict.feedback),
        summary="accepted" if verdict.is_accepted else f"{len(verdict.feedback)} problems named",
        document={
            "questions": list(questions),
            "answers": {str(number): said for number, said in sorted(seen.items())},
            "accepted": verdict.is_accepted,
            "feedback": [entry.model_dump() for entry in verdict.feedback],
            "remarks": list(verdict.remarks),
        },
    )


def pictures(
    scene: Scene, modification: Modification, *, width_px: int = WIDTH_PX
) -> tuple[bytes, ...]:
    """What the viewer is shown: a PNG with ids, metres and the change, and the change enlarged."""
    shown, change = _under_short_names(scene, modification)
    return draw_for_review(shown, change, camera_for(shown, change).at_width(width_px))


def _seen(submission: Submission, questions: tuple[str, ...], inquiry: Inquiry) -> dict[int, str]:
    """What the viewer answers to the questions, by their numbers."""
    shown = pictures(
        submission.scene, submission.modification, width_px=submission.limits.picture_px
    )
    inquiry = replace(
        inquiry, again=lambda told, said, _: fill_review.viewer_re_ask_messages(told, said)
    )
    messages = fill_review.viewer_messages(questions, shown)
    seen, _, _ = inquiry.read(messages, partial(read_sight, count=len(questions)))
    return seen


def _under_short_names(scene: Scene, modification: Modification) -> tuple[Scene, Modification]:
    """Both under the ids that the prompts use."""
    names = short_names(scene)
    shown = replace(
        scene,
        ego=replace(scene.ego, id=names.agents[scene.ego.id]),
        agents=tuple(replace(a, id=names.agents[a.id]) for a in scene.agents),
        lanes=tuple(
            replace(
                lane,
                id=names.lanes[lane.id],
                left_neighbor=names.lanes.get(lane.left_neighbor or ""),
                right_neighbor=names.lanes.get(lane.right_neighbor or ""),
                successors=tuple(names.lanes[n] for n in lane.successors if n in names.lanes),
            )
            for lane in scene.lanes
        ),
        connectors=tuple(
            replace(
                connector,
                id=names.lanes[connector.id],
                from_lane=names.lanes.get(connector.from_lane or ""),
                to_lane=names.lanes.get(connector.to_lane or ""),
            )
            for connector in scene.connectors
        ),
    )
    change = Modification(
        added=modification.added,
        moved=tuple(replace(a, id=names.agents[a.id]) for a in modification.moved),
        removed=tuple(names.agents[name] for name in modification.removed),
    )
    return shown, change


VISUAL_REVIEW = Review(
    name="visual",
    judge=review_picture,
    asks=(ModelRole.ENGINEER, ModelRole.VIEWER, ModelRole.ENGINEER),
    options=("picture_px",),
)
