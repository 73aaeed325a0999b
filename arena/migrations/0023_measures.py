from itertools import combinations

from django.db import migrations, models

AIDS = (
    *("zoom", "original", "ruler", "flip", "text", "replay", "blink", "difference"),
    "measures",
)
AID_SETS = [" ".join(chosen) for n in range(len(AIDS) + 1) for chosen in combinations(AIDS, n)]


class Migration(migrations.Migration):
    dependencies = [("arena", "0022_enrolments")]

    operations = [
        migrations.AddField(
            model_name="study",
            name="allow_measures",
            field=models.BooleanField(
                default=False,
                help_text="experts may lay lines of the instruction and distances to lane edges "
                "over both",
            ),
        ),
        migrations.RemoveConstraint(model_name="vote", name="vote_aids_are_known"),
        migrations.AddConstraint(
            model_name="vote",
            constraint=models.CheckConstraint(
                condition=models.Q(aids__in=AID_SETS), name="vote_aids_are_known"
            ),
        ),
    ]
