"""Workers say which variables for keys they have."""

from django.db import migrations, models


class Migration(migrations.Migration):
    dependencies = [("augment", "0024_no_second_chances")]

    operations = [
        migrations.AddField(
            model_name="worker",
            name="keys",
            field=models.JSONField(
                default=list, help_text="names of the variables for keys that are set there"
            ),
        ),
    ]
