"""How many examples a property is tried on.

`make test` uses the profile `fixed`, which draws the same examples on every machine; `make fuzz`
uses `fuzz`, which draws new ones, ten times as many.
"""

from hypothesis import HealthCheck, settings

# Whether a property holds does not depend on how busy the machine is.
_UNHURRIED = settings(
    deadline=None, max_examples=100, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("fixed", _UNHURRIED, derandomize=True, database=None)
settings.register_profile("fuzz", _UNHURRIED, max_examples=1000, print_blob=True)


def examples(count: int) -> settings:
    """Settings for `count` examples, scaled as the loaded profile scales the default of 100."""
    return settings(max_examples=max(count * settings().max_examples // 100, 1))
