from __future__ import annotations

import json

from django.db import migrations, models


def find_origins(apps, schema_editor):
    """Link the variants that are there: nobody kept what a family, a sweep or a copy was made from.

    A variant is on the scene of the first one and repeats its instruction before a bracket, or has an
    agent at the same pose in its reference.
    """
    scenarios = apps.get_model("augment", "Scenario").objects
    origins, instructions, poses = {}, {}, {}
    columns = ("pk", "code", "base_scene_id", "paraphrase_of_id", "follows_id")
    more = ("instruction", "instruction_is_generated", "reference")
    for row in scenarios.order_by("pk").values(*columns, *more):
        scene, text, reference = row["base_scene_id"], row["instruction"], row["reference"] or {}
        placed = [
            json.dumps([scene, *(round(agent[name], 2) for name in ("x_m", "y_m", "heading_rad"))])
            for agent in (*reference.get("add", ()), *reference.get("move", ()))
        ]
        before = [origins.get(row["paraphrase_of_id"]), origins.get(row["follows_id"])]
        if row["instruction_is_generated"]:
            before += [
                origin
                for (where, start), origin in instructions.items()
                if where == scene and text.startswith(f"{start} (")
            ]
        before += [poses.get(pose) for pose in placed]
        origin = next((found for found in before if found), row["code"])
        origins[row["pk"]] = origin
        instructions.setdefault((scene, text), origin)
        for pose in placed:
            poses.setdefault(pose, origin)
        scenarios.filter(pk=row["pk"]).update(origin=origin)


class Migration(migrations.Migration):
    dependencies = [("augment", "0038_key_bindings")]

    operations = [
        migrations.AddField(
            model_name="scenario",
            name="origin",
            field=models.UUIDField(
                db_index=True,
                editable=False,
                help_text="code of the scenario that it goes back to: as a variant, a copy, other words "
                "or a follow-up; its own code for all others",
                null=True,
            ),
        ),
        migrations.RunPython(find_origins, migrations.RunPython.noop),
    ]
