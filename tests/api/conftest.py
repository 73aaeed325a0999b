import pytest

from arena.models import Study
from tests.study_rows import a_study


@pytest.fixture
def study() -> Study:
    return a_study()
