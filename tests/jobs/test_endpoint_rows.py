"""Endpoints and their models as rows, and as admins edit them."""

from __future__ import annotations

from typing import Any

import pytest

from augment.models import EndpointModel
from augment.services.endpoints import contestants
from augment.services.endpoints.known_endpoints import ensure_endpoint

pytestmark = pytest.mark.django_db
LOCAL = "http://127.0.0.1:11434/v1"


def form(*models: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """What a browser sends from the page of an endpoint."""
    fields = {
        "label": "local",
        "base_url": LOCAL,
        "key_variable": "",
        "max_concurrency": "4",
        "requests_per_minute": "",
    }
    sent = fields | changes
    held = sum("id" in model for model in models)
    sent |= {"models-TOTAL_FORMS": str(len(models)), "models-INITIAL_FORMS": str(held)}
    for number, model in enumerate(models):
        sent |= {f"models-{number}-{name}": value for name, value in model.items()}
    return sent


def problems(page: Any) -> str:
    errors = [str(page.context["adminform"].form.errors)]
    errors += [str(inline.formset.errors) for inline in page.context["inline_admin_formsets"]]
    return " ".join(errors)


def test_a_contestant_brings_its_model_which_is_unknown() -> None:
    ensure_endpoint(label="local", base_url=LOCAL)
    for variant in ("otm", "otm"):
        contestants.add_contestant(
            slug="llama", variant=variant, endpoint="local", model="llama3.1"
        )
    known = EndpointModel.objects.get()
    assert (known.endpoint.label, known.model, known.model_class) == ("local", "llama3.1", "")
    abilities = (known.native_tools, known.vision, known.json_schema, known.temperature)
    assert abilities == (None, None, None, None)
    assert (known.price_in_usd, known.price_out_usd) == (None, None)
