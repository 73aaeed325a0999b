from django.db import migrations, models


class Migration(migrations.Migration):
    dependencies = [("augment", "0017_corrections_by_hand")]

    operations = [
        migrations.AddField(
            model_name="modelcall",
            name="removed_at",
            field=models.DateTimeField(
                blank=True,
                help_text=(
                    "its messages and its answer were removed for their age; the numbers stay"
                ),
                null=True,
            ),
        ),
    ]
