"""The form of a new rating, and rating at once or by a worker."""

from functools import partial
from typing import Any, Unpack

from django import forms
from django.contrib import messages
from django.db import transaction
from django.http import HttpRequest

from arena.models import Question, Snapshot, Study
from arena.rating.rules import METHOD_TEXTS
from arena.results.services.rating_request import RatingRequest
from arena.results.services.ratings import Choices, is_big, plan_snapshot, rate_now
from arena.shell import sending
from arena.shell.acts import send_later
from arena.shell.forms import RequestForm, offer
from augment.services import to_inputs
from augment.services.scenarios import type_choices


class AnyOf(forms.MultipleChoiceField):
    """Codes of experts; rating itself refuses those that do not occur."""

    def valid_value(self, value: Any) -> bool:
        """Accept any ticked value."""
        return True


class RatingForm(RequestForm):
    """Method, resampling and which votes count; experts are offered as a rating names them."""

    inputs = to_inputs(RatingRequest)
    experts = AnyOf(required=False)

    def __init__(
        self,
        data: dict[str, Any] | None = None,
        *,
        snapshot: Snapshot | None = None,
        study: Study | None = None,
    ) -> None:
        super().__init__(data)
        if study is not None:
            offer(self, "question", ((key, Question(key).label) for key in study.questions))
        offer(self, "method", ((key, text) for key, text in METHOD_TEXTS.items() if key != "elo"))
        for name in ("method", "rounds", "seed"):
            self.fields[name].required = False
        offer(self, "types", type_choices())
        names = snapshot.results.judges if snapshot is not None else {}
        self.judges = sorted(names.items(), key=lambda item: item[1])


def rate_or_send(request: HttpRequest, study: Study, **choices: Unpack[Choices]) -> None:
    """Rate a study's current votes; with many of them a worker does, and a message says so.

    Raises:
        AugmentError: Those of `plan_snapshot`; QueueFault where no worker is reached.
    """
    if not is_big(study):
        send_later(request, sending.send_charts, rate_now(study=study, **choices).pk)
        return
    with transaction.atomic():
        planned = plan_snapshot(study=study, **choices)
        transaction.on_commit(partial(sending.send_snapshot, planned.pk))
    messages.success(request, "The rating is being computed.")
