from typing import Any

from django.apps.registry import Apps
from django.db import migrations, models
from django.db.backends.base.schema import BaseDatabaseSchemaEditor


def freeze_what_ran(apps: Apps, editor: BaseDatabaseSchemaEditor) -> None:
    """Who ran already did so with what was the only choice then, and with the prompts it had."""
    ran = apps.get_model("augment", "Contestant").objects.exclude(sends=None)
    rows = apps.get_model("augment", "Augmentation").objects
    calls = apps.get_model("augment", "ModelCall").objects.filter(answer__isnull=False)
    for contestant in ran:
        frozen = _options_before(contestant)
        for row in rows.filter(contestant=contestant, attempts__calls__answer__isnull=False).distinct():
            last = calls.filter(attempt__augmentation=row).order_by("pk").last()
            frozen = frozen | {"prompt_version": last.prompt_version}
            rows.filter(pk=row.pk).update(options=frozen)
        if "prompt_version" in frozen:
            contestant.frozen_options = frozen
            contestant.save(update_fields=["frozen_options"])


def _options_before(contestant: Any) -> dict[str, Any]:
    parts = contestant.variant.split("+")
    options: dict[str, Any] = {"max_output_tokens": 8192, "radius_m": 80.0}
    if "fc" in parts:
        native = contestant.sends.get("modifier", {}).get("native_tools") is True
        options["protocol"] = "native" if native else "prompt"
    if {"tqa", "vqa", "geo"} & set(parts):
        options["rounds"] = 3
    if "tqa" in parts:
        options["accepted_from"] = 4.0
    if "vqa" in parts:
        options["picture_px"] = 1200
    return options


class Migration(migrations.Migration):

    dependencies = [
        ('augment', '0010_what_sources_leave_open'),
    ]

    operations = [
        migrations.AlterModelOptions(
            name='augmentation',
            options={'ordering': ('scenario__slug', 'contestant__slug', 'sample')},
        ),
        migrations.RemoveConstraint(
            model_name='augmentation',
            name='one_augmentation_per_cell',
        ),
        migrations.RemoveConstraint(
            model_name='scenario',
            name='scenario_type_is_known',
        ),
        migrations.AddField(
            model_name='augmentation',
            name='options',
            field=models.JSONField(blank=True, help_text='with which its contestant asked; null where no model was asked', null=True),
        ),
        migrations.AddField(
            model_name='augmentation',
            name='sample',
            field=models.PositiveSmallIntegerField(default=1, help_text='1 for the first'),
        ),
        migrations.AddField(
            model_name='contestant',
            name='frozen_options',
            field=models.JSONField(blank=True, editable=False, help_text='the whole set with which it runs, fixed at its first run; null before', null=True),
        ),
        migrations.AddField(
            model_name='contestant',
            name='options',
            field=models.JSONField(blank=True, default=dict, help_text='chosen when it was added: {"temperature": 0.7}; what is open is not in it'),
        ),
        migrations.AddField(
            model_name='contestant',
            name='retired_at',
            field=models.DateTimeField(blank=True, help_text='forms offer it no more; what it made stays', null=True),
        ),
        migrations.AddField(
            model_name='generationjob',
            name='samples',
            field=models.PositiveSmallIntegerField(default=1, help_text='so often every contestant is asked about every scenario'),
        ),
        migrations.AddField(
            model_name='scenario',
            name='type_label',
            field=models.CharField(blank=True, help_text="of a type of your own; empty for the paper's five", max_length=60),
        ),
        migrations.AlterField(
            model_name='scenario',
            name='type',
            field=models.CharField(help_text="one of the paper's five, or a slug of your own: cut_in", max_length=40),
        ),
        migrations.AddConstraint(
            model_name='augmentation',
            constraint=models.UniqueConstraint(fields=('job', 'scenario', 'contestant', 'sample'), name='one_augmentation_per_cell'),
        ),
        migrations.AddConstraint(
            model_name='augmentation',
            constraint=models.CheckConstraint(condition=models.Q(('sample__gte', 1)), name='sample_counts_from_one'),
        ),
        migrations.AddConstraint(
            model_name='scenario',
            constraint=models.CheckConstraint(condition=models.Q(models.Q(('type__in', ['approaching_construction_zone', 'avoid_crashed_cars', 'jaywalking_pedestrian', 'nudge_around_parked_vehicle', 'overtake_parked_vehicle']), ('type_label', '')), models.Q(models.Q(('type__in', ['approaching_construction_zone', 'avoid_crashed_cars', 'jaywalking_pedestrian', 'nudge_around_parked_vehicle', 'overtake_parked_vehicle']), _negated=True), models.Q(('type', ''), _negated=True), models.Q(('type_label', ''), _negated=True)), _connector='OR'), name='scenario_type_of_ones_own_has_a_label'),
        ),
        migrations.RunPython(freeze_what_ran, migrations.RunPython.noop),
    ]
