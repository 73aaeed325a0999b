from __future__ import annotations

from django.db import migrations, models


class Migration(migrations.Migration):
    dependencies = [("augment", "0043_fc_plus")]

    operations = [
        migrations.AlterField(
            model_name="scenario",
            name="catalogue_set",
            field=models.CharField(
                blank=True,
                choices=[("paper", "paper"), ("hard", "hard"), ("moving", "moving"), ("follow-ups", "follow-ups"), ("open", "open")],
                db_index=True,
                help_text="the part of the authored catalogue that it belongs to; empty for all others",
                max_length=10,
            ),
        ),
    ]
