"""Analysts are called researchers: the group of accounts and the role of tokens."""

from django.db import migrations, models

KNOWN = "api_token_role_is_known"


def renamed(old, new):
    def rename(apps, schema_editor):
        apps.get_model("auth", "Group").objects.filter(name=old).update(name=new)
        apps.get_model("arena", "ApiToken").objects.filter(role=old).update(role=new)

    return rename


class Migration(migrations.Migration):
    dependencies = [("arena", "0029_work"), ("auth", "0012_alter_user_first_name_max_length")]

    operations = [
        migrations.RemoveConstraint(model_name="apitoken", name=KNOWN),
        migrations.RunPython(renamed("analyst", "researcher"), renamed("researcher", "analyst")),
        migrations.AlterField(
            model_name="apitoken",
            name="role",
            field=models.CharField(
                choices=[(name, name) for name in ("admin", "researcher", "expert")], max_length=10
            ),
        ),
        migrations.AddConstraint(
            model_name="apitoken",
            constraint=models.CheckConstraint(
                condition=models.Q(role__in=["admin", "researcher", "expert"]), name=KNOWN
            ),
        ),
    ]
