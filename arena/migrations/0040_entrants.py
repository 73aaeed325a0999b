"""Tokens of entrants, who submit systems and never vote."""

from django.db import migrations, models

ROLES = ["admin", "researcher", "expert", "entrant"]


class Migration(migrations.Migration):
    dependencies = [("arena", "0039_boards")]

    operations = [
        migrations.RemoveConstraint(model_name="apitoken", name="api_token_role_is_known"),
        migrations.AlterField(
            model_name="apitoken",
            name="role",
            field=models.CharField(choices=[(name, name) for name in ROLES], max_length=10),
        ),
        migrations.AddConstraint(
            model_name="apitoken",
            constraint=models.CheckConstraint(
                condition=models.Q(role__in=ROLES), name="api_token_role_is_known"
            ),
        ),
    ]
