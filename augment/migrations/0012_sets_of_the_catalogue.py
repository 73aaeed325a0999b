from __future__ import annotations

import django.db.models.deletion
from django.db import migrations, models


def name_the_set(apps, schema_editor):
    """All that was in the catalogue so far is its paper set."""
    apps.get_model("augment", "Scenario").objects.filter(in_catalogue=True).update(
        catalogue_set="paper"
    )


def name_the_catalogue(apps, schema_editor):
    apps.get_model("augment", "Scenario").objects.exclude(catalogue_set="").update(
        in_catalogue=True
    )


class Migration(migrations.Migration):
    dependencies = [("augment", "0011_options_and_samples")]

    operations = [
        migrations.AddField(
            model_name="scenario",
            name="catalogue_set",
            field=models.CharField(
                blank=True,
                choices=[("paper", "paper"), ("hard", "hard")],
                db_index=True,
                default="",
                help_text="the part of the authored catalogue that it belongs to; empty for all others",
                max_length=10,
            ),
            preserve_default=False,
        ),
        migrations.AddField(
            model_name="scenario",
            name="language",
            field=models.CharField(default="en", help_text="of the instruction", max_length=2),
        ),
        migrations.AddField(
            model_name="scenario",
            name="paraphrase_of",
            field=models.ForeignKey(
                blank=True,
                help_text="the scenario that it asks for in other words",
                null=True,
                on_delete=django.db.models.deletion.PROTECT,
                related_name="paraphrases",
                to="augment.scenario",
            ),
        ),
        migrations.RunPython(name_the_set, name_the_catalogue),
        migrations.RemoveField(model_name="scenario", name="in_catalogue"),
    ]
