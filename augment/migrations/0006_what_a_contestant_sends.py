from typing import Any

from django.apps.registry import Apps
from django.db import migrations, models
from django.db.backends.base.schema import BaseDatabaseSchemaEditor

ROLES = ("modifier", "reviewer", "engineer", "viewer")


def fix_what_was_sent(apps: Apps, editor: BaseDatabaseSchemaEditor) -> None:
    """Who ran already goes on with what its first answered call in each role was sent with."""
    for contestant in apps.get_model("augment", "Contestant").objects.exclude(endpoint=None):
        sends = {}
        for role in ROLES:
            calls = apps.get_model("augment", "ModelCall").objects.filter(
                attempt__augmentation__contestant=contestant, role=role, answer__isnull=False
            )
            first = calls.order_by("pk").first()
            if first is not None:
                sends[role] = _sent(first.request, _known(apps, contestant, role))
        if sends:
            contestant.sends = sends
            contestant.save(update_fields=["sends"])


def _known(apps: Apps, contestant: Any, role: str) -> Any:
    """What is known of the model in that role, None where nobody entered anything."""
    chosen = contestant.roles.get(role)
    label = chosen["endpoint"] if chosen else contestant.endpoint.label
    model = chosen["model"] if chosen else contestant.model
    models_known = apps.get_model("augment", "EndpointModel").objects
    return models_known.filter(endpoint__label=label, model=model).first()


def _sent(request: dict[str, Any], known: Any) -> dict[str, Any]:
    limit = request.get("max_completion_tokens", request.get("max_tokens"))
    most = None if known is None else known.max_output_tokens
    return {
        "native_tools": "tools" in request,
        "vision": None if known is None else known.vision,
        "refused": ["max_completion_tokens"] if "max_tokens" in request else [],
        "reasoning_effort": request.get("reasoning_effort", ""),
        # Entered since, where it would have made the answer shorter than it was.
        "max_output_tokens": None if most is None or limit is None or limit > most else most,
    }


class Migration(migrations.Migration):

    dependencies = [
        ("augment", "0005_workers"),
    ]

    operations = [
        migrations.AddField(
            model_name="contestant",
            name="sends",
            field=models.JSONField(
                blank=True,
                editable=False,
                help_text="by role, what its models were known to take when it first ran; "
                "null before",
                null=True,
            ),
        ),
        migrations.RunPython(fix_what_was_sent, migrations.RunPython.noop),
    ]
