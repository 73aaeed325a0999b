"""Addresses that are told what happens, and what became of it; for admins."""

from __future__ import annotations

import uuid
from typing import Any, cast

from django import forms
from django.contrib import messages
from django.contrib.auth.models import User
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils.translation import gettext as _
from django.utils.translation import gettext_lazy
from django.views.decorators.cache import never_cache
from django.views.decorators.http import require_http_methods, require_POST

from arena.models import Webhook, WebhookDelivery
from arena.queries.webhooks import EVENTS, webhooks_with_counts
from arena.services.webhooks import (
    FreshWebhook,
    add_webhook,
    remove_webhook,
    renew_secret,
    send_again,
    send_test,
    set_webhook_active,
)
from arena.web.access import ADMIN, allow_only
from arena.web.questions import Confirmation, ask, is_sure
from augment.errors import AugmentError
from augment.services.wording import translate

EVENT_NAMES = {
    "job.finished": gettext_lazy("Job finished"),
    "job.budget_hit": gettext_lazy("Job stopped at its cap"),
    "study.closed": gettext_lazy("Study closed"),
    "snapshot.frozen": gettext_lazy("Rating frozen"),
    "test": gettext_lazy("Test"),
}
SHOWN = 100


class WebhookForm(forms.Form):
    """A new address."""

    name = forms.CharField(max_length=80, label=gettext_lazy("Name"))
    url = forms.CharField(max_length=500, label=gettext_lazy("Address"))
    events = forms.MultipleChoiceField(
        choices=[(event.value, EVENT_NAMES[event.value]) for event in EVENTS],
        initial=[event.value for event in EVENTS],
        label=gettext_lazy("Is told of"),
        error_messages={"required": gettext_lazy("Choose at least one event.")},
    )


@allow_only(ADMIN)
@never_cache
@require_http_methods(["GET", "HEAD", "POST"])
def webhooks_page(request: HttpRequest) -> HttpResponse:
    """Every address, and a form for a new one, whose secret is shown this once."""
    form = WebhookForm(request.POST if request.method == "POST" else None)
    fresh = None
    if request.method == "POST" and form.is_valid():
        try:
            fresh = add_webhook(**form.cleaned_data, actor=cast(User, request.user))
        except AugmentError as error:
            form.add_error(None, translate(error))
        else:
            form = WebhookForm()
    context = {
        "form": form,
        "fresh": fresh,
        "webhooks": [(row, _names(row.events)) for row in webhooks_with_counts()],
        "chosen": form["events"].value() or [],
    }
    return render(request, "api/webhooks.html", context, status=422 if form.errors else 200)


@allow_only(ADMIN)
@never_cache
@require_http_methods(["GET", "HEAD"])
def webhook_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """One address with what it was told and what it answered."""
    return _shown(request, get_object_or_404(Webhook, code=code), None)


@allow_only(ADMIN)
@never_cache
@require_POST
def change_webhook(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Pause, resume, test it, or give it a new secret, which is shown this once."""
    webhook, act = get_object_or_404(Webhook, code=code), request.POST.get("act")
    actor = cast(User, request.user)
    if act == "secret":
        return _shown(request, webhook, renew_secret(webhook=webhook, actor=actor))
    if act == "test":
        send_test(webhook=webhook)
        messages.success(request, _("A worker sends the test within seconds."))
    elif act in ("pause", "resume"):
        set_webhook_active(webhook=webhook, is_active=act == "resume", actor=actor)
    return redirect("webhook", code=code)


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def forget_webhook(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Ask, then remove it with its deliveries."""
    webhook = get_object_or_404(Webhook, code=code)
    if not is_sure(request):
        back = reverse("webhook", args=[code])
        return ask(
            request,
            Confirmation(
                title=_("Remove “%(name)s”?") % {"name": webhook.name},
                facts=(_("It is told nothing more, and its deliveries are forgotten."),),
                button=_("Remove"),
                back=back,
                crumbs=((_("Webhooks"), reverse("webhooks")), (webhook.name, back)),
            ),
        )
    remove_webhook(webhook=webhook, actor=cast(User, request.user))
    messages.success(request, _("“%(name)s” is removed.") % {"name": webhook.name})
    return redirect("webhooks")


@allow_only(ADMIN)
@require_POST
def repeat_delivery(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Have a message sent again."""
    rows = WebhookDelivery.objects.select_related("webhook")
    delivery = get_object_or_404(rows, code=code)
    send_again(delivery=delivery)
    messages.success(request, _("A worker sends it again within seconds."))
    return redirect("webhook", code=delivery.webhook.code)


# --- Private -----------------------------------------------------------------------------------


def _shown(request: HttpRequest, webhook: Webhook, fresh: FreshWebhook | None) -> HttpResponse:
    rows = webhook.deliveries.all()[:SHOWN]
    context: dict[str, Any] = {
        "webhook": webhook,
        "fresh": fresh,
        "names": _names(webhook.events),
        "deliveries": [(row, EVENT_NAMES[row.event]) for row in rows],
    }
    return render(request, "api/webhook.html", context)


def _names(events: list[str]) -> list[str]:
    return [str(EVENT_NAMES[event]) for event in events if event in EVENT_NAMES]
