"""Intervals in closed form are spelled as every option spells them."""

from __future__ import annotations

from django.db import migrations, models


def spell_closed(apps, schema_editor):
    snapshots = apps.get_model("arena", "Snapshot").objects.using(schema_editor.connection.alias)
    snapshots.filter(intervals="closed form").update(intervals="closed")


def spell_closed_form(apps, schema_editor):
    snapshots = apps.get_model("arena", "Snapshot").objects.using(schema_editor.connection.alias)
    snapshots.filter(intervals="closed").update(intervals="closed form")


class Migration(migrations.Migration):
    dependencies = [("arena", "0027_settled_pairs")]

    operations = [
        migrations.RunPython(spell_closed, spell_closed_form),
        migrations.AlterField(
            model_name="snapshot",
            name="intervals",
            field=models.CharField(
                default="resamples", help_text="closed or resamples", max_length=20
            ),
        ),
    ]
